"""A world turned by an angle whose georeference turns back: on Earth nothing has changed, and all wires say so."""

import math

import numpy as np
import pytest

import vrx_mj
from ros_scene import SERVERS, run, served
from vrx_mj.control import StationKeeper, WaypointFollower
from vrx_mj.draw.course import map_of
from vrx_mj.draw.map import chart
from vrx_mj.runtime.run import run as sail

ANGLE = 37.0
SHORT = {"initial_state_duration": 1, "ready_state_duration": 1, "running_state_duration": 20}
GOAL = (12.0, -6.0, 1.0)
EARTH = {"latitude": -33.72, "longitude": 150.67, "elevation": 0.0}
DEGREES = 1e-8
"""Of latitude and longitude: a millimetre, which is more than 30 s of a boat in waves make of the last bits."""


def world(angle, task):
    """The same place on Earth, its x axis `angle` [degrees] from east: what a file gives from x is turned back."""
    turn = -math.radians(angle)
    cos, sin = math.cos(turn), math.sin(turn)

    def placed(x, y, yaw):
        return [cos * x - sin * y, sin * x + cos * y, yaw + turn]

    tasks = {
        "stationkeeping": {"goal_cart": placed(*GOAL)},
        "wayfinding": {"waypoints": [[-33.7199, 150.6701, 0.5], [-33.72, 150.6702, -2.0]]},  # of Earth in any world
    }
    x, y, yaw = placed(3.0, 4.0, 0.3)
    return {
        "extends": "ocean",
        "physics": {"profile": "marine"},
        "georeference": {**EARTH, "heading": angle},
        "sea": {
            "model": "pms",
            "gain": 0.3,
            "period": 5.0,
            "direction": [cos * 0.6 - sin * 0.8, sin * 0.6 + cos * 0.8],
        },
        "wind": {"direction": 120.0 - angle, "mean_velocity": 4.0, "var_gain": 1.0, "var_time": 2.0, "seed": 3},
        "current": {"direction": 30.0 - angle, "speed": 0.2},
        "spawn": {"pose": [x, y, 0.1, 0, 0, yaw], "thrusters": "X", "sensors": ["gps", "imu"]},
        "task": {"type": task, **tasks[task], **SHORT},
    }


def compiled(angle, task="stationkeeping"):
    return vrx_mj.compile_world(world(angle, task))


def bow(orientation):
    """Yaw [rad] of a quaternion (w, x, y, z)."""
    w, x, y, z = orientation
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@pytest.fixture(scope="module", params=["stationkeeping", "wayfinding"])
def ends(request):
    """Simulations and summaries of the same run in both worlds."""
    make = {"stationkeeping": StationKeeper, "wayfinding": WaypointFollower}[request.param]
    sims = [vrx_mj.Simulation(compiled(angle, request.param)) for angle in (0.0, ANGLE)]
    return [(sim, sail(sim, 22.0, controller=make())) for sim in sims]


@pytest.mark.slow
def test_the_summary_is_that_of_the_unturned_world(ends):
    (one, turned) = (summary for _, summary in ends)
    assert turned.task.score == pytest.approx(one.task.score, rel=1e-4)
    for name in ("heading_compass", "course_compass", "distance"):
        assert getattr(turned.boats["wamv"], name) == pytest.approx(getattr(one.boats["wamv"], name), abs=0.05)
    off = math.degrees(one.boats["wamv"].heading - turned.boats["wamv"].heading)
    assert math.remainder(off - ANGLE, 360.0) == pytest.approx(0.0, abs=0.05)  # from x as before


def test_sensors_and_the_task_tell_of_the_same_earth(ends):
    seen = []
    for sim, _ in ends:
        readings, task = sim.sense("wamv"), sim.task
        goals = task["waypoints"] if "waypoints" in task else [task["goal"]]
        seen.append((readings["gps_wamv"].data, readings["imu_wamv"].data, goals))
    (fix, inertia, goals), (other_fix, other_inertia, other_goals) = seen
    assert (other_fix.latitude, other_fix.longitude) == pytest.approx((fix.latitude, fix.longitude), abs=DEGREES)
    assert other_fix.velocity == pytest.approx(fix.velocity, abs=1e-3)
    assert other_fix.position_covariance == fix.position_covariance
    assert other_inertia.orientation == pytest.approx(inertia.orientation, abs=1e-3)
    for goal, other in zip(goals, other_goals, strict=True):
        for key in ("latitude", "longitude", "yaw_from_east"):
            assert other[key] == pytest.approx(goal[key], abs=1e-9)
        assert other["yaw"] == pytest.approx(goal["yaw"] - math.radians(ANGLE))


def test_the_unturned_worlds_numbers_are_from_east():
    """So that the others are not equal to something wrong."""
    sim = vrx_mj.Simulation(compiled(0.0))
    inertia = sim.sense("wamv")["imu_wamv"].data
    assert bow(inertia.orientation) == pytest.approx(sim.observe()["wamv"].heading, abs=1e-3)


@pytest.mark.parametrize("dialect", ["vrx", "vrx3"])
def test_the_topics_of_ros_are_those_of_the_unturned_world(dialect):
    goal = "/vrx/station_keeping/goal" if dialect == "vrx" else "/vrx/stationkeeping/goal"
    wanted = {goal, "/vrx/debug/wind/direction", "/wamv/sensors/imu/imu/data", "/wamv/sensors/gps/gps/fix"}
    wires = []
    for angle in (0.0, ANGLE):
        scene = served(compiled(angle), wanted=wanted, dialect=dialect)
        run(scene, 2.5)
        got = {name: scene.network.got[name][-1].message for name in scene.network.got}
        fix = next(message for name, message in got.items() if "/gps/" in name)
        imu = next(message for name, message in got.items() if "/imu/" in name)
        turns = [one.orientation for one in (got[goal].pose, imu)]
        wires.append(
            [(fix.latitude, fix.longitude), got["/vrx/debug/wind/direction"].data]
            + [bow((turn.w, turn.x, turn.y, turn.z)) for turn in turns]
        )
    while SERVERS:
        SERVERS.pop().close()
    (place, *numbers), (other_place, *others) = wires
    assert other_place == pytest.approx(place, abs=DEGREES)
    assert others == pytest.approx(numbers, abs=1e-4)
    assert numbers[:2] == pytest.approx([120.0, GOAL[2]], abs=1e-6)


def plots(path):
    """The last values of the plots of a recording, by name."""
    from rerun.chunk import RrdReader

    found = {}
    for chunk in RrdReader(path).stream().filter(content="/plots/**", components="Scalars:scalars"):
        rows = chunk.to_record_batch().to_pydict().get("Scalars:scalars", [])
        found.setdefault(chunk.entity_path.rpartition("/")[2], []).extend(row[0] for row in rows if row is not None)
    return found


def test_the_plots_of_a_recording_are_those_of_the_unturned_world(tmp_path):
    recorded = []
    for angle in (0.0, ANGLE):
        sim = vrx_mj.Simulation(compiled(angle))
        with vrx_mj.record(sim, tmp_path / "run.rrd", sea=False):
            sim.step(duration=2.0)
            sim.set_boat("wamv", pose=[0, 0, 0.1, 0, 0, math.radians(-170.0 - angle)], velocity=[1, 0, 0, 0, 0, -0.5])
            sim.step(duration=8.0)
        recorded.append(plots(tmp_path / "run.rrd"))
    one, turned = recorded
    for name in ("heading", "course"):
        off = (np.array(turned[name]) - one[name] + 180.0) % 360.0 - 180.0
        assert np.abs(off[10:]).max() < 0.1
        assert min(turned[name]) >= 0.0
        assert max(turned[name]) <= 360.0
    assert np.abs(turned["yaw"]).max() <= 180.0
    assert turned["yaw"][0] == pytest.approx(one["yaw"][0] - ANGLE, abs=0.01)


def test_the_map_names_the_bearings_of_the_unturned_world():
    (rose, words), (other_rose, other_words) = (compass(map_of(compiled(angle))) for angle in (0.0, ANGLE))
    assert "toward 330° (120°)" in words[1]
    assert [text.partition(" (")[0] for text in other_words] == [text.partition(" (")[0] for text in words]
    for letter, (x, y) in rose.items():
        angle = math.degrees(math.atan2(other_rose[letter][1], other_rose[letter][0]) - math.atan2(y, x))
        assert math.remainder(angle + ANGLE, 360.0) == pytest.approx(0.0, abs=1e-6)


def compass(scene):
    """Where the letters of a map's rose are, and the words under it."""
    texts = chart(scene, (1600, 1100)).axes[1].texts
    rose = {text.get_text(): text.get_position() for text in texts if len(text.get_text()) == 1}
    return rose, [text.get_text() for text in texts if "toward " in text.get_text()]
