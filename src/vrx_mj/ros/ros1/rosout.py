"""Lines for people on `/rosout`, and the services that say how many of them."""

import time

from vrx_mj.ros.inbox import Answer
from vrx_mj.ros.messages import Message, new, stamp
from vrx_mj.ros.ros1.publication import Publication, Stream

__all__ = ["LEVELS", "Rosout"]

TOPIC = "/rosout"
LEVELS = {"DEBUG": 1, "INFO": 2, "WARN": 4, "ERROR": 8, "FATAL": 16}
LOGGER = "ros.vrx_mj"


class Rosout:
    """The topic, and the level below which nothing is told."""

    def __init__(self, stream: Stream) -> None:
        self.node = stream.node
        self.publication = Publication(stream, TOPIC, "rosgraph_msgs/Log", latched=False)
        self.level = "INFO"
        self.time: float | None = None
        """Simulated time [s], once there is one."""
        self.services = {
            f"{stream.node}/get_loggers": ("roscpp/GetLoggers", self.get_loggers),
            f"{stream.node}/set_logger_level": ("roscpp/SetLoggerLevel", self.set_level),
        }

    def log(self, level: str, text: str) -> None:
        """Tell a line."""
        if LEVELS.get(level, 8) < LEVELS[self.level]:
            return
        moment = time.time() if self.time is None else self.time
        header = {"stamp": stamp(moment)}
        self.publication.send(
            new("rosgraph_msgs/Log", header=header, level=LEVELS.get(level, 8), name=self.node, msg=text)
        )

    def get_loggers(self, _request: Message, _caller: str, answer: Answer) -> None:
        """The one logger and its level."""
        logger = new("roscpp/Logger", name=LOGGER, level=self.level.lower())
        answer(new("roscpp/GetLoggersResponse", loggers=[logger]), "")

    def set_level(self, request: Message, _caller: str, answer: Answer) -> None:
        """Set its level."""
        level = str(request.level).upper()
        if level not in LEVELS:
            answer(None, f"no level {request.level[:40]!r}; known: {', '.join(name.lower() for name in LEVELS)}")
            return
        self.level = level
        answer(new("roscpp/SetLoggerLevelResponse"), "")
