"""Bags: the files of ROS's tools, the transport that writes them, and runs that are written into them."""

import fnmatch
import os
import sqlite3
import struct
import tempfile
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from numbers import Real
from pathlib import Path
from typing import Any, BinaryIO, Final

from rosbags.convert.converter import LATCH
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import get_types_from_msg

from vrx_mj.errors import RecordError, UnknownNameError, warn
from vrx_mj.outputs import write_files
from vrx_mj.ros import cdr
from vrx_mj.ros.interface import CONVERSIONS, LEVELS, LOG, ROSOUT, Delivery, Inbox, RosInterface, Traffic, log_message
from vrx_mj.ros.messages import Message, encode, full_name, full_text, md5sum, new, typestore
from vrx_mj.ros.parameters import command_topic
from vrx_mj.ros.ros_server import CLOCK_RATE, RosServer
from vrx_mj.ros.table.viewers import layout_text
from vrx_mj.runtime.observation import Observation
from vrx_mj.runtime.run import Controller
from vrx_mj.runtime.simulation import Simulation

_CALLER = "/vrx_mj"
"""Node that a ROS 1 bag names as the sender of its messages."""
_CHUNK = 1 << 20
"""Size of a chunk of a ROS 1 bag [bytes]; those of MCAP are as large."""
_NEVER = 1 << 62
"""A time after all others [ns]."""
_HEAD_PADDING = 13 + 4 + 69
"""Position of the padding of a bag's first record, with its length: after the file's mark and the record's fields."""
_HEAD_SIZE = 4096 - 69
"""Bytes of padding in a bag's first record, as `rosbag` has it."""
_LENGTH_BYTES = 8
"""Bytes that rosbags takes off the padding: the lengths of the fields and of the padding itself."""
_ROS1_MAGIC, _MCAP_MAGIC = b"#ROSBAG V", b"\x89MCAP0\r\n"
"""First bytes of a ROS 1 bag, and of an MCAP file."""
_VERSION: Final = 9
"""Version of rosbag2's metadata."""
KINDS = "a .bag file (ROS 1), an .mcap file, or a folder with no extension (rosbag2)"
"""Kinds of bags, in messages."""
HEAVY_TYPES = frozenset(
    {"sensor_msgs/CompressedImage", "sensor_msgs/Image", "sensor_msgs/PointCloud2", "vision_msgs/Detection2DArray"}
)
"""Types that are recorded only by name: measuring them takes most of a run's time, and most of a file."""
FLUSH_PERIOD = 1.0
"""Longest wall time until what was published is on the disk [s]."""
FIRST = 1
"""Earliest time that ROS's tools play [ns]: they take 0 for no time at all."""
COMMAND_TYPE = "std_msgs/Float32"
"""Type of the commands of thrusters."""


class BagFile(ABC):
    """A bag that is being written."""

    def __init__(self, writer: Writer1 | Writer2) -> None:
        self._writer: Any = writer
        self._connections: dict[tuple[str, str], Connection] = {}

    def write(self, topic: str, type_name: str, message: Message, time: int, *, latched: bool) -> int:
        """Add a message of a moment [ns]; returns its size [bytes]."""
        key = topic, type_name
        if key not in self._connections:
            self._connections[key] = self._connect(topic, type_name, latched)
        raw = self._encode(message, type_name)
        self._writer.write(self._connections[key], time, raw)
        return len(raw)

    @abstractmethod
    def flush(self) -> None:
        """Bring what was written to the disk: it is there if the process is killed."""

    @abstractmethod
    def close(self) -> None:
        """Complete the bag."""

    def abort(self) -> None:
        """Close it as it is."""
        self._writer.abort()

    @abstractmethod
    def _connect(self, topic: str, type_name: str, latched: bool) -> Connection:
        """A connection for the messages of a topic."""

    @abstractmethod
    def _encode(self, message: Message, type_name: str) -> bytes:
        """The bytes of a message."""


def _open_bag(path: Path) -> BagFile:
    """A new bag in place of an earlier one, of the kind that its name ends in.

    Raises:
        RecordError: the name has another ending, or something other than a bag of this kind is there.
    """
    if path.suffix == ".bag":
        _make_room(path, _ROS1_MAGIC)
        return Ros1File(path)
    if path.suffix == ".mcap":
        _make_room(path, _MCAP_MAGIC)
        return _mcap(path)
    if path.suffix:
        raise RecordError(f"invalid bag name '{path}'; allowed: {KINDS}")
    _clear(path)
    writer = Writer2(path, version=_VERSION, storage_plugin=StoragePlugin.SQLITE3)
    writer.open()
    return Ros2File(writer)


def _make_room(path: Path, magic: bytes) -> None:
    """Remove an earlier bag, or an empty file."""
    if not path.exists():
        return
    with path.open("rb") as file:
        head = file.read(len(magic))
    if head not in {b"", magic}:
        raise RecordError(f"'{path}' already exists and is not a bag: choose another name, or remove it")
    path.unlink()


def _clear(folder: Path) -> None:
    """Remove an earlier bag of rosbag2, finished or not, or an empty folder."""
    if not folder.exists():
        return
    if not folder.is_dir():
        raise RecordError(f"'{folder}' already exists and is not a folder: choose another name, or remove it")
    ours = {"metadata.yaml", f"{folder.name}.db3", f"{folder.name}.db3-journal"}
    for file in sorted(folder.iterdir()):
        if file.name not in ours:
            raise RecordError(f"'{file}' already exists and is not part of a bag: choose another folder, or remove it")
    for file in folder.iterdir():
        file.unlink()
    folder.rmdir()


class Ros1File(BagFile):
    """A ROS 1 bag, its chunks compressed by LZ4."""

    def __init__(self, path: Path) -> None:
        super().__init__(Writer1(path))
        self._writer.set_compression(Writer1.CompressionFormat.LZ4)
        self._writer.compressor = _compress
        self._writer.chunk_threshold = _NEVER  # chunks are cut here
        self._writer.open()
        assert self._writer.bio is not None
        _widen(self._writer.bio)
        self._writer.bio.seek(0, os.SEEK_END)
        self._writer.bio.write(b" " * _LENGTH_BYTES)

    def write(self, topic: str, type_name: str, message: Message, time: int, *, latched: bool) -> int:
        """Add a message of a moment [ns]; returns its size [bytes]."""
        size = super().write(topic, type_name, message, time, latched=latched)
        if self._writer.chunks[-1].data.tell() > _CHUNK:
            self._cut()
        return size

    def flush(self) -> None:
        """Bring what was written to the disk: it is there if the process is killed."""
        if self._writer.chunks[-1].connections:
            self._cut()
        if self._writer.bio is not None:
            self._writer.bio.flush()

    def close(self) -> None:
        """Complete the bag."""
        self._writer.close()
        with self._writer.path.open("r+b") as file:
            _widen(file)

    def _connect(self, topic: str, type_name: str, latched: bool) -> Connection:
        about = {"msgdef": full_text(type_name), "md5sum": md5sum(type_name), "callerid": _CALLER}
        made: Connection = self._writer.add_connection(topic, full_name(type_name), latching=int(latched), **about)
        return made

    def _encode(self, message: Message, type_name: str) -> bytes:
        return encode(message, type_name)

    def _cut(self) -> None:
        """Write a chunk. Of its index only the counts are needed from now on, and an hour's would fill the memory."""
        chunk = self._writer.chunks[-1]
        self._writer.write_chunk(chunk)
        counts: Any = {number: range(len(rows)) for number, rows in chunk.connections.items()}
        chunk.connections = counts


class Ros2File(BagFile):
    """A bag of rosbag2."""

    def flush(self) -> None:
        """Bring what was written to the disk: it is there if the process is killed."""
        storage: Any = self._writer.storage
        if self._writer.storage_plugin == StoragePlugin.SQLITE3:
            storage.conn.commit()
            return
        if storage.chunk.msgs:
            storage.close_chunk()
        storage.bio.flush()

    def close(self) -> None:
        """Complete the bag."""
        with tempfile.TemporaryDirectory() as elsewhere:
            if not self._writer.path.is_dir():  # a file alone has no metadata beside it
                self._writer.metapath = Path(elsewhere) / "metadata.yaml"
            self._writer.close()

    def _connect(self, topic: str, type_name: str, latched: bool) -> Connection:
        name, profiles = _ros2_name(type_name), LATCH if latched else ()
        made: Connection = self._writer.add_connection(
            topic, name, typestore=cdr.typestore(), offered_qos_profiles=profiles
        )
        return made

    def _encode(self, message: Message, type_name: str) -> bytes:
        return cdr.encode(_ros2_message(message, type_name), type_name)


def _widen(file: BinaryIO) -> None:
    """Make the bag's first record as long as `rosbag` has it, which writes it anew when it mends a bag."""
    file.seek(_HEAD_PADDING)
    file.write(struct.pack("<I", _HEAD_SIZE))


def _compress(raw: bytes) -> bytes:
    """LZ4 in the form that ROS 1's reader needs: independent blocks, a checksum, no size at the beginning."""
    from lz4 import frame

    return bytes(frame.compress(raw, block_linked=False, content_checksum=True, store_size=False))


def _mcap(path: Path) -> Ros2File:
    """A single file, which rosbags begins in a folder."""
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".bag-") as scratch:
        folder = Path(scratch) / path.stem
        writer = Writer2(folder, version=_VERSION, storage_plugin=StoragePlugin.MCAP)
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        writer.open()
        (folder / path.name).rename(path)
    return Ros2File(writer)


@cache
def _ros2_name(type_name: str) -> str:
    """The type of that name in ROS 2; one that ROS 2 does not bring gets the same fields there."""
    name, types = full_name(type_name), cdr.typestore()
    if name not in types.types:
        texts = get_types_from_msg(typestore().generate_msgdef(name, ros_version=2)[0], name)
        types.register({kind: fields for kind, fields in texts.items() if kind not in types.types})
    return name


def _ros2_message(message: Message, type_name: str) -> Message:
    """Message of the table as ROS 2 has it where its type has other fields there."""
    its_type, convert = CONVERSIONS.get(type_name, ("", None))
    return convert(message) if convert and its_type == type_name else message


class Bag:
    """Writes what is published to a ROS 1 bag, an MCAP file or a folder of rosbag2, by the moments of simulated time.

    A process that is killed leaves what was published until a second before, but for the file's end. ROS's tools say
    that it is broken: `rosbag reindex` mends a .bag, `mcap recover` an .mcap, `ros2 bag reindex` a folder.
    """

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
        self._types: dict[str, str] = {}
        self._size, self._flushed, self._now = 0, time.monotonic(), 0.0

    def start(self) -> Sequence[str]:
        """Make the file, in place of an earlier bag; returns where it is.

        Raises:
            RecordError: it cannot be written, or something other than a bag is there.
        """
        with self._writing():
            self._file = _open_bag(self.path)
        return [f"bag: {self.path}"]

    def offer(self, table: RosInterface) -> None:
        """Write these topics from now on.

        Raises:
            UnknownNameError: no topic matches one that was named.
        """
        names = set(table.outputs)
        named = {pattern: set(fnmatch.filter(names, pattern)) for pattern in self._topics}
        for pattern, found in named.items():
            if not found and not self._wanted:  # later a boat may have left
                raise UnknownNameError(
                    "topic", pattern, [one.name for one in table.outputs.values() if one.type in HEAVY_TYPES]
                )
        light = {output.name for output in table.outputs.values() if output.type not in HEAVY_TYPES}
        self._wanted = frozenset(light.union(*named.values()))
        twice = sorted(name for name in self._wanted if f"{name}/compressed" in self._wanted)
        if twice:
            text = f"the bag records both raw and compressed images of {', '.join(twice[:3])}: raw images make it large"
            warn(f"{text}; name {twice[0]}/compressed to record only the others", 2)

    @property
    def subscribed_topics(self) -> frozenset[str]:
        """Topics that are written."""
        return self._wanted

    def publish(self, batch: Sequence[Delivery]) -> None:
        """Write messages of one moment.

        Raises:
            RecordError: they cannot be written.
        """
        if self._file is None:
            raise RecordError(f"the bag '{self.path}' is closed")
        for output, message, moment in batch:
            if output.name in self._wanted:
                self.write(output.name, output.type, message, moment, latched=output.latched)
        if time.monotonic() > self._flushed + FLUSH_PERIOD:
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
        self._now, self._types[topic] = moment, type_name
        with self._writing():
            self._size += self._file.write(topic, type_name, message, max(FIRST, round(moment * 1e9)), latched=latched)

    def log(self, level: str, text: str) -> None:
        """Write a line on `/rosout`, where ROS 1 has those of all programs."""
        if self.path.suffix != ".bag" or self._file is None:
            return
        line = log_message(self._now, level if level in LEVELS else "INFO", _CALLER, text)
        self.write(ROSOUT, LOG, line, self._now)

    @property
    def traffic(self) -> Traffic:
        """Traffic of the bag: the bytes written."""
        return Traffic(0, self._size, 0)

    def close(self) -> None:
        """Complete the file, and write an .mcap's layout beside it. Once; later calls do nothing."""
        file, self._wanted = self._file, frozenset()
        if file is not None:
            with self._writing():
                file.close()
                if self.path.suffix == ".mcap":
                    shown = {self.path.with_suffix(".layout.json").name: layout_text(self._types)}
                    write_files(self.path.parent, shown, "the layout", RecordError)
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


_Advance = Callable[[int], None]


@contextmanager
def bag_run(
    sim: Simulation, path: str | Path, controller: Controller | None = None, *, topics: Sequence[str] = ()
) -> Iterator[tuple[_Advance, Controller | None]]:
    """Write all that happens inside the `with` statement into a bag; the motion stays the same to the last bit.

    Gives what advances the simulation meanwhile, and a controller that does as `controller` and is heard: its commands
    are messages too. `topics` are those of `Bag`. An exception, Ctrl-C included, completes the file and goes on.

    Raises:
        RecordError: the bag cannot be written.
        UnknownNameError: no topic matches one that was named.
    """
    bag = Bag(path, topics=topics)
    bag.start()
    try:
        rate = min(CLOCK_RATE, 1.0 / sim.timestep)
        server = RosServer(sim, [bag], Inbox(), report=bag.log, truth=True, clock_rate=rate)
        try:
            server.announce()
            yield server.advance, None if controller is None else _with_commands_in(bag, sim, controller)
        finally:
            server.close()
    finally:
        bag.close()


def _with_commands_in(bag: Bag, sim: Simulation, controller: Controller) -> Controller:
    """A controller whose commands go into a bag."""

    def command(seen: Observation, time: float) -> Mapping[str, Any] | None:
        commands = controller(seen, time)
        if isinstance(commands, Mapping):
            for boat in sim.boats:
                _write_commands(bag, boat, sim.command_names(boat), commands.get(boat), time)
        return commands

    return command


def _write_commands(bag: Bag, boat: str, names: Sequence[str], given: object, time: float) -> None:
    """Write a boat's commands; whether they are right is the simulation's to say."""
    if isinstance(given, Mapping):
        for name in names:
            if isinstance(given.get(name), Real):
                bag.write(command_topic(boat, name), COMMAND_TYPE, new(COMMAND_TYPE, data=float(given[name])), time)
