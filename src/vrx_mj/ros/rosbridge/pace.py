"""The brake for clients that send more than there is time for."""

import asyncio

__all__ = ["Pace"]

SHARE = 0.5
"""Of the time, what the messages of all clients may take in the long run."""
BURST = 0.2
"""What those of one may take at once [s]."""


class Pace:
    """One client's part: a flood must not take the interpreter from the simulation, nor the server from other clients.

    Those that have used up their burst share the time; others are not held up.
    """

    def __init__(self, flooding: set["Pace"]) -> None:
        self._flooding = flooding
        self._debt = 0.0
        self._paid = 0.0

    async def spent(self, seconds: float) -> None:
        """So much was spent on a message; waits until there is time for another."""
        now = asyncio.get_running_loop().time()
        share = SHARE / len(self._flooding | {self})
        self._debt = max(0.0, self._debt - share * (now - self._paid)) + seconds
        self._paid = now
        if self._debt > BURST:
            self._flooding.add(self)
        else:
            self._flooding.discard(self)
        await asyncio.sleep(max(0.0, (self._debt - BURST) / share))

    def end(self) -> None:
        """The client has gone."""
        self._flooding.discard(self)
