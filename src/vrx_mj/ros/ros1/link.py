"""Calls to the master, be it our own in this process or another one."""

from collections.abc import Sequence
from typing import Any, Protocol

from vrx_mj.errors import CommandError
from vrx_mj.ros.ros1.http import PATIENCE, Proxy
from vrx_mj.ros.ros1.master import Master
from vrx_mj.ros.ros1.xmlrpc import Fault

__all__ = ["FarLink", "Link", "NearLink"]

MOST_AT_ONCE = 100
"""Calls that are sent together."""
Request = tuple[str, Sequence[Any]]
"""Method and values."""


class Link(Protocol):
    """The way to a master."""

    async def many(self, requests: Sequence[Request], patience: float = PATIENCE) -> list[Any]:
        """The value of each call; None where it failed. OSError and so on: the master cannot be reached."""

    def close(self) -> None:
        """Close the connection."""


class NearLink:
    """To our own master."""

    def __init__(self, master: Master) -> None:
        self._master = master

    async def many(self, requests: Sequence[Request], patience: float = PATIENCE) -> list[Any]:
        """As `Link` has it."""
        del patience  # it answers at once
        return [_value(list(self._master.call(method, values))) for method, values in requests]

    def close(self) -> None:
        """There is no connection."""


class FarLink:
    """To a master of somebody else."""

    def __init__(self, uri: str) -> None:
        self._proxy = Proxy(uri)
        self._takes_many = True

    async def many(self, requests: Sequence[Request], patience: float = PATIENCE) -> list[Any]:
        """As `Link` has it."""
        values: list[Any] = []
        for start in range(0, len(requests), MOST_AT_ONCE):
            values += await self._some(requests[start : start + MOST_AT_ONCE], patience)
        return values

    def close(self) -> None:
        """Close the connection."""
        self._proxy.close()

    async def _some(self, requests: Sequence[Request], patience: float) -> list[Any]:
        if self._takes_many and len(requests) > 1:
            calls = [{"methodName": method, "params": list(values)} for method, values in requests]
            try:
                answers = await self._proxy.call("system.multicall", calls, patience=patience)
            except Fault:
                self._takes_many = False  # masters that are not in Python may not have it
            else:
                if not isinstance(answers, list) or len(answers) != len(requests):
                    raise CommandError("the master does not answer system.multicall as ROS does")
                return [_value(answer[0] if isinstance(answer, list) and answer else None) for answer in answers]
        return [await self._one(method, values, patience) for method, values in requests]

    async def _one(self, method: str, values: Sequence[Any], patience: float) -> Any:
        try:
            return _value(await self._proxy.call(method, *values, patience=patience))
        except Fault:
            return None


def _value(reply: Any) -> Any:
    """The value of a reply of code, text and value; None if the code is no success."""
    return reply[2] if isinstance(reply, list) and len(reply) == 3 and reply[0] == 1 else None
