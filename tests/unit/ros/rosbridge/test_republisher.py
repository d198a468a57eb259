"""Frames for pages that show them, as tf2_web_republisher gives them: by its service, and by its action."""

import contextlib
import math

import pytest

from bridged import Bridged
from rosbridge_client import Talk

ARRAY, FEEDBACK = "tf2_web_republisher/TFArray", "/tf2_web_republisher/feedback"
ASKED = {
    "source_frames": ["/boat", "arm"], "target_frame": "/map", "angular_thres": 0.1, "trans_thres": 0.1, "rate": 50.0,
}  # fmt: skip


@pytest.fixture
def bridged():
    """One that knows no frames yet."""
    with Bridged() as made:
        yield made


@pytest.fixture
def talks(bridged):
    """Makes clients."""
    with contextlib.ExitStack() as stack:
        yield lambda count: [stack.enter_context(Talk(bridged)) for _ in range(count)]


def frame(parent, child, x, *, w=1.0, z=0.0, y=0.0):
    turn = {"translation": {"x": x, "y": y}, "rotation": {"z": z, "w": w}}
    return {"header": {"frame_id": parent}, "child_frame_id": child, "transform": turn}


def publish(talk, *frames):
    talk.say("publish", topic="/tf", type="tf2_msgs/TFMessage", msg={"transforms": list(frames)})


def ask(talk, **asked):
    """Subscribe to what the service gives; its answer."""
    talk.say("call_service", service="/republish_tfs", id="1", args=ASKED | asked)
    answer = talk.hear()
    if answer["result"]:
        talk.say("subscribe", topic=answer["values"]["topic_name"], type=ARRAY)
    return answer["values"]


def heard(message, key="msg"):
    """x of each frame."""
    return {one["child_frame_id"]: one["transform"]["translation"]["x"] for one in message[key]["transforms"]}


def test_the_service_gives_a_topic_with_what_moves(bridged, talks):
    page, node = talks(2)
    ask(page)
    publish(node, frame("map", "boat", 1.0, z=1.0, w=0.0), frame("boat", "arm", 2.0))
    assert heard(page.hear()) == pytest.approx({"boat": 1.0, "arm": -1.0})
    publish(node, frame("map", "boat", 1.05, z=1.0, w=0.0))  # below the threshold
    publish(node, frame("boat", "arm", 3.0))
    assert heard(page.hear()) == pytest.approx({"arm": -1.95})
    publish(node, frame("map", "boat", 1.05, z=math.sin(1.4), w=math.cos(1.4)))
    assert set(heard(page.hear())) == {"boat", "arm"}


def test_frames_that_lead_nowhere_are_left_out(bridged, talks):
    page, node = talks(2)
    ask(page, source_frames=["boat", "lost", "a", "b", "none"])
    publish(
        node, frame("a", "b", 1.0), frame("b", "a", 1.0), frame("elsewhere", "lost", 1.0), frame("map", "boat", 4.0)
    )
    assert heard(page.hear()) == {"boat": 4.0}
    publish(node, frame("map", "boat", math.nan), frame("map", "none", 1.0, w=0.5), frame("map", "a", 2.0))
    assert heard(page.hear()) == {"a": 2.0, "b": 3.0}  # the loop is open, and what is no transform was not taken


def test_the_action_gives_feedback_until_it_is_cancelled(bridged, talks):
    page, node = talks(2)
    page.say("subscribe", topic=FEEDBACK, type="tf2_web_republisher/TFSubscriptionActionFeedback")
    for name in ("one", "two"):
        goal = {"goal_id": {"id": name}, "goal": ASKED}
        topic = "/tf2_web_republisher/goal"
        page.say("publish", topic=topic, type="tf2_web_republisher/TFSubscriptionActionGoal", msg=goal)
    assert page.sync() == []
    publish(node, frame("map", "boat", 1.0))
    got = [page.hear()["msg"] for _ in range(2)]
    assert {one["status"]["goal_id"]["id"] for one in got} == {"one", "two"}
    assert all(heard(one, "feedback") == {"boat": 1.0} for one in got)
    page.say("publish", topic="/tf2_web_republisher/cancel", type="actionlib_msgs/GoalID", msg={"id": "one"})
    assert page.sync() == []
    for x in (2.0, 3.0):
        publish(node, frame("map", "boat", x))
        assert page.hear()["msg"]["status"]["goal_id"]["id"] == "two"


def test_it_ends_with_the_last_page(bridged, talks):
    (page,) = talks(1)
    topic = ask(page)["topic_name"]
    bridged.wait(lambda _: "/tf" in bridged.graph.topics())
    page.say("unsubscribe", topic=topic)
    bridged.wait(lambda _: not {"/tf", "/tf_static", topic} & set(bridged.graph.topics()))


@pytest.mark.parametrize(
    "wrong", [{"rate": 0.0}, {"rate": 1e9}, {"rate": None}, {"source_frames": ["a"] * 257}]
)  # fmt: skip
def test_what_is_not_served_is_refused(bridged, talks, wrong):
    (page,) = talks(1)
    assert "allowed: 0.1 to 100 Hz, 256 frames" in ask(page, **wrong)


def test_those_who_ask_for_too_many_lose_the_oldest(bridged, talks):
    (page,) = talks(1)
    topics = [ask(page, rate=1.0)["topic_name"] for _ in range(66)]
    known = bridged.graph.topics()
    assert bridged.graph.registrations.apis("publisher", topics[-1])
    assert not bridged.graph.registrations.apis("publisher", topics[0])
    assert (
        len([name for name in known if bridged.graph.registrations.apis("publisher", name) and "repub" in name]) == 64
    )
