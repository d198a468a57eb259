"""Boats with sails: the wind's force in every profile, fixed and hinged, mirror images, commands, and courses."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from vrx_mj import Batch, Simulation, compile_world
from vrx_mj.errors import ConfigError
from vrx_mj.model.world import broken_references
from vrx_mj.physics.wind import AIR_DENSITY

URDF = """<robot name="sloop"><link name="base_link">
<inertial><origin xyz="0 0 -0.4"/><mass value="200"/>
<inertia ixx="80" iyy="150" izz="160" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="3 1 0.5"/></geometry></collision></link>
<link name="boom"><inertial><origin xyz="-0.7 0 1"/><mass value="2"/>
<inertia ixx="1" iyy="1" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="mast" type="revolute"><parent link="base_link"/><child link="boom"/>
<origin xyz="0.4 0 0.3"/><axis xyz="0 0 1"/><limit lower="-1.5" upper="1.5" effort="0" velocity="0"/></joint>
<link name="blade"/><joint name="stock" type="revolute"><parent link="base_link"/><child link="blade"/>
<origin xyz="-1.5 0 -0.4"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="10" velocity="10"/></joint>
</robot>"""
NORTH, WIND = math.pi / 2, 6.0
YAML = """urdf: sloop.urdf
thrusters: {{}}
sails: {{main: {{joint: mast, area: 4, center: [-0.7, 0, 1.2]{keys}}}}}
rudders:
  rudder: {{joint: stock, area: 0.06, aspect_ratio: 2, center: [-0.1, 0, -0.2]}}
  keel: {{area: 0.4, aspect_ratio: 1.5, center: [0.1, 0, -0.8]}}
hydrodynamics: {{added_mass: [10, 200, 200, 20, 60, 60], drag_linear: [10, 60, 900, 200, 500, 150],
  drag_quadratic: [15, 200, 0, 0, 0, 50]}}
"""
PLATE = ", coefficients: [" + ", ".join(
    f"[{a}, {math.sin(2 * math.radians(a)):.15f}, {1 - math.cos(2 * math.radians(a)):.15f}]" for a in range(181)
) + "]"  # fmt: skip
FIXED = ", sheet: false"

pytestmark = pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")


@pytest.fixture
def sloop(tmp_path, monkeypatch):
    """Simulations of a sloop at a heading [rad] in a wind toward the west; `sail` are further keys of its sail."""
    monkeypatch.chdir(tmp_path)

    def made(sail="", *, profile="marine", heading=NORTH, wind=WIND, engines="fixed", **keys):
        (tmp_path / "sloop.urdf").write_text(URDF, encoding="utf-8")
        (tmp_path / "sloop.yaml").write_text(YAML.format(keys=sail), encoding="utf-8")
        fleet = {
            "robot": "./sloop.urdf",
            "engines": engines,
            "boats": [{"name": "s", "pose": [0, 0, 0, 0, 0, heading]}],
        }
        air = {"direction": 180, "mean_velocity": wind, "objects": [{"model": "s", "coefficients": [0, 0, 0]}]}
        world = {"name": "bay", "physics": {"profile": profile}, "sea": {"model": "none"}, "wind": air} | keys
        return Simulation(compile_world(world, fleet=fleet))

    return made


def held(sim, boom, heading=NORTH, velocity=(0.0, 0.0)):
    """The sail's wrench on a boat that is held at a heading while its boom goes to an angle."""
    for _ in range(int(3.0 / sim.timestep)):
        sim.set_boat("s", pose=(0, 0, 0, 0, 0, heading), velocity=[*velocity, 0.0, 0.0, 0.0, 0.0])
        sim.step({"s": {"main_angle": boom}}, duration=sim.timestep)
    sim.set_boat("s", pose=(0, 0, 0, 0, 0, heading), velocity=[*velocity, 0.0, 0.0, 0.0, 0.0])
    return sim.forces("s")["sail"]


@pytest.mark.parametrize("engines", ["fixed", "hinged"])
@pytest.mark.parametrize("profile", ["vrx", "vrx3", "marine"])
def test_a_steady_wind_pushes_a_sail_as_the_plate_that_it_is(sloop, profile, engines):
    """F = rho / 2 A V^2 2 sin(a) across the boom, at the centre of effort, in each profile.

    The wind comes over the starboard beam of a bow that points north, and the boom lies to port, to lee.
    """
    sim = sloop(PLATE + FIXED, profile=profile, engines=engines)
    found = held(sim, -0.5)
    boom = sim.steering("s")["main"]
    assert boom == pytest.approx(-0.5, abs=0.1)  # the servo of a hinge gives way a little
    size = 0.5 * AIR_DENSITY * 4.0 * WIND**2 * 2.0 * math.sin(math.pi / 2 + boom)
    force = size * np.array([-math.cos(boom), -math.sin(boom), 0.0])
    assert found[:3] == pytest.approx(force, rel=2e-4)  # rows each degree
    hung = boom if engines == "hinged" else 0.0
    boat = (200.0 * np.array([0.0, 0.0, -0.4]) + 2.0 * aft(hung, 1.3)) / 202.0
    assert found[3:] == pytest.approx(np.cross(aft(boom, 1.5) - boat, force), rel=2e-4, abs=1e-3)


def aft(boom, z):
    """A place 0.7 m along the boom, on a boat that points north."""
    return np.array([0.7 * math.sin(boom), 0.4 - 0.7 * math.cos(boom), z])


def test_at_rest_the_next_step_applies_what_forces_say(sloop):
    sim = sloop()
    held(sim, 0.6)
    found = sim.forces("s")
    sim.advance(1)
    applied = sim.data.xfrc_applied[sim.model.body("s/base_link").id]
    assert applied == pytest.approx(found["hydrostatics"] + found["sail"], rel=1e-9, abs=1e-6)
    assert np.hypot(*found["sail"][:2]) > 50.0


def test_a_boat_that_drifts_with_the_wind_feels_none(sloop):
    sim = sloop(FIXED)
    assert held(sim, 0.4, heading=0.0, velocity=(-WIND, 0.0))[:3] == pytest.approx(np.zeros(3), abs=1e-9)


def sailed(sim, sheet, heading, seconds=60.0):
    """Speed made good along a heading that the rudder keeps, at the end [m/s]."""
    for _ in range(int(2 * seconds)):
        seen = sim.observe()["s"]
        error = math.remainder(seen.heading - heading, math.tau)
        helm = 2.0 * error + 1.5 * float(seen.angular_velocity[2])
        sim.step({"s": {"main_angle": sheet, "rudder_angle": max(-0.6, min(0.6, helm))}}, duration=0.5)
    seen = sim.observe()["s"]
    return seen.speed * math.cos(seen.course - heading)


@pytest.mark.slow
def test_points_of_sail(sloop):
    """A beam reach is faster than a run in the same wind, a close reach makes way to windward, and irons none."""
    reach = max(sailed(sloop(), sheet, NORTH) for sheet in (0.5, 0.7, 0.9))
    run = max(sailed(sloop(heading=math.pi), sheet, math.pi) for sheet in (0.9, 1.2, 1.5))
    close = sailed(sloop(heading=math.radians(50)), 0.35, math.radians(50))
    assert reach > 1.15 * run > 1.0
    assert close > 0.5
    assert sailed(sloop(heading=0.0), 0.3, 0.0) < 0.05


def test_the_other_tack_is_the_mirror_image(sloop):
    """Bows to the north-west and to the south-west in a wind from the east."""
    tracks = []
    for side in (1.0, -1.0):
        sim = sloop(heading=side * 2.2)
        sim.step({"s": {"main_angle": 0.7, "rudder_angle": side * 0.1}}, duration=8.0)
        seen = sim.observe()["s"]
        tracks.append([*seen.position[:2] * (1.0, side), side * seen.heading, seen.speed])
    assert tracks[0] == pytest.approx(tracks[1], rel=1e-6, abs=1e-6)
    assert tracks[0][3] > 0.3


def test_rows_of_a_batch_sail_as_runs_do(sloop):
    sim = sloop(profile="vrx")
    batch = Batch(sim.world, 2)
    assert batch.channels == (("s", "rudder_angle"), ("s", "main_angle"))
    batch.step(np.array([[0.0, 0.0], [0.1, 0.6]]), duration=2.0)
    sim.step({"s": {"rudder_angle": 0.1, "main_angle": 0.6}}, duration=2.0)
    assert (batch.qpos[1] == sim.data.qpos).all()


def test_commands_of_sails_are_angles(sloop):
    sim = sloop()
    assert set(sim.command_names("s")) == {"main_angle", "rudder_angle"}  # a keel is fixed
    assert not sim.observe()["s"].thrusters
    assert set(sim.observe()["s"].hull.rudders) == {"rudder"}


@pytest.mark.parametrize(("keys", "message"), [
    (", coefficients: [[0, 0, 0.1], [90, 0, 1]]",
     "sails.main.coefficients: angles from 0 to 180 are needed, got 0 to 90"),
    (", coefficients: [[0, 0, 0.1], [90, 0, 1], [90, 0, 1], [180, 0, 1]]",
     "sails.main.coefficients[2]: an angle above 90, that of the previous row, is needed, got 90"),
])  # fmt: skip
def test_what_no_sail_is(sloop, keys, message):
    with pytest.raises(ConfigError) as caught:
        sloop(keys)
    assert message in str(caught.value)


def test_a_boom_turns(sloop, monkeypatch):
    monkeypatch.setitem(globals(), "URDF", URDF.replace('name="mast" type="revolute"', 'name="mast" type="fixed"'))
    with pytest.raises(ConfigError, match=re.escape("sails.main.joint: the joint 'mast' does not turn")):
        sloop()


def test_a_saved_sail_has_a_curve(sloop):
    parameters = sloop().world.parameters
    bare = replace(parameters, thrusters=tuple(replace(item, sail=None) for item in parameters.thrusters))
    assert list(broken_references(parameters)) == []
    assert list(broken_references(bare)) == ["thrusters[2].sail: a sail has a curve, and nothing else has"]
