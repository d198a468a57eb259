"""Calls to XML-RPC servers on made-up streams: what is sent, taken and refused, and when a connection is kept."""

import asyncio
from xmlrpc.client import Fault, dumps

import pytest

from rosbridge_client import Skipping
from vrx_mj.errors import CommandError
from vrx_mj.ros.ros1 import xmlrpc
from vrx_mj.ros.ros1.xmlrpc import Proxy, RequestError, address, answer_bytes, ask, fault_bytes, read

URI = "http://h:11311/"


class Server:
    """Answers the calls of each connection with the next of its texts; without one more it has gone."""

    def __init__(self, monkeypatch, *connections):
        self.connections, self.opened, self.sent, self.aborted = list(connections), [], [], 0
        monkeypatch.setattr(xmlrpc.asyncio, "open_connection", self.open)

    async def open(self, host, port, limit, family):
        self.opened.append((host, port, limit))
        if not self.connections:
            raise ConnectionRefusedError
        texts, reader, server = list(self.connections.pop(0)), asyncio.StreamReader(limit=limit), self

        class Writer:
            transport = server

            def write(self, data):
                server.sent.append(data)
                if texts:
                    reader.feed_data(texts.pop(0))
                if not texts:
                    reader.feed_eof()

        return reader, Writer()

    def abort(self):
        self.aborted += 1


def said(body, first=b"HTTP/1.1 200 OK", length=True, **fields):
    head = [first, *(f"{name}: {value}".encode() for name, value in fields.items())]
    head += [f"Content-Length: {len(body)}".encode()] * length
    return b"\r\n".join(head) + b"\r\n\r\n" + body


def called(*methods, largest=1 << 24, timeout=5.0):
    """The answers to calls over one proxy."""

    async def run():
        proxy = Proxy(URI, largest)
        found = [await proxy.call(method, "/me", timeout=timeout) for method in methods]
        proxy.close()
        return found

    with asyncio.Runner(loop_factory=Skipping) as runner:
        return runner.run(run())


def test_a_connection_is_kept_and_opened_again_once_when_it_was_closed_while_idle(monkeypatch):
    one, two, three = (said(answer_bytes(number)) for number in (1, 2, 3))
    server = Server(monkeypatch, [one, two], [three])
    assert called("a", "b", "c") == [1, 2, 3]
    assert server.opened == [("h", 11311, 1 << 14)] * 2
    assert len(server.sent) == 4
    body = dumps(("/me",), "a").encode()
    assert server.sent[0] == (
        b"POST /RPC2 HTTP/1.1\r\nHost: h:11311\r\nUser-Agent: vrx_mj\r\nContent-Type: text/xml\r\n"
        b"Content-Length: %d\r\n\r\n" % len(body) + body
    )
    assert server.aborted == 2
    with pytest.raises(ConnectionRefusedError):
        called("a")


@pytest.mark.parametrize(
    ("options", "is_kept"),
    [
        ({}, True), ({"first": b"HTTP/1.0 200 OK"}, False), ({"Connection": "Close"}, False),
        ({"Connection": "keep-alive"}, True), ({"length": False}, False),
    ],
)  # fmt: skip
def test_a_connection_is_kept_if_both_ends_can(monkeypatch, options, is_kept):
    server = Server(monkeypatch, [said(answer_bytes(5), **options), said(answer_bytes(6))], [said(answer_bytes(7))])
    if options.get("length", True):
        assert called("a", "b") == [5, 6 if is_kept else 7]
        assert len(server.opened) == (1 if is_kept else 2)
        return
    server.connections[0].pop()
    assert called("a", "b") == [5, 7]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (said(b"", b"HTTP/1.1 404 " + b"n" * 99), f"{URI} answers 'HTTP/1.1 404 {'n' * 47}' instead of XML-RPC"),
        (said(b"", b"SSH 200 x"), f"{URI} answers 'SSH 200 x' instead of XML-RPC"),
        (said(b"", b"HTTP/1.1"), "not HTTP"),
        (said(b"x" * 101), "invalid Content-Length '101': a whole number of at most 100 is needed"),
        (said(b"x" * 101, length=False), "an answer of more than 100 bytes"),
        (said(b"", **{"Transfer-Encoding": "chunked"}), "only plain bodies in one piece are supported"),
        (b"x" * 20_000, "an HTTP head of more than 16384 bytes"),
    ],
)  # fmt: skip
def test_what_is_no_answer_is_said(monkeypatch, text, why):
    server = Server(monkeypatch, [text])
    with pytest.raises(CommandError) as caught:
        called("a", largest=100)
    assert str(caught.value) == why
    assert server.aborted == 1


def test_an_answer_of_just_the_largest_size_is_taken(monkeypatch):
    body = answer_bytes(5)
    for length in (True, False):
        Server(monkeypatch, [said(body, length=length)])
        assert called("a", largest=len(body)) == [5]


def test_a_fault_is_raised_and_silence_is_a_timeout(monkeypatch):
    Server(monkeypatch, [said(fault_bytes("no"))])
    with pytest.raises(Fault, match="no"):
        called("a")

    async def never(*_args, **_options):
        await asyncio.sleep(1e6)

    monkeypatch.setattr(xmlrpc.asyncio, "open_connection", never)
    with pytest.raises(TimeoutError):
        called("a")


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        ([0, "failed", 1], "getPid: failed"), ([-1, "wrong", 1], "getPid: wrong"),
        ([1, "few"], f"{URI} does not answer getPid as ROS does"), (7, f"{URI} does not answer getPid as ROS does"),
        (["1", "", 1], f"{URI} does not answer getPid as ROS does"), ([1, "", 7], None),
    ],
)  # fmt: skip
def test_an_answer_of_ros_is_a_code_a_text_and_a_value(monkeypatch, answer, why):
    Server(monkeypatch, [said(answer_bytes(answer))])
    if why is None:
        assert asyncio.run(ask(URI, "getPid", "/me")) == 7
        return
    with pytest.raises(CommandError) as caught:
        asyncio.run(ask(URI, "getPid", "/me"))
    assert str(caught.value) == why


@pytest.mark.parametrize(
    ("uri", "scheme", "place"),
    [
        ("http://h:1", "http", ("h", 1)), ("rosrpc://h:65535/x", "rosrpc", ("h", 65535)), ("http://h", "http", None),
        ("http://h:0", "http", None), ("http://h:65536", "http", None), ("http://h:1", "rosrpc", None),
        ("http://" + "a" * 63 + ":1", "http", ("a" * 63, 1)), ("http://" + "a" * 64 + ":1", "http", None),
        ("http://" + ".".join(["a" * 49] * 5) + "aaaa:1", "http", (".".join(["a" * 49] * 5) + "aaaa", 1)),
        ("http://" + ".".join(["a" * 50] * 5) + ":1", "http", None), ("http://a b:1", "http", None),
    ],
)  # fmt: skip
def test_a_uri_has_a_host_and_a_port(uri, scheme, place):
    if place is not None:
        assert address(uri, scheme) == place
        return
    with pytest.raises(CommandError) as caught:
        address(uri, scheme)
    assert str(caught.value) == f"invalid URI {uri[:100]!r}: {scheme}://host:port is needed"


@pytest.mark.parametrize(("bound", "name"), [("_MAX_DEPTH", "depth"), ("_MOST_ELEMENTS", "count")])
def test_calls_have_so_many_elements_and_levels(monkeypatch, bound, name):
    body = answer_bytes([[1]])  # methodResponse, params, param, value, and twice array, data, value; int
    monkeypatch.setattr(xmlrpc, "_MAX_DEPTH", 99)
    monkeypatch.setattr(xmlrpc, "_MOST_ELEMENTS", 99)
    monkeypatch.setattr(xmlrpc, bound, 11)
    assert asyncio.run(read(body)) == (([[1]],), None), name
    monkeypatch.setattr(xmlrpc, bound, 10)
    with pytest.raises(CommandError, match=r"^more than \d+ nested elements, or \d+ in all$"):
        asyncio.run(read(body))


def test_what_cannot_be_written_is_a_fault_that_says_so():
    with pytest.raises(Fault) as caught:
        asyncio.run(read(answer_bytes(object())))
    assert caught.value.faultString.startswith("the answer cannot be written: cannot marshal ")
    assert caught.value.faultCode == 1
    kind, values = RequestError("400 Bad Request", "no").__reduce__()
    assert (kind, values) == (RequestError, ("400 Bad Request", "no"))
