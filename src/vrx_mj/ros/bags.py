"""A bag as a transport: it listens to what a simulation publishes, and nothing of a network is needed."""

import fnmatch
import sqlite3
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from vrx_mj.errors import RecordError, UnknownNameError
from vrx_mj.ros.bag_files import BagFile, open_bag
from vrx_mj.ros.messages import Message, new, stamp
from vrx_mj.ros.offer import Sent, Table, Traffic

__all__ = ["HEAVY", "Bag"]

HEAVY = frozenset({"sensor_msgs/CompressedImage", "sensor_msgs/Image", "sensor_msgs/PointCloud2"})
"""Types that are recorded only where they are named: measuring them takes most of a run's time, and most of a file."""
FLUSH = 1.0
"""Wall time after which what was published is on the disk [s]."""
FIRST = 1
"""The earliest moment that ROS's tools play [ns]: they take 0 for no time at all."""
LOG, LOG_TOPIC = "rosgraph_msgs/Log", "/rosout"
LEVELS = {"INFO": 2, "WARN": 4, "ERROR": 8}


class Bag:
    """Writes what is published to a ROS 1 bag, an MCAP file or a folder of rosbag2, by the moments of simulated time.

    A process that is killed leaves what was published until a second before, but for the file's end. ROS's tools say
    that it is broken: `rosbag reindex` mends a .bag, `mcap recover` an .mcap, `ros2 bag reindex` a folder.
    """

    title = "bag"

    def __init__(self, path: str | Path, *, topics: Sequence[str] = ()) -> None:
        """A bag at `path`; the file is made by `start`.

        Args:
            path: ends in .bag (ROS 1) or .mcap, or is a folder (rosbag2).
            topics: names of images and point clouds to write too, `*` stands for anything; all others are written.
        """
        self.path = Path(path)
        self._topics = tuple(topics)
        self._file: BagFile | None = None
        self._wanted: frozenset[str] = frozenset()
        self._size, self._flushed, self._now = 0, time.monotonic(), 0.0

    def start(self) -> Sequence[str]:
        """Make the file, in place of an earlier bag; returns where it is.

        Raises:
            RecordError: it cannot be written, or something that is no bag is there.
        """
        with self._writing():
            self._file = open_bag(self.path)
        return [f"bag: {self.path}"]

    def offer(self, table: Table) -> None:
        """Write these topics from now on.

        Raises:
            UnknownNameError: there is no topic like one that was named.
        """
        names = set(table.outputs)
        named = {pattern: set(fnmatch.filter(names, pattern)) for pattern in self._topics}
        for pattern, found in named.items():
            if not found and not self._wanted:  # later a boat may have left
                raise UnknownNameError(
                    "topic", pattern, [one.name for one in table.outputs.values() if one.type in HEAVY]
                )
        light = {output.name for output in table.outputs.values() if output.type not in HEAVY}
        self._wanted = frozenset(light.union(*named.values()))

    @property
    def wanted(self) -> frozenset[str]:
        """Topics that are written."""
        return self._wanted

    def publish(self, batch: Sequence[Sent]) -> None:
        """Write messages of one moment.

        Raises:
            RecordError: they cannot be written.
        """
        if self._file is None:
            raise RecordError(f"the bag '{self.path}' is closed")
        for output, message, moment in batch:
            if output.name in self._wanted:
                self.write(output.name, output.type, message, moment, latched=output.latched)
        if time.monotonic() > self._flushed + FLUSH:
            with self._writing():
                self._file.flush()
            self._flushed = time.monotonic()

    def write(self, topic: str, type_name: str, message: Message, moment: float, *, latched: bool = False) -> None:
        """Write one message of a moment [s], wanted or not.

        Raises:
            RecordError: it cannot be written.
        """
        if self._file is None:
            raise RecordError(f"the bag '{self.path}' is closed")
        self._now = moment
        with self._writing():
            self._size += self._file.write(topic, type_name, message, max(FIRST, round(moment * 1e9)), latched=latched)

    def log(self, level: str, text: str) -> None:
        """Write a line on `/rosout`, where ROS 1 has those of all programs."""
        if self.path.suffix != ".bag" or self._file is None:
            return
        header = new("std_msgs/Header", stamp=stamp(self._now))
        message = new(LOG, header=header, level=LEVELS.get(level, LEVELS["INFO"]), name="/vrx_mj", msg=text)
        self.write(LOG_TOPIC, LOG, message, self._now)

    @property
    def traffic(self) -> Traffic:
        """What was written."""
        return Traffic(0, self._size, 0)

    def close(self) -> None:
        """Complete the file. Once; later calls do nothing."""
        file, self._wanted = self._file, frozenset()
        if file is not None:
            with self._writing():
                file.close()
            self._file = None

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Say in one line why it cannot be written, and leave it then as it is."""
        try:
            yield
        except (OSError, sqlite3.Error) as error:
            if self._file is not None:
                with suppress(OSError, sqlite3.Error):
                    self._file.abort()
                self._file = None
            reason = getattr(error, "strerror", None) or error
            raise RecordError(f"cannot write the bag '{self.path}': {reason}") from error
