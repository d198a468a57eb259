"""Forces on a boat by their causes: those that the next step applies, and contacts by action and reaction."""

import numpy as np
import pytest

from integration.sailing import AFLOAT, GUSTY, boats, simulation

SWELL = {"model": "pms", "gain": 1.0, "period": 6.0, "scale": 2.5, "tau": 0.0}


def test_at_rest_water_wind_and_thrust_are_what_the_next_step_applies():
    """At rest there is no drag, and nothing of added mass but what resists acceleration."""
    sim = simulation(boats((3.0, -2.0, 0.4)), sea=SWELL, wind=GUSTY)
    sim.advance(300)
    level = float(sim.sea.height(3.0, -2.0, sim.time))
    sim.set_boat("a", pose=(3.0, -2.0, level - 0.1, 0.1, -0.05, 0.4), velocity=[0.0] * 6)
    sim.command("a", left=0.8, right=0.3)
    forces = sim.forces("a")
    assert not forces["drag"].any()
    assert not forces["contact"].any()
    sim.advance(1)
    applied = sim.data.xfrc_applied[sim.model.body("a/base_link").id]
    expected = sum(forces[name] for name in ("hydrostatics", "wind", "thrust"))
    assert applied == pytest.approx(expected, rel=1e-9, abs=1e-6)
    assert forces["hydrostatics"][2] > 1000.0
    assert abs(forces["thrust"][5]) > 100.0


def moment_about_origin(sim, boat):
    """Contact force [N] and torque [N m] about the world's origin."""
    force, torque = np.split(sim.forces(boat)["contact"], 2)
    return force, torque + np.cross(sim.data.subtree_com[sim.model.body(f"{boat}/base_link").id], force)


def test_boats_that_touch_push_each_other_away_by_equal_forces():
    sim = simulation(boats((0.0, 0.0, 0.0), (20.0, 0.0, 0.0)), sea={"model": "none"}, wind=None)
    sim.set_boat("b", pose=(0.4, 2.2, AFLOAT, 0.0, 0.0, 0.1))
    sim.advance(1)
    one, other = moment_about_origin(sim, "a"), moment_about_origin(sim, "b")
    assert one[0][1] < -100.0  # b lies to port: it pushes a to starboard
    assert one[0] == pytest.approx(-other[0])
    assert one[1] == pytest.approx(-other[1], abs=1e-4 * np.abs(other[1]).max())  # centres are a step old
    assert np.abs(sim.forces("a")["contact"][3:]).max() > 10.0
