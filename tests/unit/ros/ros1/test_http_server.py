"""XML-RPC over HTTP, byte by byte."""

import asyncio
import re
from xmlrpc.client import Binary, Fault, dumps, loads

import pytest

from vrx_mj.errors import CommandError
from vrx_mj.ros.limits import ConnectionLimit, Pace
from vrx_mj.ros.network import Notices
from vrx_mj.ros.parameters import plain
from vrx_mj.ros.ros1.connection import CALLS_BURST, CALLS_SHARE, HttpServer
from vrx_mj.ros.ros1.xmlrpc import Proxy, address, read, read_head

PING = dumps(("x",), "ping").encode()
HEAD = b"POST / HTTP/1.1\r\nContent-Length: %d\r\n" % len(PING)


def echo(method, values, _host):
    if method == "fail":
        raise Fault(1, "it failed")
    return [method, *values]


def served(test):
    """The result of a coroutine that takes the port of a server."""

    async def run():
        server = HttpServer("server", echo, ConnectionLimit(8), Notices())
        port = await server.start(["127.0.0.1"], 0)
        try:
            async with asyncio.timeout(10.0):
                return await test(port)
        finally:
            await server.close()

    return asyncio.run(run())


def talk(data: bytes) -> bytes:
    """All that the server says to some bytes, until it closes."""

    async def run(port):
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        try:
            writer.write(data)
            return await reader.read()
        except ConnectionResetError:
            return b"reset"
        finally:
            writer.transport.abort()

    return served(run)


def bodies(answer: bytes) -> list[bytes]:
    return re.findall(rb"<\?xml.*?</methodResponse>\n", answer, re.DOTALL)


def test_connections_are_kept_as_the_client_wishes():
    kept = talk(HEAD + b"\r\n" + PING + HEAD + b"connection: CLOSE\r\n\r\n" + PING)
    assert [loads(body) for body in bodies(kept)] == [((["ping", "x"],), None)] * 2
    assert [line for line in kept.split(b"\r\n") if line.startswith(b"Connection")] == [
        b"Connection: keep-alive",
        b"Connection: close",
    ]
    old = HEAD.replace(b"1.1", b"1.0")
    assert len(bodies(talk(old + b"\r\n" + PING))) == 1
    assert len(bodies(talk(old + b"Connection: keep-alive\r\n\r\n" + PING + old + b"\r\n" + PING))) == 2


def test_a_client_that_asks_before_it_sends_is_told_to_go_on():
    assert talk(HEAD + b"Expect: 100-continue\r\nConnection: close\r\n\r\n" + PING).startswith(
        b"HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 200 OK\r\n"
    )


@pytest.mark.parametrize(
    ("head", "why"),
    [
        (
            "POST / HTTP/1.1\r\nContent-Length: -1",
            "invalid Content-Length '-1': a whole number of at most 16777216 is needed",
        ),
        (
            "POST / HTTP/1.1\r\nContent-Length: 16777217",
            "invalid Content-Length '16777217': a whole number of at most 16777216 is needed",
        ),
        (
            "POST / HTTP/1.1\r\nContent-Length: ²",
            "invalid Content-Length '²': a whole number of at most 16777216 is needed",
        ),
        ("POST / HTTP/1.1\r\nTransfer-Encoding: chunked", "only plain bodies in one piece are supported"),
        ("POST / HTTP/2.0", "this is XML-RPC: 'POST / HTTP/2.0' is not HTTP/1.0 or 1.1"),
    ],
)
def test_bad_requests_are_told_and_closed(head, why):
    answer = talk(head.encode("latin-1") + b"\r\n\r\n")
    assert answer.startswith(b"HTTP/1.1 400 Bad Request\r\n")
    assert answer.decode().endswith(f"\r\n\r\n{why}")


@pytest.mark.parametrize(
    "head", [b"x" * 50_000, b"POST\r\n\r\n", b"POST / HTTP/1.1\r\nno colon\r\n\r\n", b"A: 1\r\nA: 2\r\n\r\n"]
)
def test_what_is_no_http_is_closed(head):
    assert not talk(head).startswith(b"HTTP/1.1 200")


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (b"<!DOCTYPE a [<!ENTITY b 'c'>]>" + PING[22:], "a document type is not allowed in XML-RPC"),
        (PING.decode().replace("?>", " encoding='utf-16'?>").encode("utf-16")[:80], "not XML-RPC: ExpatError .*"),
        (
            b"<methodCall><methodName>a</methodName><params><param>" + b"<value><array><data>" * 50,
            "more than 128 nested elements, or 400000 in all",
        ),
        (
            b"<methodCall><methodName>a</methodName><params><param><value><i4>x</i4></value>",
            "not XML-RPC: ValueError .*",
        ),
        (b"not xml", "not XML-RPC: ExpatError .*"),
        (dumps((1,), methodresponse=True).encode(), "an answer instead of a call"),
        (dumps((), "fail").encode(), "it failed"),
        (dumps((5,), "system.multicall").encode(), "system.multicall needs one list of at most 1000 calls"),
    ],
)
def test_bad_calls_are_faults(body, why):
    head = b"POST / HTTP/1.1\r\nConnection: close\r\nContent-Length: %d\r\n\r\n" % len(body)
    with pytest.raises(Fault) as caught:
        loads(bodies(talk(head + body))[0])
    assert re.fullmatch(why, caught.value.faultString)


def test_many_calls_at_once_have_an_answer_each():
    calls = [{"methodName": "a", "params": [1]}, {"methodName": "fail", "params": []}, {"no": 1}]
    body = dumps((calls,), "system.multicall").encode()
    head = b"POST / HTTP/1.1\r\nConnection: close\r\nContent-Length: %d\r\n\r\n" % len(body)
    ((answers,), _) = loads(bodies(talk(head + body))[0])
    assert answers == [
        [["a", 1]],
        {"faultCode": 1, "faultString": "it failed"},
        {"faultCode": 1, "faultString": "'methodName'"},
    ]


def test_our_client_calls_again_when_the_server_has_closed_in_between():
    async def run(port):
        proxy = Proxy(f"http://127.0.0.1:{port}/")
        try:
            first = await proxy.call("a", 1)
            proxy._streams[1].transport.abort()
            second = await proxy.call("b", "ä" * 100_000)
            with pytest.raises(Fault):
                await proxy.call("fail")
            return first, second
        finally:
            proxy.close()

    assert served(run) == (["a", 1], ["b", "ä" * 100_000])


def test_values_that_xml_rpc_cannot_carry_become_such_or_are_refused():
    assert plain({"a": (1, 2**40, True, "x"), 5: Binary(b"x")}) == {
        "a": [1, float(2**40), True, "x"],
        "5": Binary(b"x"),
    }
    deep = []
    for _ in range(40):
        deep = [deep]
    for value, why in (
        (deep, "a value is nested more than 32 levels deep"),
        (b"x", "a bytes cannot be the value of a parameter"),
    ):
        with pytest.raises(CommandError) as caught:
            plain(value)
        assert str(caught.value) == why


def test_a_large_call_lets_others_have_their_turn():
    async def run():
        turns = 0

        async def count():
            nonlocal turns
            while True:
                turns += 1
                await asyncio.sleep(0)

        task = asyncio.create_task(count())
        await read(dumps((list(range(20_000)),), "a").encode())
        task.cancel()
        return turns

    assert asyncio.run(run()) > 10


@pytest.mark.parametrize(
    "uri",
    ["", "http://", "http://host", "http://host:99999", "ftp://host:1", "http://a b:1", "http://" + "a" * 64 + ":1"],
)
def test_a_uri_without_host_or_port_is_refused(uri):
    with pytest.raises(CommandError) as caught:
        address(uri)
    assert str(caught.value) == f"invalid URI {uri!r}: http://host:port is needed"


def test_in_the_long_run_answers_take_their_share_of_the_time_and_a_burst_is_free():
    now = 0.0
    pace = Pace(CALLS_SHARE, CALLS_BURST)
    assert [pace.wait(0.01, now) for _ in range(49)] == [0.0] * 49  # half a second at once
    spent = 0.49
    while now < 100.0:
        now += 0.01
        now += pace.wait(0.01, now)
        spent += 0.01
    assert spent == pytest.approx(0.25 * now, abs=0.6)  # and the burst


def head(*fields):
    """The fields of a head."""

    async def run():
        reader = asyncio.StreamReader()
        reader.feed_data("\r\n".join(["POST / HTTP/1.1", *fields, "", ""]).encode())
        return (await read_head(reader))[1]

    return asyncio.run(run())


def test_a_field_may_come_twice_if_it_says_the_same():
    assert head("Host: a", "content-length:  5 ", "HOST: a") == {"host": "a", "content-length": "5"}
    for fields in (("Content-Length: 5", "content-length: 6"), ("Host",)):
        with pytest.raises(CommandError):
            head(*fields)


def asked(code):
    """What a call by ROS's rules gives, where the other end answers with a code, a text and a value."""

    def answer(_method, values, _host):
        return list(values)

    async def run():
        server = HttpServer("server", answer, ConnectionLimit(8), Notices())
        proxy = Proxy(f"http://127.0.0.1:{await server.start(['127.0.0.1'], 0)}")
        try:
            return await proxy.ros("getPid", code, "why", 5)
        finally:
            proxy.close()
            await server.close()

    return asyncio.run(run())


def test_of_ros_s_codes_only_1_is_a_success():
    assert asked(1) == 5
    for code in (0, -1, 2):
        with pytest.raises(CommandError, match="why"):
            asked(code)
