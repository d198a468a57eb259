"""A served simulation without a network, for tests."""

from types import SimpleNamespace

import vrx_mj
from vrx_mj.ros.inbox import Inbox
from vrx_mj.ros.messages import encode, new
from vrx_mj.ros.offer import Traffic
from vrx_mj.ros.ros_server import RosServer

__all__ = ["STATIONS", "Fake", "call", "run", "served"]

STATIONS = []


class Fake:
    """A network that wants what it is told to want, and keeps what it gets."""

    title = "fake"

    def __init__(self, wanted=()):
        self.wanted, self.got, self.lines = frozenset(wanted), {}, []

    def start(self):
        return []

    def offer(self, table):
        self.table = table

    def publish(self, batch):
        for sent in batch:
            encode(sent.message, sent.output.type)  # is of its type
            self.got.setdefault(sent.output.name, []).append(sent)

    def log(self, level, text):
        self.lines.append((level, text))

    @property
    def traffic(self):
        return Traffic(0, 0, 0)

    def close(self):
        pass


def served(world, *, wanted=(), **options):
    """A station, its network, its inbox, and what it told."""
    sim = world if isinstance(world, vrx_mj.Simulation) else vrx_mj.Simulation(world)
    network, inbox, told = Fake(wanted), Inbox(), []
    station = RosServer(sim, [network], inbox, tell=lambda _level, text: told.append(text), **options)
    STATIONS.append(station)
    return SimpleNamespace(sim=sim, station=station, network=network, inbox=inbox, told=told)


def run(scene, seconds):
    """Advance, taking what came."""
    for _ in range(round(seconds * 100)):
        scene.station.receive()
        scene.station.tick()


def call(scene, name, kind, **fields):
    """Call a service; its response, or the reason why there is none."""
    answers = []
    scene.inbox.call(name, new(f"{kind}Request", **fields), "/test", lambda *answer: answers.append(answer))
    scene.station.receive()
    ((response, why),) = answers
    return response if response is not None else why
