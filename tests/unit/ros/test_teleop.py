import itertools
import json
import math
import os
import time
from dataclasses import asdict
from types import SimpleNamespace

import pytest

from bridged import Bridged, nothing
from vrx_mj import compile_world
from vrx_mj.draw.course import map_of
from vrx_mj.draw.style import boat_color, hex_color
from vrx_mj.drive.pilot import Engine, engines_of
from vrx_mj.errors import CommandError, NetworkError, UnknownNameError
from vrx_mj.model.world import tree_of
from vrx_mj.recording.simulation_scene import scene_of
from vrx_mj.ros import messages
from vrx_mj.ros.interface import Input, Output, RosInterface, Service
from vrx_mj.ros.parameters import command_topic
from vrx_mj.ros.table.host import Scenery
from vrx_mj.ros.table.world import _course, chart_output
from vrx_mj.ros.teleop import driving
from vrx_mj.ros.teleop.driving import RosbridgeDriver
from vrx_mj.runtime.simulation import Simulation

TWIN = (Engine("left", 1.0, -1.0, True, 1.5), Engine("right", 1.0, 1.0, True, 1.5))
EMPTY = ("reset_world", "pause_physics", "unpause_physics")


class World(Bridged):
    """A rosbridge with boats, and the names of the services that were called."""

    def __init__(self, boats=("wamv1", "wamv2"), cmd_vel="thrust", port=0):
        super().__init__(port)
        self.called, self.cmd_vel = [], cmd_vel
        self.table = self.made(boats)

    def made(self, boats):
        names = [f"/{boat}/thrusters/{side}_thrust_{what}" for boat in boats for side in ("left", "right")
                 for what in ("cmd", "angle")]  # fmt: skip
        inputs = [Input(name, "std_msgs/Float32", nothing) for name in names]
        inputs += [Input(f"/{boat}/cmd_vel", "geometry_msgs/Twist", nothing) for boat in boats]
        outputs = [
            Output("/vrx_mj/world", "std_msgs/String", nothing, latched=True),
            Output("/clock", "rosgraph_msgs/Clock", nothing),
            Output("/gazebo/model_states", "gazebo_msgs/ModelStates", nothing),
            Output("/vrx/debug/wind/speed", "std_msgs/Float64", nothing),
            Output("/vrx/debug/wind/direction", "std_msgs/Float64", nothing),
        ]
        services = [Service(f"/gazebo/{name}", "std_srvs/Empty", self.noting(name)) for name in EMPTY]
        return RosInterface(
            {output.name: output for output in outputs},
            {entry.name: entry for entry in inputs},
            {service.name: service for service in services},
        )

    def noting(self, name):
        def answer(_request):
            self.called.append(name)

        return answer

    def __enter__(self):
        super().__enter__()
        self.tell()
        return self

    def tell(self, *boats):
        """Have these boats from now on."""
        if boats:
            self.table = self.made(boats)
            self.wires.offer(self.table)
        here = [topic.split("/")[1] for topic in self.table.inputs if topic.endswith("/cmd_vel")]
        told = {boat: {"engines": [asdict(engine) for engine in TWIN]} for boat in here}
        text = json.dumps({"name": "bay", "x_from_east": 0.5, "cmd_vel": self.cmd_vel, "boats": told})
        self.send("/vrx_mj/world", messages.new("std_msgs/String", data=text))

    def values(self, topic):
        return [message.data for name, message in self.came if name == topic]


@pytest.fixture
def world():
    with World() as made:
        yield made


def at_helm(world, boat=None, **options):
    said = []
    driver = RosbridgeDriver(world.url, boat, say=said.append, **options)
    driver.said = said
    return driver


def turn(driver, keys=()):
    """Press keys, and go on."""
    for key in keys:
        driver.press(key)
    driver.advance()


def turned(driver, condition, seconds=5.0):
    """Turn without keys until something holds."""
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "it took too long"
        turn(driver)


@pytest.mark.parametrize(
    ("keys", "left", "right", "angle"),
    [("i", 0.5, 0.5, 0.0), (",", -0.5, -0.5, 0.0), ("j", -1.0, 1.0, 0.0), ("u", -0.5, 1.0, 0.0),
     ("wi", 0.55, 0.55, 0.0), (";", 0.0, 0.0, 0.1), ("h", 0.0, 0.0, -0.1), ("rh", 0.0, 0.0, -0.11)],
)  # fmt: skip
def test_keys_become_messages_of_the_boats_thrusters(world, keys, left, right, angle):
    driver = at_helm(world)
    turn(driver, keys)
    world.wait(lambda here: len(here.came) >= 4)
    driver.close()
    told = {name.rpartition("/")[2]: message.data for name, message in world.came[:4]}
    wanted = {
        "left_thrust_cmd": left,
        "right_thrust_cmd": right,
        "left_thrust_angle": angle,
        "right_thrust_angle": angle,
    }
    assert told == pytest.approx(wanted)
    assert {name.split("/")[1] for name, _ in world.came} == {"wamv1"}


def test_what_is_asked_goes_out_ten_times_a_second_and_rest_only_once(world):
    now = itertools.count(0.0, 0.05)  # the clock is looked at more than once a turn: at most every other turn is due
    driver = at_helm(world, clock=lambda: next(now))
    topic = "/wamv1/thrusters/left_thrust_cmd"
    turn(driver, "i")
    turned(driver, lambda: len(world.values(topic)) >= 4)
    turn(driver, "k")
    turned(driver, lambda: world.values(topic)[-1] == 0.0)
    for _ in range(6):
        turn(driver)
    driver.close()
    assert set(world.values(topic)[:-1]) == {0.5}
    assert world.values(topic)[-1] == 0.0


def test_a_boat_at_rest_is_left_to_the_programs_that_drive_it(world):
    driver, topic = at_helm(world), "/wamv1/thrusters/left_thrust_cmd"
    turn(driver, "i")
    world.wait(lambda here: here.values(topic))
    assert world.wires.publishers(topic) == ["/rosbridge/client_1"]
    turn(driver, "k")
    world.wait(lambda here: not here.wires.publishers(topic))
    driver.close()


def test_a_kept_velocity_is_driven_by_cmd_vel_in_its_own_units():
    with World(cmd_vel="velocity") as world:
        driver = at_helm(world, "wamv2")
        turn(driver, "o")
        world.wait(lambda here: here.came)
        assert dict(driver.status())["power"] == "+0.50 m/s"
        driver.close()
        world.wait(lambda here: here.came[-1][1].linear.x == 0.0)
    name, twist = world.came[0]
    assert (name, twist.linear.x, twist.angular.z) == ("/wamv2/cmd_vel", 0.5, -1.0)


def test_the_status_has_compass_degrees_of_true_north(world):
    """North is 90 degrees from east, and x half a radian from it."""
    driver = at_helm(world)
    pose = messages.new("geometry_msgs/Pose", orientation={"z": math.sin(0.5), "w": math.cos(0.5)})  # 1 rad from x
    twist = messages.new("geometry_msgs/Twist", linear={"y": 2.0})
    states = messages.new("gazebo_msgs/ModelStates", name=["wamv1"], pose=[pose], twist=[twist])

    def known():
        world.send("/gazebo/model_states", states)
        world.send("/vrx/debug/wind/speed", messages.new("std_msgs/Float64", data=3.0))
        world.send("/vrx/debug/wind/direction", messages.new("std_msgs/Float64", data=120.0))
        return {"course", "wind"} <= dict(driver.status()).keys()

    turned(driver, known)
    status = dict(driver.status())
    driver.close()
    assert (status["heading"], status["course"]) == ("4 deg compass", "331 deg compass")
    assert status["wind"] == "3.0 m/s to 330 deg compass"


def test_leaving_stops_the_boats_that_were_driven(world):
    driver = at_helm(world)
    turn(driver, "in,")
    world.wait(lambda here: here.values("/wamv2/thrusters/left_thrust_cmd"))
    driver.close()
    for boat in ("wamv1", "wamv2"):
        world.wait(lambda here, boat=boat: here.values(f"/{boat}/thrusters/left_thrust_cmd")[-1] == 0.0)
    assert world.values("/wamv1/thrusters/left_thrust_cmd")[0] == 0.5
    assert world.values("/wamv2/thrusters/left_thrust_cmd")[0] == -0.5


def test_p_pauses_a_clock_that_ticks_and_lets_one_that_stands_go_on(world):
    now = [0.0]
    driver = at_helm(world, clock=lambda: now[0])
    now[0] = 5.0
    world.send("/clock", messages.new("rosgraph_msgs/Clock", clock=messages.stamp(7.25)))
    turned(driver, lambda: dict(driver.status()).get("time") == "7.2 s")
    turn(driver, "p")
    assert dict(driver.status())["time"] == "7.2 s, paused"
    turn(driver, "p")
    world.wait(lambda here: len(here.called) == 2)
    driver.close()
    assert world.called == ["pause_physics", "unpause_physics"]


def test_backspace_stops_and_resets(world):
    driver = at_helm(world)
    turn(driver, "i")
    turn(driver, ["backspace"])
    turned(driver, lambda: "the simulation is reset" in driver.said)
    driver.close()
    assert (world.called, driver.pilot.wheels) == (["reset_world"], {})
    assert world.values("/wamv1/thrusters/left_thrust_cmd")[-1] == 0.0


def test_boats_come_and_go(world):
    driver = at_helm(world, "wamv2")
    world.tell("wamv1", "wamv10", "wamv9")
    turned(driver, lambda: driver.pilot.boat == "wamv1")
    assert driver.said[-1] == "wamv2 was removed; the keys drive wamv1 now"
    turn(driver, "ni")
    world.wait(lambda here: here.values("/wamv9/thrusters/left_thrust_cmd"))  # 9 comes before 10
    driver.close()


def test_a_lost_connection_is_told_and_comes_again(world, monkeypatch):
    monkeypatch.setattr(driving, "RETRY_PERIOD", 0.05)
    driver = at_helm(world)
    turn(driver, "i")
    world.bridge.close()
    turned(driver, lambda: driver.said[-1] == f"lost the connection to {world.url}: trying again")
    assert driver.status() == (("not connected to", world.url),)
    with World(port=world.bridge.port) as again:
        turned(driver, lambda: driver.said[-1] == "connected again, to bay")
        assert again.values("/wamv1/thrusters/left_thrust_cmd") == []  # nobody has asked for anything since
        turn(driver, "i")
        again.wait(lambda here: here.values("/wamv1/thrusters/left_thrust_cmd"))
        driver.close()


def test_where_nothing_answers_the_error_says_what_to_start():
    with World() as world:
        url = world.url
    with pytest.raises(NetworkError) as caught:
        RosbridgeDriver(url, None, say=print)
    assert str(caught.value) == (
        f"no rosbridge answers at {url} (Connection refused); start a world there: vrx-mj serve WORLD --rosbridge"
    )


def test_an_unknown_boat_is_told_with_those_that_there_are(world):
    with pytest.raises(UnknownNameError) as caught:
        at_helm(world, "titanic")
    assert str(caught.value) == "no boat named 'titanic'; known: wamv1, wamv2"


def test_another_rosbridge_is_told(monkeypatch):
    monkeypatch.setattr(driving, "GREETING_TIMEOUT", 0.1)
    with Bridged() as other, pytest.raises(NetworkError) as caught:
        RosbridgeDriver(other.url, None, say=print)
    assert str(caught.value) == (
        f"the server at {other.url} is not `vrx-mj serve`: it has no /vrx_mj/world or no boats' topics"
    )


@pytest.mark.parametrize("url", ["http://127.0.0.1:1", "ws://", "ws:///x"])
def test_what_is_no_address_is_told(url):
    with pytest.raises(NetworkError) as caught:
        RosbridgeDriver(url, None, say=print)
    assert (
        str(caught.value) == f"invalid rosbridge address '{url}': ws://HOST:PORT is needed, as in ws://127.0.0.1:9090"
    )


def test_topics_are_named_as_in_vrx():
    assert command_topic("skiff", "rudder_angle") == "/skiff/thrusters/rudder_thrust_angle"
    assert command_topic("skiff", "left") == "/skiff/thrusters/left_thrust_cmd"


@pytest.mark.parametrize(
    ("task", "course"),
    [
        (None, ()),
        ({"type": "stationkeeping"}, ()),  # not ready: it has not told its goal
        ({"type": "stationkeeping", "goal": {"x": 1, "y": 2, "yaw": 0.5}}, ((1.0, 2.0, 0.5),)),
        ({"type": "wayfinding", "waypoints": [{"x": 1, "y": 2, "yaw": 0}, {"x": 3, "y": 4, "yaw": 1}]},
         ((1.0, 2.0, 0.0), (3.0, 4.0, 1.0))),
        ({"type": "acoustic_tracking", "goal": {"x": 1, "y": 2}}, ()),
    ],
)  # fmt: skip
def test_the_map_shows_what_the_task_tells_a_team(task, course):
    assert _course(SimpleNamespace(sim=SimpleNamespace(task=task))) == course


def test_a_boat_has_one_colour_on_the_page_in_maps_and_in_recordings():
    """Of 14 boats, one with a hull of its own colour; the others keep theirs when the first leaves and one joins."""
    boats = [{"name": f"b{i}", "pose": [10.0 * i, 0, 0.1, 0, 0, 0]} for i in range(14)]
    boats[3]["color"] = [0, 0, 1]
    world = compile_world({"extends": "ocean"}, fleet={"boats": boats, "sensors": "none"})
    sim = Simulation(world)
    host = SimpleNamespace(sim=sim, cmd_vel="thrust", scenery=Scenery(world.parameters))
    shown = colors_told(host)
    assert shown == {boat.name: boat.color for boat in map_of(world).boats}
    assert shown == {name: hex_color(rgb) for name, rgb in scene_of(sim).colors().items()}
    assert len(set(shown.values())) == 14
    sim.remove("b0")
    sim.spawn("guest", pose=(0.0, 0.0, 0.1, 0.0, 0.0, 0.0))
    del shown["b0"]
    assert colors_told(host) == shown | {"guest": hex_color(boat_color(14))}


def colors_told(host):
    """Colours of boats in the topic that pages draw."""
    return {boat: row["color"] for boat, row in json.loads(chart_output(host).make().data)["boats"].items()}


class Sailing:
    """What the map looks at of a simulation."""

    def __init__(self, world):
        self.world, self.boats, self.task = world, world.boats, None


def test_the_map_has_the_worlds_shore_docks_objects_and_engines():
    world = compile_world("example_course", fleet={"usv_count": 2, "origin": "spawn", "sensors": "none"})
    host = SimpleNamespace(sim=Sailing(world), cmd_vel="thrust", scenery=Scenery(world.parameters))
    output = chart_output(host)
    told = json.loads(output.make().data)
    assert (output.name, output.type, output.latched) == ("/vrx_mj/world", "std_msgs/String", True)
    assert (told["name"], told["cmd_vel"], told["course"]) == ("example_course", "thrust", [])
    assert [len(ring) for ring in told["shore"]] == [len(ring) for ring in tree_of(world.parameters)["shoreline"]]
    there = {row["name"] for row in tree_of(world.parameters)["objects"]}
    assert {row["name"] for row in told["objects"]} == there - {"blue_projectile"}  # the shooter's ball: not to be seen
    (dock,) = told["docks"]
    assert len(dock["cells"]) == len(tree_of(world.parameters)["docks"][0]["cells"])
    made = {boat: tuple(Engine(**engine) for engine in row["engines"]) for boat, row in told["boats"].items()}
    assert made == {boat: engines_of(world, boat) for boat in world.boats}
    host.sim.task = {"type": "stationkeeping", "goal": {"x": 1.0, "y": 2.0}}
    assert json.loads(output.make().data)["course"] == [[1.0, 2.0, 0.0]]


def test_without_a_terminal_no_key_can_come(monkeypatch):
    with open(os.devnull, encoding="utf-8") as nothing_to_read:  # noqa: PTH123
        monkeypatch.setattr("sys.stdin", nothing_to_read)
        with pytest.raises(CommandError, match="cannot read keys: standard input is not a terminal"):
            driving.drive_served_world("ws://127.0.0.1:9")
