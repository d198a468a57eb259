"""What goes out and when: rates, news, latched topics and the clock."""

from types import SimpleNamespace

from vrx_mj.ros.interface import Output, RosInterface
from vrx_mj.ros.messages import new
from vrx_mj.ros.ros_server import Publisher


class Transport:
    """Notes what is published."""

    def __init__(self, *wanted):
        self.subscribed_topics, self.got = frozenset(wanted), []

    def publish(self, batch):
        self.got += [(round(sent.time, 6), sent.output.name, sent.message.data) for sent in batch]


def told(text):
    return new("std_msgs/String", data=text)


def posting(*outputs, wanted):
    sim, transport = SimpleNamespace(time=0.0, boats=()), Transport(*wanted)
    post = Publisher(sim, [transport], lambda _level, _text: None)
    post.offer(RosInterface({output.name: output for output in outputs}))
    return sim, post, transport


def sail(sim, post, steps):
    for _ in range(steps):
        post.deliver()
        sim.time += 0.05


def test_an_output_goes_out_at_its_rate_while_somebody_listens():
    sim, post, transport = posting(Output("/a", "std_msgs/String", lambda: told("x"), 5.0), wanted=["/a"])
    sail(sim, post, 20)
    assert [time for time, _, _ in transport.got] == [0.0, 0.2, 0.4, 0.6, 0.8]
    transport.subscribed_topics = frozenset()
    sail(sim, post, 20)
    assert len(transport.got) == 5


def test_an_output_without_a_rate_goes_out_when_it_changes():
    text = ["same"]
    sim, post, transport = posting(Output("/a", "std_msgs/String", lambda: told(text[0])), wanted=["/a"])
    sail(sim, post, 10)
    text[0] = "other"
    sail(sim, post, 10)
    assert [(name, data) for _, name, data in transport.got] == [("/a", "same"), ("/a", "other")]
    post.begin()
    sail(sim, post, 10)
    assert [data for _, _, data in transport.got] == ["same", "other", "other"]


def test_latched_outputs_go_out_before_anybody_listens():
    latched = Output("/latched", "std_msgs/String", lambda: told("x"), latched=True)
    sim, post, transport = posting(latched, Output("/other", "std_msgs/String", lambda: told("y")), wanted=[])
    sail(sim, post, 3)
    assert [name for _, name, _ in transport.got] == ["/latched"]


def test_the_clock_comes_after_what_it_is_the_time_of():
    outputs = [Output(name, "std_msgs/String", lambda: told("x"), 20.0) for name in ("/clock", "/a", "/b")]
    sim, post, transport = posting(*outputs, wanted=["/clock", "/a", "/b"])
    sail(sim, post, 1)
    assert [name for _, name, _ in transport.got] == ["/a", "/b", "/clock"]


def test_what_has_nothing_to_tell_is_silent():
    sim, post, transport = posting(Output("/a", "std_msgs/String", lambda: None, 20.0), wanted=["/a"])
    sail(sim, post, 5)
    assert transport.got == []
