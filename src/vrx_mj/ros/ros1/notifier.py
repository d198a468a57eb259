"""Telling nodes what has changed, each in its own time: one that is dead or slow delays no other."""

import asyncio
from collections.abc import Callable
from typing import Any

from vrx_mj.ros.ros1.http import BROKEN, LARGEST_REPLY, Proxy
from vrx_mj.ros.ros1.xmlrpc import Fault

__all__ = ["Notifier"]

PATIENCE = 5.0
"""Wall time that a node may take for an answer [s]."""
MOST_NODES = 512
"""Nodes that are being told something, at most; beyond that the one that takes longest is told no more."""

MOST_CALLS = 2000
"""Of one node that wait, at most."""


class Notifier:
    """Per node a list of calls; of calls of one method about one thing only the newest is made."""

    def __init__(self, unreachable: Callable[[str], None]) -> None:
        self._unreachable = unreachable
        self._waiting: dict[str, dict[tuple[str, str], tuple[Any, ...]]] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def tell(self, api: str, method: str, about: str, *values: Any) -> None:
        """Have a node's method called with the caller, the thing and these values."""
        if api not in self._waiting and len(self._waiting) >= MOST_NODES:
            slowest = next(iter(self._waiting))  # others are done within no time
            del self._waiting[slowest]
            self._tasks.pop(slowest).cancel()
        calls = self._waiting.setdefault(api, {})
        if len(calls) < MOST_CALLS or (method, about) in calls:
            calls[method, about] = (about, *values)
        if api not in self._tasks:
            self._tasks[api] = asyncio.get_running_loop().create_task(self._work(api))

    async def close(self) -> None:
        """Stop it all."""
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _work(self, api: str) -> None:
        proxy = Proxy(api, LARGEST_REPLY)
        calls = self._waiting[api]
        try:
            while calls:
                key = next(iter(calls))
                await proxy.call(key[0], "/master", *calls.pop(key), patience=PATIENCE)
        except ConnectionRefusedError:
            self._unreachable(api)
        except (*BROKEN, Fault, TypeError, OverflowError):
            pass  # it does not listen; what else it was to be told is of no use either
        finally:
            proxy.close()
            if self._waiting.get(api) is calls:  # else another task is there in its place, or none
                del self._waiting[api], self._tasks[api]
