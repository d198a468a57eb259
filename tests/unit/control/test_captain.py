"""Laws of the controllers: what they do when told what, without a simulator."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.control import SKIPPERS, Captain, StationKeeper
from vrx_mj.control.navigation import Estimate
from vrx_mj.control.perception import Blob, View
from vrx_mj.control.waypoints import WildlifeCircler, _clearance, waypoint_error
from vrx_mj.errors import VrxWarning


class Engine(SimpleNamespace):
    """A thruster whose command is its force."""

    def command(self, force):
        return force


def engine(x, y, direction=(1.0, 0.0, 0.0)):
    return Engine(
        position=(x, y, 0.0), direction=direction, max_angle=0.0, max_forward=250.0, max_reverse=-100.0, max_command=1.0
    )


ENGINES = {"left": engine(-2.65, 1.03), "right": engine(-2.65, -1.03), "lateral": engine(0, 0, (0.0, 1.0, 0.0))}


def boat(x=0.0, y=0.0, heading=0.0):
    return SimpleNamespace(
        sensors={},
        thrusters=ENGINES,
        position=np.array([x, y, 0.0]),
        quaternion=np.array([math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)]),
        velocity=np.zeros(3),
        angular_velocity=np.zeros(3),
    )


def steered(controller, task, **pose):
    with pytest.warns(VrxWarning, match="navigation by ground truth: the boat has no GPS"):
        return controller({"wamv": boat(**pose), "task": task}, 0.0)["wamv"]


def estimate(x, y, heading):
    c, s = math.cos(heading), math.sin(heading)
    return Estimate(x, y, 0.0, heading, 0.0, 0.0, 0.0, np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))


GOAL = {"x": 20.0, "y": 0.0, "yaw": 1.0, "latitude": None, "longitude": None}


def test_nothing_is_commanded_before_the_boat_is_let_go():
    assert steered(StationKeeper(), {"type": "stationkeeping", "state": "initial"}) == {}


@pytest.mark.parametrize("kind", SKIPPERS)
def test_thrusters_stop_when_the_task_has_finished(kind):
    sent = SKIPPERS[kind]()({"wamv": boat(), "task": {"type": kind, "state": "finished", "goal": GOAL}}, 0.0)
    assert sent == {"wamv": dict.fromkeys(ENGINES, 0.0)}


def test_from_afar_a_boat_goes_bow_first():
    commands = steered(StationKeeper(), {"type": "stationkeeping", "state": "ready", "goal": GOAL})
    assert commands["left"] == pytest.approx(commands["right"])
    assert commands["left"] > 100.0


def test_near_by_it_turns_to_its_heading():
    commands = steered(StationKeeper(), {"type": "stationkeeping", "state": "ready", "goal": {**GOAL, "x": 0.0}})
    assert commands["right"] > 0.0 > commands["left"]


def test_without_a_task_the_captain_holds_the_pose():
    captain = Captain()
    with pytest.warns(VrxWarning):
        commands = captain({"wamv": boat(3.0, 4.0, 0.5)}, 0.0)["wamv"]
    assert commands == pytest.approx({"left": 0.0, "right": 0.0, "lateral": 0.0})


@pytest.mark.parametrize("task", SKIPPERS)
def test_the_captain_knows_who_steers_and_forgets(task):
    captain = Captain()
    steered(captain, {"type": task, "state": "initial"})
    assert type(captain._skipper) is SKIPPERS[task]
    captain.reset(1)
    assert captain._skipper is None


@pytest.mark.parametrize(("name", "sense"), [("turtle", 1.0), ("platypus", -1.0)])
def test_a_boat_beside_an_animal_goes_around_it_in_its_sense(name, sense):
    task = {"type": "wildlife", "state": "running", "animals": [{"name": name, "x": 0.0, "y": 0.0}]}
    commands = steered(WildlifeCircler(), task, x=5.5, heading=sense * math.pi / 2)
    assert commands["left"] + commands["right"] > 100.0  # ahead, along the circle
    assert sense * (commands["right"] - commands["left"]) > 0.0  # and into it


def test_a_crocodile_in_the_way_is_passed():
    animals = [{"name": "turtle", "x": 60.0, "y": 0.0}, {"name": "crocodile", "x": 30.0, "y": 1.0}]
    commands = steered(WildlifeCircler(), {"type": "wildlife", "state": "running", "animals": animals})
    assert commands["left"] > commands["right"]  # it is to port, so the bow goes to starboard


def test_clearance_leaves_room_for_a_circle():
    assert _clearance("crocodile", 40.0) == 13.0
    assert _clearance("turtle", 40.0) == 5.0
    assert _clearance("crocodile", 12.0) == pytest.approx(6.5)
    assert _clearance("crocodile", 5.0) == 3.0


def test_circles_are_smaller_beside_a_crocodile():
    def radius(apart):
        return WildlifeCircler._radius((0.0, 0.0), [("turtle", (0.0, 0.0)), ("crocodile", (apart, 0.0))])

    assert [radius(apart) for apart in (40.0, 17.0, 12.0)] == [5.5, 5.0, 4.0]


@pytest.mark.parametrize(
    ("pose", "error"),
    [
        ((0.0, 0.0, 1.0), 0.0),
        ((3.0, 4.0, 1.0), 5.0),
        ((2.0, 0.0, 0.5), 2.0 + 0.75**2 * 0.5),
        ((0.0, 0.0, 1.0 - 1.5 * math.pi), math.pi / 2),
    ],
)
def test_the_error_of_a_waypoint(pose, error):
    assert waypoint_error(estimate(*pose), (0.0, 0.0), 1.0) == pytest.approx(error)


MATRIX = np.array([[762.7, 0.0, 640.5], [0.0, 762.7, 360.5], [0.0, 0.0, 1.0]])
TILTED = math.radians(15.0)
TURNED = np.array([[math.cos(TILTED), 0, math.sin(TILTED)], [0, 1, 0], [-math.sin(TILTED), 0, math.cos(TILTED)]])


@pytest.mark.parametrize(("ahead", "left"), [(8.0, 0.0), (6.0, 2.5), (12.0, -4.0)])
@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_a_place_is_found_by_the_width_it_has_in_the_picture(ahead, left, heading):
    """Second implementation: a ball's outline, a cone about the direction to its centre."""
    seen = estimate(10.0, -5.0, heading)
    view = View(np.array([0.75, 0.1, 1.5]), TURNED, MATRIX, seen)
    x, y, z = TURNED.T @ (np.array([ahead, left, 0.2]) - (0.75, 0.1, 1.5))
    column, row = 640.5 - 762.7 * y / x, 360.5 - 762.7 * z / x
    half = math.asin(0.25 / math.hypot(x, y))
    bearing = math.atan2(y, x)
    width = 762.7 * (math.tan(bearing + half) - math.tan(bearing - half))
    found = view.place(Blob("orange", column, row, width, width, False), 0.5)
    c, s = math.cos(heading), math.sin(heading)
    assert found == pytest.approx((10.0 + c * ahead - s * left, -5.0 + s * ahead + c * left), abs=0.05)


def test_the_horizon_of_a_tilted_camera():
    view = View(np.array([0.75, 0.1, 1.5]), TURNED, MATRIX, estimate(0.0, 0.0, 1.0))
    assert view.horizon() == pytest.approx(360.5 - 762.7 * math.tan(TILTED), abs=0.1)
