"""What a world and its task publish of made-up contacts, places and winds, message by message."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.errors import CommandError
from vrx_mj.ros.messages import new
from vrx_mj.ros.table import world


class Model:
    """Shapes of a boat, a dock and a buoy."""

    geom_bodyid = np.array([1, 2, 3, 0])
    bodies = ("world", "a/base_link", "dock/plank", "buoy/ball")
    shapes = ("a/hull", "", "buoy/ball", "ground")

    def body(self, number):
        return SimpleNamespace(name=self.bodies[number])

    def geom(self, number):
        return SimpleNamespace(name=self.shapes[number])


def contact(one, other, dist=-0.25):
    return SimpleNamespace(geom=(one, other), dist=dist, pos=np.array([1.0, 2.0, 3.0]), frame=np.arange(9.0))


@pytest.fixture
def host(monkeypatch):
    monkeypatch.delenv("VRX_DEBUG", raising=False)
    sent = []
    sim = SimpleNamespace(
        time=7.25, boats=("a",), model=Model(), data=SimpleNamespace(contact=[]), sent=sent, placards=("p/one",),
        lights=("l/two",), shuffle=lambda name: sent.append(("shuffle", name)), task=None,
        send=lambda *what: sent.append(what), wind=SimpleNamespace(speed=3.5, direction=2.5),
        world=SimpleNamespace(parameters=SimpleNamespace(x_from_east=1.0, task=None)),
    )  # fmt: skip
    return SimpleNamespace(sim=sim, steering=SimpleNamespace(form=lambda text: sent.append(("form", text))))


def test_all_contacts_of_boats_are_told_with_place_normal_and_depth(host):
    host.sim.data.contact = [contact(0, 1), contact(1, 2), contact(0, 2, 0.0), contact(2, 0, -1e-3)]
    message = world._contacts(host)
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (7, 250_000_000)
    found = [
        [one.collision1.id, one.collision1.name, one.collision2.id, one.collision2.name, one.depths.tolist()]
        for one in message.contacts
    ]
    hull, plank, ball = "a::a/base_link::hull", "dock::plank::collision", "buoy::ball::ball"
    assert found == [[0, hull, 1, plank, [0.25]], [2, ball, 0, hull, [1e-3]]]
    (where,), (normal,) = message.contacts[0].positions, message.contacts[0].normals
    assert (where.x, where.y, where.z) == (1.0, 2.0, 3.0)
    assert (normal.x, normal.y, normal.z) == (0.0, 1.0, 2.0)
    assert message.contacts[0].collision1.type == message.contacts[0].collision2.type


def test_all_contacts_of_the_tasks_boat_are_told(host):
    host.sim.task = {"boat": "a"}
    assert world._contact(host) == []
    host.sim.data.contact = [contact(1, 2), contact(0, 2, 0.0), contact(2, 0), contact(0, 1)]
    messages, hull = world._contact(host), "a::a/base_link::hull"
    pairs = [(one.collision1, one.collision2) for one in messages]
    assert pairs == [("buoy::ball::ball", hull), (hull, "dock::plank::collision")]
    assert {one.header.stamp.sec for one in messages} == {7}
    host.sim.task = {"boat": "ab"}
    assert world._contact(host) == []


@pytest.mark.parametrize("debug", ["true", "false"])
def test_winds_and_contacts_are_silent_without_debugging(host, monkeypatch, debug):
    monkeypatch.setenv("VRX_DEBUG", debug)
    task = [output.name for output in world._task_contacts(host, "/vrx")]
    assert task == (["/vrx/debug/contact"] if debug == "true" else [])


@pytest.mark.parametrize(("direction", "degrees"), [(2.5, 200.535), (-1.5, 331.352), (-1.0, 0.0)])
def test_the_wind_blows_to_degrees_from_east(host, direction, degrees):
    """From -180 to 180 with VRX's names, from 0 to 360 with VRX 3's."""
    host.sim.wind.direction = direction
    made = {(output.name, *output.dialects): output.make().data for output in world._wind(host)}
    assert {made["/vrx/debug/wind/speed", each] for each in ("vrx", "vrx3")} == {3.5}
    assert made["/vrx/debug/wind/direction", "vrx"] == pytest.approx(math.remainder(degrees, 360.0), abs=1e-3)
    assert made["/vrx/debug/wind/direction", "vrx3"] == pytest.approx(degrees, abs=1e-3)


def test_placards_lights_and_formations_are_inputs(host):
    inputs = {entry.name: entry for entry in world.world_inputs(host)}
    assert set(inputs) == {"/vrx/one/shuffle", "/vrx/two/shuffle"}
    for entry in inputs.values():
        entry.take(new("std_msgs/Empty"))
    assert host.sim.sent == [("shuffle", "p/one"), ("shuffle", "l/two")]
    host.sim.boats = ("a", "b")
    (formation,) = [entry for entry in world.world_inputs(host) if entry.name == "/swarm/formation"]
    formation.take(new("std_msgs/String", data="line"))
    assert host.sim.sent[-1] == ("form", "line")


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        ({"latitude": 21.5, "longitude": -157.5, "altitude": 3.0, "x": 1, "y": 2, "yaw": 0.4, "yaw_from_east": 1.0},
         (21.5, -157.5, 3.0, 1.0)),
        ({"latitude": None, "x": 1, "y": 2, "z": 4, "yaw": 0.4}, (1.0, 2.0, 4.0, 0.4)),
        ({"x": 1, "y": 2, "altitude": None}, (1.0, 2.0, 0.0, 0.0)),
    ],
)  # fmt: skip
def test_a_place_is_on_earth_or_in_metres(place, expected):
    message = world._place(7.25, "here", place)
    position, turn = message.pose.position, message.pose.orientation
    yaw = 2.0 * math.atan2(turn.z, turn.w)
    assert (position.latitude, position.longitude, position.altitude, yaw) == pytest.approx(expected)
    assert (turn.x, turn.y, message.header.frame_id, message.header.stamp.sec) == (0.0, 0.0, "here", 7)


def test_animals_are_places_by_name(host):
    assert world._animals(host) is None
    host.sim.task = {"animals": [{"name": "crocodile", "x": 1, "y": 2}, {"name": "turtle", "x": 3, "y": 4, "yaw": 1.0}]}
    path = world._animals(host)
    assert [one.header.frame_id for one in path.poses] == ["crocodile", "turtle"]
    assert [one.pose.position.longitude for one in path.poses] == [2.0, 4.0]
    assert path.header.stamp.sec == path.poses[0].header.stamp.sec == 7


def test_landmarks_are_degrees_by_either_name(host):
    classic, other = world._landmark(host)
    place = {"position": {"latitude": 1.5, "longitude": 2.5}}
    classic.take(new("geographic_msgs/GeoPoseStamped", header={"frame_id": "buoy"}, pose=place))
    other.take(new("geometry_msgs/PoseStamped", header={"frame_id": "cone"}, pose={"position": {"x": 3.5, "y": 4.5}}))
    assert host.sim.sent == [
        ("landmark", {"type": "buoy", "latitude": 1.5, "longitude": 2.5}),
        ("landmark", {"type": "cone", "latitude": 3.5, "longitude": 4.5}),
    ]


def test_colours_are_taken_while_they_are_asked_for(host):
    colors = ["red", "green", "blue"]
    _, topic, *services = world._docking(host)
    assert len({service.name for service in services}) == 2
    request = SimpleNamespace(color1="red", color2="green", color3="blue")
    for is_open in (False, True):
        host.sim.task = {"color_sequence_open": is_open}
        assert [service.do(request) for service in services] == [{"success": is_open}] * 2
    assert host.sim.sent == [("color_sequence", colors)] * 2
    topic.take(SimpleNamespace(data=colors))
    assert len(host.sim.sent) == 3
    for count in (2, 4):
        with pytest.raises(CommandError) as caught:
            topic.take(SimpleNamespace(data=["red"] * count))
        assert str(caught.value) == f"{count} colours: 3 are needed, as in ['red', 'green', 'blue']"
    host.sim.task = {}
    with pytest.raises(CommandError, match=r"^a sequence of colours is accepted only once, while the task runs$"):
        topic.take(SimpleNamespace(data=colors))


def test_numbers_of_a_task_have_a_layout_and_what_is_not_known_is_no_message(host):
    message = world._numbers([1.5, 2.5])
    (side,) = message.layout.dim
    assert (side.label, side.size, side.stride) == ("minimum errors", 2, 2)
    assert list(message.data) == [1.5, 2.5]
    host.sim.task = {"a": None, "b": 2.5, "c": [{"x": 1, "y": 2}], "ready_time": 3.0}
    assert world._output(host, "a", world._FORMS["number"][1]) is None
    assert world._output(host, "b", world._FORMS["number"][1]).data == 2.5
    assert world._output(host, "c", world._FORMS["places"][1]).poses[0].header.stamp.sec == 3
