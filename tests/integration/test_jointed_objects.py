"""Objects with joints in whole runs: closed forms, at rest, and all that is done to objects."""

import copy
import math

import numpy as np
import pytest

from integration.jointed import PENDULUM, RAFT, angle, place, simulation_of
from vrx_mj.constants import WATER_DENSITY

HERE = (5.0, 0.0, 0.0, 0.0, 0.0, 0.0)
G = 9.8
SEA = {"model": "pms", "gain": 0.2, "period": 5.0, "scale": 1.5, "direction": [1.0, 0.3], "tau": 2.0}


def swung(sim, joint, start, seconds, step=0.02):
    """Angle of a joint that is let go at `start` [rad], every `step` [s]."""
    sim.data.qpos[sim.model.joint(joint).qposadr[0]] = start
    out = []
    for _ in range(round(seconds / step)):
        sim.step(duration=step)
        out.append(angle(sim, joint))
    return np.array(out)


def own_period(angles, step=0.02):
    """Mean time between the downward passages of zero [s]."""
    down = np.flatnonzero((angles[:-1] > 0.0) & (angles[1:] <= 0.0))
    exact = down + angles[down] / (angles[down] - angles[down + 1])
    return float(np.mean(np.diff(exact))) * step


@pytest.mark.parametrize("profile", ["vrx", "vrx3", "marine"])
def test_a_pendulum_in_the_air_has_its_period(tmp_path, profile):
    sim = simulation_of(tmp_path, physics={"profile": profile}, crane=(PENDULUM, HERE))
    found = own_period(swung(sim, "crane/swing/axis", 0.05, 12.5))
    expected = 2 * math.pi * math.sqrt((0.1 + 2.0 * 1.0**2) / (2.0 * G * 1.0))
    assert found == pytest.approx(expected * (1 + 0.05**2 / 16), rel=5e-4)  # of steps of up to 20 ms: (omega dt)^2 / 24


@pytest.mark.parametrize("profile", ["vrx", "vrx3", "marine"])
def test_a_pendulum_under_water_is_as_slow_as_its_weight_there(tmp_path, profile):
    """Half of its weight is carried by a ball at its centre of mass, 5 m under the surface."""
    radius = (0.75 * 1.0 / WATER_DENSITY / math.pi) ** (1 / 3)
    wet = copy.deepcopy(PENDULUM)
    ball = {"type": "sphere", "radius": radius, "pose": [0, 0, -1, 0, 0, 0]}
    wet["links"][0]["buoyancy"] = {
        "fluid_density": WATER_DENSITY,
        "linear_drag": 0.0,
        "angular_drag": 0.0,
        "elements": [ball],
    }
    sim = simulation_of(tmp_path, physics={"profile": profile}, crane=(wet, (5, 0, -8, 0, 0, 0)))
    found = own_period(swung(sim, "crane/swing/axis", 0.05, 12.5))
    assert found == pytest.approx(2 * math.pi * math.sqrt(2.1 / (1.0 * G)), rel=5e-4)


def test_drag_damps_a_pendulum_under_water_as_a_closed_form_says(tmp_path):
    """I theta'' = -m g l theta - kappa theta', kappa = c_ang m L^2 with the mean extent L of a whole element.

    VRX's drag of velocity is that of the link's origin, which here is on the hinge.
    """
    wet = copy.deepcopy(PENDULUM)
    element = {"type": "box", "size": [0.1, 0.1, 0.1], "pose": [0, 0, -1, 0, 0, 0]}
    wet["links"][0]["buoyancy"] = {"linear_drag": 9.0, "angular_drag": 20.0, "elements": [element]}
    sim = simulation_of(tmp_path, physics={"timestep": 0.002}, crane=(wet, (5, 0, -8, 0, 0, 0)))
    angles = swung(sim, "crane/swing/axis", 0.05, 10.0)
    t = 0.02 * np.arange(1, len(angles) + 1)
    inertia, weight, kappa = 2.1, (2.0 - WATER_DENSITY * 0.001) * G, 20.0 * 2.0 * 0.1**2
    decay = kappa / (2 * inertia)
    omega = math.sqrt(weight / inertia - decay**2)
    expected = 0.05 * np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    assert np.abs(angles - expected).max() < 2e-4  # 0.4 % of the start: the sine of the angle, and the step


def test_a_slide_falls_to_its_limit_and_rests_there(tmp_path):
    lift = copy.deepcopy(PENDULUM)
    axis = {"xyz": [0, 0, 1], "limits": [-1.5, 0.0]}
    lift["joints"] = [{"name": "rail", "type": "prismatic", "parent": "tower", "child": "arm", "axis": axis}]
    sim = simulation_of(tmp_path, crane=(lift, HERE))
    dt = sim.timestep
    sim.step(duration=0.5)
    assert angle(sim, "crane/rail/axis") == pytest.approx(-0.5 * G * 0.5 * (0.5 + dt))  # semi-implicit Euler
    sim.step(duration=4.5)
    assert angle(sim, "crane/rail/axis") == pytest.approx(-1.5, abs=0.01)  # limits are soft
    assert abs(sim.data.qvel[-1]) < 1e-6
    assert place(sim, "crane/arm")[2] == pytest.approx(2.5, abs=0.01)


def test_a_spring_holds_an_arm_where_its_torque_is_that_of_the_weight(tmp_path):
    sprung = copy.deepcopy(PENDULUM)
    sprung["joints"][0]["axis"] |= {"stiffness": 30.0, "spring_reference": 1.2, "damping": 8.0}
    sim = simulation_of(tmp_path, crane=(sprung, HERE))
    sim.step(duration=20.0)
    theta = angle(sim, "crane/swing/axis")
    assert 30.0 * (1.2 - theta) == pytest.approx(2.0 * G * 1.0 * math.sin(theta), abs=1e-6)


def test_friction_holds_an_arm_up_to_its_torque(tmp_path):
    stuck = copy.deepcopy(PENDULUM)
    stuck["joints"][0]["axis"] |= {"friction": 15.0}
    sim = simulation_of(tmp_path, crane=(stuck, HERE))
    below, above = (math.asin(torque / (2.0 * G)) for torque in (14.5, 15.5))
    assert swung(sim, "crane/swing/axis", below, 2.0)[-1] == pytest.approx(below, abs=0.02)
    assert swung(sim, "crane/swing/axis", above, 2.0)[-1] < above - 0.05


@pytest.mark.parametrize("profile", ["vrx", "vrx3", "marine"])
def test_a_raft_of_links_rests_where_archimedes_says(tmp_path, profile):
    """Three boxes of 1 m2 carry 90 kg; the hinges let each of them find its own draft only as far as they allow."""
    sim = simulation_of(tmp_path, physics={"profile": profile}, raft=(RAFT, HERE))
    sim.step(duration=60.0)
    heights = [place(sim, f"raft/{link}")[2] for link in ("base", "left", "right")]
    wet = sum(0.2 - height for height in heights)  # floors of the boxes under water, level as they are
    density = 997.0 if profile == "vrx3" else WATER_DENSITY
    assert wet == pytest.approx(90.0 / density, rel=0.03)  # the outer boxes lean by about 0.03 rad
    raft = sim.model.body("raft/base").dofadr[0]
    assert np.abs(sim.data.qvel[raft + 2 : raft + 9]).max() < 2e-3


def test_wind_pushes_the_links_that_it_is_given_for(tmp_path):
    even = copy.deepcopy(RAFT)
    even["joints"][1] = even["joints"][0] | {"name": "other", "child": "right", "pose": [0, 0.6, 0, 0, 0, 0]}

    def final(size, link=None):
        pushed = {"model": "raft", "coefficients": [size, size, 0.0]} | ({"link": link} if link else {})
        wind = {"direction": 0, "mean_velocity": 10.0, "objects": [pushed]}
        sim = simulation_of(tmp_path, wind=wind, raft=(even, HERE))
        sim.step(duration=5.0)
        return place(sim, "raft/base")[0], sim.observe_object("raft").angular_velocity[2]

    still, pushed, turned = final(0.0), final(3.0), final(3.0, "left")
    assert pushed[0] > still[0] + 0.1
    assert abs(pushed[1]) < 1e-3 < abs(turned[1])
