"""Buoyancy and drag of floating objects."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import (
    FORCE_ERROR,
    MARKER,
    element,
    floating,
    floating_of,
    matrix,
    moving,
    moving_row,
    oracle,
    sea_of,
)
from vrx_mj.model.tables import FLOAT_STATE
from vrx_mj.physics.flotation import add_flotation_drag, flotation, flotation_of_step, water_rise
from vrx_mj.physics.motion import Wrench, motion, zero_wrench
from vrx_mj.physics.volumes import submerged_part
from vrx_mj.physics.waves import surface_height

BOX = element("box", (1.5, 1.5, 0.4), (0.0, 0.0, -0.2))
POLE = element("cylinder", (0.2, 0.15, 0.0), (0.3, -0.1, 0.1))
LIGHT_BUOY = {
    "mass": 67.15, "com": (0.1, 0.05, -0.2), "inertia": (13.486, 14.0, 25.1813, 0.5, -0.3, 0.2),
    "linear_drag": 1000.0, "angular_drag": 200.0,
}  # fmt: skip
numbers = st.floats(-2, 2)
vectors = st.tuples(numbers, numbers, numbers)
twists = st.tuples(vectors, vectors).map(lambda pair: (*pair[0], *pair[1]))
small = st.tuples(*[st.floats(-0.5, 0.5)] * 3)
wrenches = st.builds(Wrench, *[st.floats(-50, 50)] * 6)


def explicit(body, elements, moved, height, rise):
    """VRX's formula, element by element, in world axes about the centre of mass."""
    turn, total = matrix(moved), np.zeros(6)
    velocity, spin = turn @ moved[12:15], turn @ moved[15:]
    com = np.array(moved[:3]) + turn @ body["com"]
    for one in elements:
        wet = submerged_part(one, moved, height + body["level"])
        if wet.volume <= 1e-6:
            continue
        mass = body["mass"] * wet.volume / one["volume"]
        force = (0, 0, body["density"] * wet.volume * body["gravity"])
        force = force + body["linear_drag"] * mass * ((0, 0, rise) - velocity)
        force[2] = max(force[2], 0)
        torque = -mass * body["angular_drag"] * one["mean_dimension"] ** 2 * spin
        total += (*force, *(torque + np.cross(wet[1:] - com, force)))
    return total


def test_a_marker_by_hand():
    body, elements = floating([MARKER])
    moved = moving(velocity=(0.5, 0, 0.2, 0.1, 0.2, 0.3))
    wrench = np.array(flotation(body, elements, None, moved, 0.0, 0.1, 0.0, zero_wrench()).wrench)
    lever = np.array(submerged_part(elements[0], moved, 0.0)[1:]) - (0, 0, -2)
    assert wrench[:3] == pytest.approx((-191.084659, 0, 1038.86957), rel=6e-8)  # the mass has 32 bits there
    turning = wrench[3:] - np.cross(lever, wrench[:3])
    assert turning == pytest.approx((-1.29173230, -2.58346459, -3.87519689), rel=6e-8)


def test_without_a_step_it_is_vrx_s():
    for row in oracle("buoyancy_wrench"):
        body, elements = floating_of(row["model"])
        waves, water = sea_of(row["wave_set"])
        turn = matrix(moving_row(row))
        velocity = [*(turn.T @ [row[f"v{axis}_w"] for axis in "xyz"]), *(row[f"w{axis}_b"] for axis in "xyz")]
        moved = moving(
            [row[f"{axis}_m"] for axis in "xyz"],
            [row[f"{axis}_rad"] for axis in ("roll", "pitch", "yaw")],
            velocity,
        )
        before, now = (
            surface_height(waves, water, moved.x, moved.y, t) for t in (row["t_s"] - row["dt_s"], row["t_s"])
        )
        rise = (now - before) / row["dt_s"]
        wrench = flotation(body, elements, None, moved, now, rise, 0.0, zero_wrench()).wrench
        expected = [row[f"{axis}_w"] for axis in ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")]
        assert wrench == pytest.approx(expected, rel=1e-6, abs=FORCE_ERROR), row["case"]


@given(angles=small, twist=twists, z=st.floats(-0.5, 0.3), rise=st.floats(-0.5, 0.5))
def test_several_elements_without_a_step_are_the_sum_of_vrx_s(angles, twist, z, rise):
    body, elements = floating([BOX, POLE], **LIGHT_BUOY)
    moved = moving((1, 2, z), angles, twist)
    wrench = flotation(body, elements, None, moved, 0.1, rise, 0.0, zero_wrench()).wrench
    assert wrench == pytest.approx(explicit(body, elements, moved, 0.1, rise), rel=1e-9, abs=1e-6)


@given(angles=small, twist=twists, z=st.floats(-0.5, 0.3))
def test_a_short_step_comes_close_to_vrx_s(angles, twist, z):
    body, elements = floating([MARKER])
    moved = moving((1, 2, z), angles, twist)
    short, none = (flotation(body, elements, None, moved, 0.0, 0.0, dt, zero_wrench()).wrench for dt in (1e-9, 0.0))
    # dt times drag of 6e2 kg/s times 1e4 m/s2 (a torque of 4e3 N m turns 1 kg m2) times a lever of 2 m
    assert tuple(short) == pytest.approx(tuple(none), abs=2e-2)


MODEL = """
<mujoco>
  <option timestep="{dt}" gravity="0 0 -9.8"/>
  <worldbody>
    <body pos="0 0 0">
      <freejoint/>
      <inertial pos="{com}" mass="{mass}" fullinertia="{inertia}"/>
    </body>
  </worldbody>
</mujoco>
"""


def stepped(body, dt, moved, wrench):
    """The motion after one step of MuJoCo under weight and a wrench about the centre of mass."""
    values = {name: " ".join(str(float(v)) for v in body[name]) for name in ("com", "inertia")}
    model = mujoco.MjModel.from_xml_string(MODEL.format(dt=dt, mass=float(body["mass"]), **values))
    data = mujoco.MjData(model)
    mujoco.mju_mat2Quat(data.qpos[3:], np.array(moved[3:12]))
    data.qpos[:3] = moved[:3]
    data.qvel[:3] = matrix(moved) @ moved[12:15]
    data.qvel[3:] = moved[15:]
    start = data.qpos.copy()
    data.xfrc_applied[1] = wrench
    mujoco.mj_step(model, data)
    return motion(start, data.qvel, 0, 0)  # the old pose with the new velocities


@pytest.mark.parametrize("dt", [0.001, 0.01, 0.02])
@given(angles=small, twist=twists, z=st.floats(-0.4, 0.2), rise=st.floats(-0.5, 0.5), push=wrenches)
def test_drag_is_that_of_the_velocity_mujoco_ends_the_step_with(dt, angles, twist, z, rise, push):
    """VRX's formula, at the velocities after the step, gives the wrench that led to them."""
    for body, elements in (floating([MARKER]), floating([BOX, POLE], **LIGHT_BUOY)):
        moved = moving((1, 2, z), angles, twist)
        wrench = np.array(flotation(body, elements, None, moved, 0.0, rise, dt, push).wrench)
        after = stepped(body, dt, moved, wrench + push)
        assert wrench == pytest.approx(explicit(body, elements, after, 0.0, rise), rel=1e-6, abs=1e-5)


@given(up=st.floats(0, 60), z=st.floats(-0.6, 0.2), angles=small)
def test_no_element_is_pulled_down(up, z, angles):
    """A buoy that shoots up feels neither buoyancy nor vertical drag where drag would win."""
    body, elements = floating([BOX, POLE], **LIGHT_BUOY)
    turn = matrix(moving(angles=angles))
    moved = moving((0, 0, z), angles, (*(turn.T @ (0, 0, up)), 0, 0, 0))
    for dt in (0.0, 0.01):
        assert flotation(body, elements, None, moved, 0.0, 0.0, dt, zero_wrench()).wrench.fz >= 0.0


def test_elements_let_go_one_by_one():
    """The pole's drag beats its buoyancy at 2.7 m/s already... the box's at 131 m/s."""
    body, elements = floating([BOX, POLE], **(LIGHT_BUOY | {"linear_drag": 10.0}))
    limits = [1000 * 9.8 * one["volume"] / (10 * 67.15) for one in elements]
    between = moving((0, 0, -5), velocity=(0, 0, np.mean(limits), 0, 0, 0))
    wrench = flotation(body, elements, None, between, 0.0, 0.0, 0.0, zero_wrench()).wrench
    wet = submerged_part(elements[0], between, 0.0).volume
    drag = 10 * 67.15 * between.w
    assert wrench.fz == pytest.approx(9800 * wet - drag)


@pytest.mark.parametrize("model", ["marker", "light buoy"])
@pytest.mark.parametrize("dt", [0.001, 0.01, 0.02])
def test_drag_at_rest_is_rest(model, dt):
    """A buoy in balance stays: the wrench is its weight's opposite."""
    body, elements = floating([MARKER]) if model == "marker" else floating([BOX], **LIGHT_BUOY | {"com": (0, 0, -0.2)})
    z = 0.292630406 if model == "marker" else 0.370155556
    wrench = flotation(body, elements, None, moving((3, 4, z)), 0.0, 0.0, dt, zero_wrench()).wrench
    assert wrench == pytest.approx((0, 0, body["mass"] * 9.8, 0, 0, 0), rel=1e-6, abs=1e-5)


def test_the_water_s_rise_is_a_difference_of_heights():
    state = np.zeros(1, FLOAT_STATE)[0]
    assert water_rise(state, 0.03, 0.01) == pytest.approx(3.0)
    assert water_rise(state, 0.02, 0.01) == pytest.approx(-1.0)
    assert state["height"] == 0.02


def test_a_dry_object_feels_nothing():
    body, elements = floating([BOX, POLE], **LIGHT_BUOY)
    moved = moving((0, 0, 5), velocity=(1, 2, 3, 4, 5, 6))
    wrench = flotation(body, elements, None, moved, 0.0, 0.0, 0.01, zero_wrench()).wrench
    assert np.abs(wrench).max() == 0.0
    assert not any(math.isnan(value) for value in wrench)


@given(angles=small, twist=twists, z=st.floats(-0.6, 0.4))
def test_what_the_inertia_holds_is_added_to_the_wrench(angles, twist, z):
    """(F, T) + dt D (a, alpha), with the force at the origin, 2 m from the marker's centre of mass."""
    for body, elements in (floating([MARKER]), floating([BOX, POLE], **LIGHT_BUOY)):
        moved, damping = moving((1, 2, z), angles, twist), np.full(3, np.nan)
        found = flotation(body, elements, None, moved, 0.0, 0.0, 0.01, zero_wrench())
        more = np.subtract(flotation_of_step(body, moved, found, 0.01, damping), found.wrench)
        at_origin = more[3:] + np.cross(matrix(moved) @ body["com"], more[:3])
        assert damping == pytest.approx(0.01 * np.array([found.sums.k, found.sums.kz, found.sums.kappa]))
        assert more[:3] == pytest.approx(damping[[0, 0, 1]] * found.acceleration, rel=1e-9, abs=1e-9)
        assert at_origin == pytest.approx(damping[2] * np.array(found.turning), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("rows", [[1, 1, 1, 1, 1, 1], [1, 2, 3, 4, 5, 6]], ids=["diagonal", "whole"])
@pytest.mark.parametrize("behind", [0, 2])
def test_the_inertia_gets_the_damping_on_its_diagonal(rows, behind):
    counts = np.array([1, 2, *rows, *[1] * behind])
    starts = np.concatenate(([0], np.cumsum(counts)[:-1]))
    inertia = np.zeros(counts.sum())
    add_flotation_drag(inertia, starts, 2, np.array([2.0, 3.0, 5.0]))
    diagonal = inertia[np.cumsum(counts) - 1]
    assert diagonal.tolist() == [0, 0, 2, 2, 3, 5, 5, 5, *[0] * behind]
    assert inertia.sum() == 22.0
