"""What moves in a recording: when it is shown, and where arrows and engines point."""

import math
from dataclasses import replace

import numpy as np
import pytest

import recorded_run
import vrx_mj
from integration.sailing import boats, water
from vrx_mj.frames import quaternion, rotation_matrix
from vrx_mj.recording.motion_chunks import (
    POSE_STEP,
    MovingChunks,
    engine,
    motion,
    part_poses,
    thrust_arrows,
    transforms,
)
from vrx_mj.recording.reader import read_record
from vrx_mj.recording.record_scene import RecordedJoint, RecordedPart, RecordedThruster
from vrx_mj.recording.simulation_scene import scene_of
from vrx_mj.recording.timeline import Ticker

STERN = RecordedThruster("stern", "a", (-2.0, 0.0, 0.1))
BACKWARD = RecordedThruster("back", "a", (2.0, 1.0, 0.1), mount=quaternion(0.0, 0.0, math.pi))


def column(chunk, name):
    """The values of a component of a chunk."""
    batch = chunk.to_record_batch()
    return next(batch.column(found) for found in batch.schema.names if name in found).to_pylist()


def added_up(step, count):
    """Times as a loop adds them up, with its rounding."""
    return np.cumsum(np.full(count, step)) - step


@pytest.mark.parametrize("block", [1, 7, 100])
def test_ticks_come_at_their_rate_whatever_the_blocks_and_the_rounding_of_time(block):
    time, ticker = added_up(0.01, 300), Ticker(10.0)
    taken = np.concatenate([ticker(time[start : start + block]) for start in range(0, 300, block)])
    assert np.flatnonzero(taken).tolist() == list(range(0, 300, 10))


def test_quaternions_are_turned_into_reruns_order():
    turn = np.array([quaternion(0.1, 0.2, 0.3)])
    chunk = transforms("/x", np.zeros(1), np.ones((1, 3)), turn)
    x, y, z, w = np.ravel(column(chunk, "quaternion"))
    assert (w, x, y, z) == pytest.approx(turn[0], abs=1e-6)


@pytest.mark.parametrize("angle", [-0.7, 0.0, 0.4])
def test_a_thrust_arrow_points_where_the_engine_pushes(angle):
    """Steered to port, an engine pushes ahead and to port; one mounted backward, astern and to starboard."""
    steering, thrust = np.full((1, 2), angle), np.array([[55.0, 110.0]])
    chunk = thrust_arrows("/a", np.zeros(1), (STERN, BACKWARD), thrust, steering)
    begins, tips = np.array(column(chunk, "strips")[0])[:, :2].swapaxes(0, 1)
    one, other = tips - begins
    assert one == pytest.approx((math.cos(angle), math.sin(angle), 0.0), abs=1e-6)
    assert other == pytest.approx((-2.0 * math.cos(angle), -2.0 * math.sin(angle), 0.0), abs=1e-6)


def test_an_engine_that_hardly_pushes_has_no_arrow():
    thrust = np.array([[0.0, 55.0], [1.0, 0.0]])
    chunk = thrust_arrows("/a", np.arange(2.0), (STERN, BACKWARD), thrust, np.zeros((2, 2)))
    assert [len(strips) for strips in column(chunk, "strips")] == [1, 0]


@pytest.mark.parametrize("thruster", [STERN, BACKWARD])
def test_an_engine_turns_about_its_mount(thruster):
    x, y, z, w = np.ravel(column(engine("/a", np.zeros(1), thruster, np.array([0.4])), "quaternion"))
    yaw = 0.4 if thruster is STERN else math.pi + 0.4
    assert abs(np.dot((w, x, y, z), quaternion(0.0, 0.0, yaw))) == pytest.approx(1.0)


def test_plots_are_of_speed_over_ground_and_of_the_angles_of_the_orientation():
    pose = np.array([[0.0, 0.0, 0.0, *quaternion(0.1, -0.2, 2.5)]])
    speed, course, yaw, roll, pitch = motion(pose, np.array([[3.0, -4.0, 9.0, 0.0, 0.0, 0.0]]))
    assert (speed[0], course[0]) == pytest.approx((5.0, math.atan2(-4.0, 3.0)))
    assert (yaw[0], roll[0], pitch[0]) == pytest.approx((2.5, 0.1, -0.2))


def test_the_track_is_from_the_least_to_the_greatest_place_of_any_boat_in_any_block():
    moving, blocks = MovingChunks(recorded_run.scene()), list(recorded_run.blocks(2.0))
    for block in blocks:
        list(moving(block))
    rows = np.concatenate(blocks)
    places = rows[:, recorded_run.scene().layout().qpos][:, :21].reshape(-1, 7)[:, :2]
    assert moving.track == pytest.approx(np.array([places.min(axis=0), places.max(axis=0)]))


def test_the_poses_of_boats_are_those_of_the_rows():
    """A whole scene of one boat: its place and its orientation, as rerun writes them."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world(water(sea={"model": "none"}), fleet=boats((3.0, -2.0, 0.3))))
    sim.set_boat("a", pose=(3.0, -2.0, 0.5, 0.1, 0.2, 2.5))
    chunks = {chunk.entity_path: chunk for chunk in MovingChunks(scene_of(sim))(sim.row()[None])}
    x, y, z, w = np.ravel(column(chunks["/world/boats/a"], "quaternion"))
    assert (w, x, y, z) == pytest.approx(quaternion(0.1, 0.2, 2.5), abs=POSE_STEP[-1] / 2)
    assert np.ravel(column(chunks["/world/boats/a"], "translation")) == pytest.approx([3.0, -2.0, 0.5], abs=1e-6)


def shown_times(velocity, **how):
    """Times at which a boat is shown that is at rest, of a second of rows, but for a velocity in the second half."""
    scene = replace(recorded_run.scene(1), sea_height=None)
    rows = np.repeat([recorded_run.row_at(0.0, 1)], 20, axis=0)
    rows[:, 0] = np.arange(20) / 20
    layout = scene.layout()
    boat = layout.bodies[0]
    rows[:, layout.pose(boat).start] = rows[:, 0]  # so that every pose differs
    rows[:, layout.velocity(boat)] = np.where(rows[:, :1] < 0.5, 0.0, velocity)
    moving = MovingChunks(scene, **how)
    blocks = [moving(rows[i : i + 1]) for i in range(20)]
    return [chunk.to_record_batch().column("sim_time")[0].value / 1e9 for block in blocks for chunk in block
            if chunk.entity_path == "/world/boats/wamv1"]  # fmt: skip


def test_a_slow_boat_is_shown_at_half_the_rows_a_fast_one_or_a_watched_one_at_all():
    slow, fast = (1.5, 0.0, 0.1, 0.0, 0.0, 0.2), (0.0, 3.0, 0.0, 0.0, 0.0, 0.0)
    half, rows = np.arange(10) / 10, np.arange(20) / 20
    assert shown_times(slow) == pytest.approx(half)
    assert shown_times(fast) == pytest.approx([*half[:5], *rows[10:]])
    assert shown_times((0.0, 0.0, 0.3, 0.0, 0.0, 0.0)) == pytest.approx([*half[:5], *rows[10:]])
    assert shown_times(slow, live=True) == pytest.approx(rows)


def test_the_wind_s_arrow_turns_with_the_wind(tmp_path):
    """Wind toward north that turns by 3 degrees a second, counter-clockwise: after 30 s it blows toward west."""
    wind = {"direction": 90.0, "mean_velocity": 6.0, "turning": 3.0}
    world = vrx_mj.compile_world(
        water(sea={"model": "none"}, physics={"profile": "marine"}, wind=wind), fleet=boats((0, 0, 0))
    )
    sim = vrx_mj.Simulation(world)
    with vrx_mj.record(sim, tmp_path / "run.rrd"):
        sim.step(duration=30.0)
    found = read_record(tmp_path / "run.rrd")
    assert found.wind_angle == pytest.approx(np.radians(3.0 * found.time), abs=1e-6)
    assert found.rows[-1].tolist() == sim.row().tolist()
    chunks = {chunk.entity_path: chunk for chunk in MovingChunks(scene_of(sim))(found.rows[[0, -1]])}
    for path in ("/world/fleet/weather", "/world/plan/weather"):
        first, last = (strip[1] - strip[0] for strip in np.reshape(column(chunks[path], "strips"), (2, -1, 3)))
        assert first / np.linalg.norm(first) == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
        assert last / np.linalg.norm(last) == pytest.approx([-1.0, 0.0, 0.0], abs=1e-3)
    assert column(chunks["/world/fleet/weather/figures"], "labels") == [
        ["wind 6.0 m/s from 180 deg"],
        ["wind 6.0 m/s from 90 deg"],
    ]


ANGLE = np.linspace(-1.2, 1.2, 7)
ANCHOR, AXIS = np.array([0.5, -1.0, 0.25]), np.array([0.6, 0.0, 0.8])
HINGE = RecordedJoint("hinge", tuple(ANCHOR), tuple(AXIS), 7)
PART = RecordedPart("/block", (2.0, 0.5, 0.1, 1.0, 0.0, 0.0, 0.0), (HINGE,))


def at(angle):
    """Rows of positions in which the hinge is at these angles."""
    return np.column_stack([np.zeros((len(angle), 7)), angle])


def test_a_part_turns_about_its_axis_counter_clockwise():
    _, turns = part_poses(PART, at(ANGLE))
    across = np.array([0.0, 1.0, 0.0])
    for angle, turn in zip(ANGLE, turns, strict=True):
        matrix = rotation_matrix(turn)
        assert matrix @ AXIS == pytest.approx(AXIS)
        assert matrix @ across == pytest.approx(np.cos(angle) * across + np.sin(angle) * np.cross(AXIS, across))


def test_the_hinge_stays_where_it_is():
    for position, turn in zip(*part_poses(PART, at(ANGLE)), strict=True):
        assert position + rotation_matrix(turn) @ ANCHOR == pytest.approx(PART.pose[:3] + ANCHOR)


def test_only_while_a_run_is_watched_the_plan_goes_with_the_fleet():
    """In a file it stays where it frames the track, and a viewer prefers what moves."""
    rows = next(recorded_run.blocks(1.0))
    scene = recorded_run.scene()
    live = {chunk.entity_path: chunk for chunk in MovingChunks(scene, live=True)(rows)}
    middle = rows[:, scene.layout().qpos][:, :21].reshape(len(rows), 3, 7)[:, :, :2].mean(axis=1)
    places = np.array(column(live["/world/plan"], "translation")).reshape(-1, 3)
    assert places[0, :2] == pytest.approx(middle[0], abs=1e-4)
    assert places[-1, :2] == pytest.approx(middle[-2], abs=1e-4)  # at the rate of the plots
    assert "/world/plan" not in {chunk.entity_path for chunk in MovingChunks(scene)(rows)}
