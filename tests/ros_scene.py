"""A served simulation without a network, for tests."""

from types import SimpleNamespace

import vrx_mj
from vrx_mj.ros.interface import Inbox, Traffic
from vrx_mj.ros.messages import encode, is_known, new
from vrx_mj.ros.ros_server import RosServer

__all__ = ["SERVERS", "Fake", "call", "run", "served"]

SERVERS = []


class Fake:
    """A network that wants what it is told to want, and keeps what it gets."""

    def __init__(self, wanted=(), dialect="vrx"):
        self.subscribed_topics, self.dialect, self.got, self.lines = frozenset(wanted), dialect, {}, []
        self.published = {}

    def start(self):
        return []

    def offer(self, table):
        self.table = table

    def publish(self, batch):
        for sent in batch:
            if self.dialect == "vrx":
                encode(sent.message, sent.output.type)  # is of its type
            self.got.setdefault(sent.output.name, []).append(sent)

    def publishers(self, topic):
        return self.published.get(topic, [])

    def log(self, level, text):
        self.lines.append((level, text))

    @property
    def traffic(self):
        return Traffic(0, 0, 0)

    def close(self):
        pass


def served(world, *, wanted=(), dialect="vrx", **options):
    """A server, its network, its inbox, and what it told."""
    sim = world if isinstance(world, vrx_mj.Simulation) else vrx_mj.Simulation(world)
    network, inbox, told = Fake(wanted, dialect), Inbox(), []
    server = RosServer(sim, [network], inbox, report=lambda _level, text: told.append(text), **options)
    SERVERS.append(server)
    return SimpleNamespace(sim=sim, server=server, network=network, inbox=inbox, told=told)


def run(scene, seconds):
    """Advance, taking what came."""
    for _ in range(round(seconds * 100)):
        scene.server.receive()
        scene.server.tick()


def call(scene, name, kind, **fields):
    """Call a service; its response, or the reason why there is none."""
    return answer(scene, name, new(f"{kind}Request", **fields))


def answer(scene, name, request):
    """The response to a request, or the reason why there is none."""
    answers = []
    scene.inbox.call(name, request, "/test", lambda *answer: answers.append(answer))
    scene.server.receive()
    ((response, why),) = answers
    half = f"{known.type}Response" if (known := scene.server.table.services.get(name)) else ""
    if response is not None and is_known(half):
        assert encode(response, half) is not None, "a wire carries it"
    return response if response is not None else why
