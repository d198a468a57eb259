"""Messages that clients send in fragments, put together within bounds."""

from vrx_mj.errors import CommandError
from vrx_mj.ros.intake import Intake, Place
from vrx_mj.ros.rosbridge.protocol import MOST_INCOMING, Operation, text

__all__ = ["Fragments"]

MOST_OPEN = 16
"""Messages of a client of which fragments are missing, at most: the oldest are thrown away."""
MOST_PIECES = 10_000


class Fragments:
    """A client's messages that are not whole yet. `intake` bounds those of all clients together."""

    def __init__(self, intake: Intake, place: Place) -> None:
        self._intake, self._place = intake, place
        self._open: dict[str, dict[int, str]] = {}
        self._size = 0

    def add(self, message: Operation) -> str | None:
        """One more fragment, in any order; gives the whole message with the last.

        Raises:
            CommandError: what is wrong with it.
        """
        identity, data = text(message, "id"), message.get("data")
        if not isinstance(data, str):
            raise CommandError("fragment: data is missing, or not a string")
        total = _whole(message, "total", 1, MOST_PIECES)
        number = _whole(message, "num", 0, total - 1)
        pieces = self._open.setdefault(identity, {})
        self._size += len(data) - len(pieces.get(number, ""))
        pieces[number] = data
        if self._size > MOST_INCOMING:
            self.end()
            raise CommandError(f"fragment: more than {MOST_INCOMING} characters wait for the rest of their messages")
        if len(pieces) >= total:
            whole = "".join(pieces[number] for number in sorted(pieces))
            self._forget(identity)
            return whole
        if len(self._open) > MOST_OPEN:
            self._forget(next(iter(self._open)))
        self._intake.hold(self._place, self._size)
        return None

    def end(self) -> None:
        """Forget all."""
        self._open.clear()
        self._size = 0
        self._intake.hold(self._place, 0)

    def _forget(self, identity: str) -> None:
        self._size -= sum(map(len, self._open.pop(identity).values()))
        self._intake.hold(self._place, self._size)


def _whole(message: Operation, key: str, low: int, high: int) -> int:
    value = message.get(key)
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise CommandError(f"fragment: invalid {key} {str(value)[:40]!r}; allowed: a whole number from {low} to {high}")
    return value
