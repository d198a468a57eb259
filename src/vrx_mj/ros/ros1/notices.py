"""What people should know of a network's doings: each told once."""

import logging
from collections.abc import Callable

__all__ = ["Notices"]

MOST = 1000
"""Different notices that are remembered; once there are so many, no new ones are told."""
LONGEST = 500
"""Characters of a notice: parts of it come from unknown_publishers."""

_logger = logging.getLogger("vrx_mj.ros")


class Notices:
    """Told to Python's log `vrx_mj.ros` and to whoever listens."""

    def __init__(self) -> None:
        self.listener: Callable[[str, str], None] | None = None
        """Takes the level, `INFO`, `WARN` or `ERROR`, and the text."""
        self._told: set[tuple[str, str]] = set()

    def tell(self, level: str, kind: str, who: str, text: str) -> None:
        """Tell a line, unless one of this kind was told of the same peer."""
        if (kind, who) in self._told or len(self._told) >= MOST:
            return
        self._told.add((kind, who))
        line = "".join(letter if letter.isprintable() else "?" for letter in text[:LONGEST])
        _logger.log({"INFO": logging.INFO, "WARN": logging.WARNING}.get(level, logging.ERROR), "%s", line)
        if self.listener is not None:
            self.listener(level, line)

    def forget(self, kind: str, who: str) -> None:
        """Let a line of this kind be told again."""
        self._told.discard((kind, who))
