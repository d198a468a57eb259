"""A client of rosbridge that says and hears raw messages, and a clock that jumps."""

import asyncio
import json

import cbor2
from websockets.sync.client import connect

__all__ = ["WAIT", "Skipping", "Talk"]

WAIT = 5.0


class Talk:
    """A client that says things and hears things."""

    def __init__(self, bridged):
        self._connecting = connect(bridged.url, max_size=None, compression=None)
        self.heard = []

    def __enter__(self):
        self.socket = self._connecting.__enter__()
        return self

    def __exit__(self, *what):
        self._connecting.__exit__(*what)

    def say(self, op, **what):
        self.socket.send(json.dumps({"op": op, **what}))

    def hear(self):
        data = self.socket.recv(WAIT)
        return json.loads(data) if isinstance(data, str) else cbor2.loads(data)

    def call(self, service, args=None, **what):
        """The response to a call; all that came before has been done then, and what came is in `heard`."""
        self.say("call_service", service=service, args=args, id="call", **what)
        self.heard = []
        while (message := self.hear())["op"] != "service_response":
            self.heard.append(message)
        return message

    def sync(self):
        """What has come for all that was said."""
        self.call("/rosapi/get_time")
        return self.heard

    def complaint(self, op, **what):
        self.say(op, **what)
        (status,) = self.sync()
        assert (status["op"], status["level"]) == ("status", "error")
        return status["msg"]


class Skipping(asyncio.SelectorEventLoop):
    """A loop whose clock jumps to where it would wait for."""

    def __init__(self):
        super().__init__()
        self.now = 0.0
        self.select = self._selector.select
        self._selector.select = self.skip

    def time(self):
        return self.now

    def skip(self, timeout):
        self.now += timeout or 0.0
        return self.select(0)
