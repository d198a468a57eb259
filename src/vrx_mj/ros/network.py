"""The thread in which networks live: one event loop for all of them, apart from the simulation's thread."""

import asyncio
import concurrent.futures
import contextlib
import threading
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

__all__ = ["Network"]

Result = TypeVar("Result")
CLOSING = 2.0
"""Wall time that what still runs has to end [s]."""


class Network:
    """An event loop in a daemon thread."""

    def __init__(self) -> None:
        self.loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="vrx_mj network", daemon=True)
        self._thread.start()

    def call(self, work: Coroutine[Any, Any, Result], timeout: float) -> Result:
        """Run a coroutine there, and wait for its result; TimeoutError after so long [s]. Not from the loop itself."""
        future = asyncio.run_coroutine_threadsafe(work, self.loop)
        try:
            return future.result(timeout)
        except concurrent.futures.TimeoutError:
            future.cancel()
            raise

    def soon(self, function: Callable[..., object], *arguments: Any) -> None:
        """Have a function called there; nothing happens once it is closed."""
        with contextlib.suppress(RuntimeError):
            self.loop.call_soon_threadsafe(function, *arguments)

    def close(self) -> None:
        """End all that runs there, and the thread."""
        if not self._thread.is_alive():
            return
        with contextlib.suppress(TimeoutError, concurrent.futures.TimeoutError):
            self.call(_end(), CLOSING)
        self.soon(self.loop.stop)
        self._thread.join(CLOSING)

    def _run(self) -> None:
        self.loop.run_forever()
        self.loop.close()


async def _end() -> None:
    own = asyncio.current_task()
    tasks = [task for task in asyncio.all_tasks() if task is not own]
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
