"""5,000 mutated messages at every door of ROS 1: afterwards the node serves, and nothing has stayed."""

import asyncio
import os
import random
from collections.abc import Iterator
from urllib.parse import urlsplit
from xmlrpc.client import ServerProxy, dumps

import pytest

from fuzz.raw import mutated
from fuzz.ros1_messages import CALLS, HEADERS
from ros1_peer import ME, dial, frame, frame_of, service_of, stream_of
from ros1_served import LEFT, Served, free_port, small_table, until
from vrx_mj.ros.ros1.connection import encode_header

FLOAT32 = "73fcbf46b49191e672908e50842a83d4"
Said = tuple[tuple[str, int], bytes]


async def said(place: tuple[str, int], data: bytes) -> None:
    """Say something, hear what comes within no time, and leave."""
    reader, writer = await asyncio.open_connection(*place)
    try:
        writer.write(data)
        async with asyncio.timeout(0.005):
            await reader.read(1 << 16)
    except (OSError, TimeoutError):
        pass
    finally:
        writer.transport.abort()


class Attack:
    """The doors, and what goes in; all is drawn from one seed."""

    def __init__(self, served: Served) -> None:
        self.chance = random.Random(20260)
        self.served = served
        self.count = 0
        self.writers: set[asyncio.StreamWriter] = set()
        with ServerProxy(served.uri) as master:
            node = urlsplit(master.lookupNode(ME, "/gazebo")[2])
        self.api = {"master": ("127.0.0.1", served.port), "node": (node.hostname, node.port)}
        self.stream = stream_of(served.uri, "/course")

    def calls(self, count: int) -> Iterator[Said]:
        """Calls with mutated bodies, and now and then a mutated head."""
        for _ in range(count):
            door = self.chance.choice(list(CALLS))
            method, values = self.chance.choice(CALLS[door])
            body = dumps(values, method).encode()
            head = b"POST /RPC2 HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/xml\r\nContent-Length: %d\r\n\r\n"
            if self.chance.random() < 0.25:
                yield self.api[door], mutated(head % len(body) + body, self.chance)
            else:
                body = mutated(body, self.chance)
                yield self.api[door], head % len(body) + body

    def headers(self, count: int) -> Iterator[Said]:
        """Headers, and in half of the connections what follows one that is good."""
        for _ in range(count):
            good = encode_header(self.chance.choice(HEADERS))
            follows = frame(b"") * self.chance.randint(0, 3)
            is_good = self.chance.random() < 0.5
            yield self.stream, good + mutated(follows + b"\0", self.chance) if is_good else mutated(good, self.chance)

    async def all_said(self, messages: Iterator[Said]) -> None:
        """Say them all, some at one time."""

        async def work() -> None:
            for place, data in messages:
                self.count += 1
                await said(place, data)

        await asyncio.gather(*(work() for _ in range(16)))

    async def publishers(self, count: int) -> None:
        """A publisher that is called again and again, and answers with garbage."""
        self.left, self.ended = count, asyncio.Event()
        stream = await asyncio.start_server(self._send, "127.0.0.1", 0)
        self.place = stream.sockets[0].getsockname()
        api = await asyncio.start_server(self._answer, "127.0.0.1", 0)
        uri = f"http://127.0.0.1:{api.sockets[0].getsockname()[1]}/"
        async with stream, api:
            await asyncio.to_thread(self.register, "registerPublisher", LEFT, "std_msgs/Float32", uri)
            async with asyncio.timeout(20.0):
                await self.ended.wait()
            await asyncio.to_thread(self.register, "unregisterPublisher", LEFT, uri)
            while self.served.ros._node.subscriptions[LEFT].sources:
                await asyncio.sleep(0.01)
            for _ in range(20):  # what it has still dialled is accepted, and so in `writers`
                await asyncio.sleep(0)
        for writer in self.writers:  # ours: what is left over is to be the simulation's
            writer.transport.abort()
        await asyncio.sleep(0.05)

    async def _send(self, _: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.writers.add(writer)
        self.left -= 1
        self.count += 1
        if self.left <= 0:
            self.ended.set()
        good = encode_header({"callerid": ME, "md5sum": FLOAT32, "type": "std_msgs/Float32"})
        data = good + frame(b"\0\0\0\0") * 3
        writer.write(mutated(data, self.chance) if self.chance.random() < 0.5 else good + mutated(data, self.chance))
        writer.close()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.writers.add(writer)
        try:
            await reader.readuntil(b"</methodCall>")
        except (OSError, EOFError):
            writer.transport.abort()
            return
        body = dumps(([1, "", ["TCPROS", *self.place]],), methodresponse=True).encode()
        if self.chance.random() < 0.2:
            body = mutated(body, self.chance)
            self.count += 1
        writer.write(b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
        writer.close()

    def register(self, method: str, *values: str) -> None:
        with ServerProxy(self.served.uri) as master:
            getattr(master, method)("/fuzz_publisher", *values)


def held(served: Served) -> Iterator[object]:
    """What must not grow: open files, connections, bytes of unfinished frames, tasks of the loop."""
    node = served.ros._node
    yield len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0  # noqa: PTH112, PTH208
    yield dict(served.ros._connection_limit.inside)
    yield node.tcpros_listener.intake.used
    yield node.stream.counts.waiting
    yield len(asyncio.all_tasks(served.network.loop))


def has_grown(before: list[object], after: list[object]) -> bool:
    """Fewer open files than before are those of other tests."""
    return after[0] > before[0] or after[1:] != before[1:]


@pytest.mark.slow
def test_after_5000_mutated_messages_all_is_as_before(monkeypatch, caplog):
    monkeypatch.setattr("vrx_mj.ros.ros1.tcpros.FIRST_PAUSE", 0.0)
    monkeypatch.setattr("vrx_mj.ros.ros1.tcpros.LONGEST_PAUSE", 0.001)
    monkeypatch.setattr("vrx_mj.ros.ros1.master.SWEEP_PERIOD", 1000.0)
    with Served(free_port(), small_table("wamv")) as served:
        attack = Attack(served)
        until(lambda: not served.ros._connection_limit.inside, "the test's own connections are closed")
        before = list(held(served))
        asyncio.run(attack.all_said(attack.calls(2600)))
        asyncio.run(attack.all_said(attack.headers(1900)))
        asyncio.run(attack.publishers(500))
        assert attack.count >= 5000
        assert served.network._thread.is_alive()
        until(lambda: not has_grown(before, list(held(served))), "nothing has stayed")
        connection, _ = dial(stream_of(served.uri, "/course"), topic="/course")
        with connection:
            assert frame_of(connection) == frame(b"gate 3")
        connection, _ = dial(service_of(served.uri, "/trigger"), service="/trigger")
        with connection:
            connection.sendall(frame(b""))
            assert connection.recv(1) == b"\x01"
    assert not [record for record in caplog.records if record.name == "asyncio"]
    assert len(caplog.messages) < 100  # told once, not each time


@pytest.mark.parametrize("text", [b"", b"\0", b"\x04\0\0\0", b"GET / HTTP/1.1\r\n\r\n"])
def test_mutations_differ_from_the_original_or_are_few(text):
    chance = random.Random(1)
    assert sum(mutated(text + b"abcdef", chance) != text + b"abcdef" for _ in range(100)) > 80
