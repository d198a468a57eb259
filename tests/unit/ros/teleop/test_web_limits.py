"""How many browsers the page's server holds, and what it takes for a rosbridge that is there."""

import http.server
import socket

import pytest

from vrx_mj.ros.teleop import web


class Browser:
    """A connection that is closed from here."""

    def __init__(self, number, closed):
        self.shutdown = lambda how: closed.append((number, how))


def test_one_connection_more_than_64_closes_the_oldest(monkeypatch):
    monkeypatch.setattr(http.server.ThreadingHTTPServer, "process_request", lambda *_: None)
    monkeypatch.setattr(http.server.ThreadingHTTPServer, "shutdown_request", lambda *_: None)
    server, closed = web.PageServer(0, "ws://127.0.0.1:9090"), []
    try:
        asked = [Browser(number, closed) for number in range(66)]
        for one in asked[:64]:
            server.process_request(one, None)
        assert closed == []
        server.process_request(asked[64], None)
        assert closed == [(0, socket.SHUT_RDWR)]
        server.shutdown_request(asked[3])
        server.process_request(asked[65], None)
        assert len(closed) == 1
        server.shutdown_request(asked[0])  # it has gone already
    finally:
        server.server_close()
    assert web._Answering.timeout == 10.0
    assert server.handle_error(None, None) is None


@pytest.mark.parametrize(("url", "port"), [("ws://h:9090", 9090), ("ws://h", 80), ("ws://h:9090/x", 9090)])
def test_a_rosbridge_is_there_if_anything_listens_within_a_second(monkeypatch, url, port):
    called = []

    class Connection:
        def __enter__(self):
            return self

        def __exit__(self, *_):
            called.append("closed")

    def create_connection(place, timeout):
        called.append((place, timeout))
        if len(called) > 2:
            raise ConnectionRefusedError
        return Connection()

    monkeypatch.setattr(socket, "create_connection", create_connection)
    assert web.reaches(url)
    assert called == [(("h", port), 1.0), "closed"]
    assert not web.reaches(url)
