"""GPS and IMU of profile `marine` measure where they are mounted: closed forms of a barge that nothing damps."""

import math

import numpy as np
import pytest

from vrx_mj import Simulation, compile_world

G, RHO, MASS = 9.81, 1025.0, 4100.0
UP, AHEAD, ASIDE = 3.0, 1.5, 0.8
"""Of the masthead over the centre of mass, and of the bow's sensors ahead and to port of it [m]."""
NONE = "[0, 0, 0, 0, 0, 0]"
URDF = """<robot name="barge"><link name="base_link">
<inertial><origin xyz="0 0 -0.2"/><mass value="4100"/>
<inertia ixx="1500" iyy="6000" izz="7000" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="4 2 1"/></geometry></collision></link></robot>"""
YAML = f"""urdf: barge.urdf
hull: {{added_mass: {NONE}, damping_linear: {NONE}, damping_quadratic: {NONE}}}
sensors:
  - {{type: imu, name: masthead, link: base_link, pose: [0, 0, {UP - 0.2}, 0, 0, 0], rate: 100}}
  - {{type: imu, name: bow, link: base_link, pose: [{AHEAD}, {ASIDE}, 0, 0, 0, 0], rate: 100}}
  - {{type: gps, name: receiver, link: base_link, pose: [{AHEAD}, {ASIDE}, 0, 0, 0, 0], rate: 100}}
"""


def barge(folder, profile="marine"):
    (folder / "barge.urdf").write_text(URDF, encoding="utf-8")
    (folder / "barge.yaml").write_text(YAML, encoding="utf-8")
    world = {
        "name": "bay", "physics": {"profile": profile, "timestep": 0.01, "gravity": G}, "sea": {"model": "none"},
        "spawn": {"robot": "./barge.urdf"}, "georeference": {"latitude": -33.7, "longitude": 150.7},
    }  # fmt: skip
    sim = Simulation(compile_world(world))
    return sim, sim.boats[0]


@pytest.fixture(autouse=True)
def _in_its_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def reading(sim, boat, name):
    return sim.sense(boat)[name].data


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
class TestMarine:
    def test_a_boat_that_turns_and_goes_ahead(self, tmp_path):
        """v_P = v + w x r, and a_P = w x (w x r), towards the axis of a boat whose middle goes straight on."""
        sim, boat = barge(tmp_path)
        rate, speed = 0.5, 1.2
        sim.set_boat(boat, pose=(0, 0, 0, 0, 0, 0), velocity=(speed, 0, 0, 0, 0, rate))
        for name in ("bow", "receiver"):
            reading(sim, boat, name)
        for _ in range(50):
            sim.step(duration=0.01)
            fix, inertia = reading(sim, boat, "receiver"), reading(sim, boat, "bow")
            yaw = rate * sim.time
            arm = AHEAD * math.cos(yaw) - ASIDE * math.sin(yaw), AHEAD * math.sin(yaw) + ASIDE * math.cos(yaw)
            east, north = speed - rate * arm[1], rate * arm[0]
            assert fix.velocity == pytest.approx((north, -east, 0.0), abs=1e-4)
            # the mean over a step, whose change of velocity points to the axis at the middle of the step
            half = 0.5 * rate * 0.01
            turn = np.array([[math.cos(half), math.sin(half)], [-math.sin(half), math.cos(half)]])
            toward = -(rate**2) * math.sin(half) / half * turn.T @ (AHEAD, ASIDE)
            assert inertia.linear_acceleration[:2] == pytest.approx(toward, abs=2e-3)
            assert inertia.linear_acceleration[2] == pytest.approx(G, abs=2e-2)

    def test_a_masthead_that_rolls(self, tmp_path):
        """Small free roll p0 cos(w t) about the centre of mass: g p - h p'' to port at the masthead."""
        sim, boat = barge(tmp_path)
        start = 0.01
        volume = MASS / RHO
        stiffness = RHO * G * (8.0 * 4.0 / 12.0 + volume * (-0.25 + 0.2))
        omega = math.sqrt(stiffness / 1500.0)
        sim.set_boat(boat, pose=(0, 0, 0, start, 0, 0))
        reading(sim, boat, "masthead")
        found, expected = [], []
        for _ in range(300):
            sim.step(duration=0.01)
            found.append(reading(sim, boat, "masthead").linear_acceleration[1])
            roll = start * math.cos(omega * (sim.time - 0.005))
            expected.append((G + UP * omega**2) * roll)
        found, expected = np.array(found), np.array(expected)
        assert np.abs(found - expected).max() < 0.03 * expected.max()
        assert found.max() == pytest.approx(start * (G + UP * omega**2), rel=0.01)
        assert start * (G + UP * omega**2) > 2.0 * start * G  # so that a unit at the base link would not pass


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
@pytest.mark.parametrize("profile", ["vrx", "vrx3", "marine"])
def test_a_receiver_is_where_it_is_mounted(tmp_path, profile):
    sim, boat = barge(tmp_path, profile)
    fix = reading(sim, boat, "receiver")
    radius = (
        6_378_137.0 * math.cos(math.radians(-33.7)) / math.sqrt(1 - 0.00669438 * math.sin(math.radians(-33.7)) ** 2)
    )
    x = sim.observe()[boat].position[0]
    assert math.radians(fix.longitude - 150.7) * radius == pytest.approx(x + AHEAD, abs=1e-3)
