"""The whole state of a run: what `get_state` returns and `set_state` takes."""

import contextlib
import hashlib
import json
import math
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import mujoco
import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from vrx_mj.arguments import as_path, check_kind
from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.config.loading import fault_text
from vrx_mj.config.tree import literal
from vrx_mj.constants import PHYSICS_VERSION
from vrx_mj.errors import StateError, VrxError, first_names, shorten, warn
from vrx_mj.model.world import other_physics
from vrx_mj.outputs import atomic_write

STATE_VERSION = 3
"""Version of the format of saved states."""
MAX_TIME = 1e9
"""Latest time of a state [s]."""
_Size = Annotated[int, Field(ge=0, lt=1 << 48)]
_Finite = Annotated[float, Field(allow_inf_nan=False)]
_Parameter = Annotated[str, Field(pattern="^[ -~]{1,600}$")]
"""Name of something that `Batch.vary` changes."""
SIGNATURE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
"""Parts of MuJoCo's state that are saved."""
_KINDS = {"world": str, "seed": int, "time": float, "mujoco": np.ndarray, "ours": bytes, "moving": int, "task": str,
         "varied": Mapping}  # fmt: skip
"""Types of the fields of a state."""
_PREFIX = "vrx_mj-diverged-"
"""Prefix of the names of folders with states of diverged runs."""
_FILE = "last_good.state"
"""Name of the file with the last state before a run diverged."""
MAX_KEPT = 10
"""Largest number of folders with states of diverged runs of one user in the temporary folder; the oldest are removed
first."""
MAX_KEPT_BYTES = 100_000_000
"""Largest size of these folders together [bytes]; the newest is kept whatever its size."""


@dataclass(frozen=True)
class Version:
    """Fields in the header of a state of any version."""

    version: int


@dataclass(frozen=True)
class Header:
    """Head of a saved state, before its numbers."""

    world: Annotated[str, Field(pattern="^[0-9a-f]{0,64}$")]
    seed: int
    time: str
    """Simulated time [s], as `float.hex` writes it."""
    mujoco: _Size
    """How many numbers follow."""
    moving: _Size
    task: str
    varied: dict[_Parameter, tuple[_Finite, _Finite]] = field(default_factory=dict)
    physics_version: int = 1


_VERSION, _HEADER = TypeAdapter[Any](Version), TypeAdapter[Any](Header)


@dataclass(frozen=True)
class State:
    """Complete state of a run; a run continued from it is bit-equal to the uninterrupted one.

    It holds plain numbers and bytes, so it can be pickled and moved to another process.
    """

    version: int
    """Version of this form; `check` refuses another one."""
    world: str
    """`World.sha256` of the world to which the state belongs."""
    seed: int
    """Seed of the run."""
    time: float
    """Simulated time [s]."""
    mujoco: FloatArray
    """MuJoCo's integration state (`mjSTATE_INTEGRATION`), a flat array."""
    ours: bytes
    """Bytes of the compiled loop's state: gusts, commands, servos, wave memory, shots, beacons, sensors' moments."""
    moving: int
    """Number of bytes of `ours` that affect the motion; the rest are the sensors' moments."""
    task: str = ""
    """State of the referee as JSON; empty if the world has no task."""
    varied: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Parameters that `Batch.vary` has made differ from the world's: value of the row, and of the world."""
    physics_version: int = PHYSICS_VERSION
    """`constants.PHYSICS_VERSION` of the run; a run of another one can go on from it, with a warning."""

    @property
    def sha256(self) -> str:
        """SHA-256 of everything that moves; equal runs have the same hash, whichever sensors were read."""
        digest = hashlib.sha256(f"{self.version} {self.seed}".encode())
        digest.update(np.float64(self.time).tobytes())
        digest.update(self.mujoco.tobytes())
        digest.update(self.ours[: self.moving])
        digest.update(self.task.encode())
        return digest.hexdigest()

    def check(self, world: str, like: "State | None" = None) -> None:
        """Check that a run of the world with this fingerprint can continue from this state.

        Args:
            world: `World.sha256` of that world.
            like: a state of that world, for an error that names the parts which another world has otherwise.

        Raises:
            StateError: the state belongs to another world, to a row of a batch that differs from this world, or to
                another version, or is not finite.

        Warns:
            VrxWarning: it is of another version of the physics.
        """
        _check_version(self.version)
        check_kind("check", world, str, "the sha256 of a world", StateError)
        for name, kind in _KINDS.items():
            value = getattr(self, name)
            if not isinstance(value, kind) or isinstance(value, bool):
                raise StateError(
                    f"invalid {name} of a state: a {kind.__name__} is needed, not a {type(value).__name__}"
                )
        if self.world != world:
            raise StateError(
                f"the state belongs to the world {self.world[:12]}, not to this one, {shorten(world[:12])}"
                f"{self._other_parts(like) if like else ''}; set it in a simulation of its own world"
            )
        if self.varied:
            other = ", ".join(f"{name} {value:.6g}, not {usual:.6g}" for name, (value, usual) in self.varied.items())
            raise StateError(f"the state belongs to a row of a Batch that differs from the world {world[:12]}: {other}")
        _check_time(self.time)
        if not 0 <= self.moving <= len(self.ours):
            raise StateError(f"invalid moving {self.moving} of a state: from 0 to {len(self.ours)} is needed")
        if self.mujoco.dtype != np.float64 or self.mujoco.ndim != 1:
            raise StateError("invalid mujoco of a state: a flat array of float64 is needed")
        if not np.isfinite(self.mujoco).all():
            raise StateError(f"the state at t = {self.time:g} s is not finite")
        if text := other_physics(self.physics_version):
            warn(f"the state at t = {self.time:g} s is {text}", 2)

    def _other_parts(self, like: "State") -> str:
        """Differences in size between this state and one of another world, in words."""
        sizes = (
            (len(self.mujoco), len(like.mujoco), "numbers of MuJoCo's bodies"),
            (self.moving, like.moving, "bytes of tables"),
            (int(bool(self.task)), int(bool(like.task)), "tasks"),
        )
        found = [f"{own} {what}, not {other}" for own, other, what in sizes if own != other]
        return f", and has {', '.join(found) or 'the same bodies, but other numbers, shapes or weather'}"

    def to_bytes(self) -> bytes:
        """The state as one block of bytes for `from_bytes`, without pickle."""
        names = ("version", "world", "seed", "time", "mujoco", "moving", "task", "physics_version")
        header: dict[str, Any] = {name: getattr(self, name) for name in names}
        header |= {"time": self.time.hex(), "mujoco": len(self.mujoco)}
        if self.varied:
            header["varied"] = dict(self.varied)
        return json.dumps(header).encode() + b"\n" + self.mujoco.astype("<f8").tobytes() + self.ours

    @staticmethod
    def from_bytes(block: bytes) -> "State":
        """State from the bytes that `to_bytes` returned.

        Raises:
            StateError: the bytes are not a state, or one of another version.
        """
        check_kind("from_bytes", block, bytes, "the bytes of a saved state, as to_bytes() returns them", StateError)
        head, _, body = block.partition(b"\n")
        try:
            version: int = _VERSION.validate_json(head, strict=True).version
            _check_version(version)
            header: Header = _HEADER.validate_json(head, strict=True)
            time = float.fromhex(header.time)
        except ValidationError as error:
            raise StateError(f"these {len(block)} bytes are not a saved state: {fault_text(error)}") from None
        except (ValueError, OverflowError):
            text = f"these {len(block)} bytes are not a saved state: invalid time {literal(header.time)}"
            raise StateError(text) from None
        _check_time(time)
        size = 8 * header.mujoco
        if len(body) < size:
            raise StateError(f"the saved state is truncated: {len(body)} of {size} bytes")
        numbers, ours = np.frombuffer(body[:size], "<f8").copy(), body[size:]
        if header.moving > len(ours):
            raise StateError(f"the saved state is truncated: {len(ours)} of {header.moving} bytes that move")
        rest = header.moving, header.task, header.varied, header.physics_version
        return State(version, header.world, header.seed, time, numbers, ours, *rest)

    def save(self, path: str | Path) -> None:
        """Write the state to a file, as a whole or not at all.

        Raises:
            CommandError: `path` is not a path.
            StateError: the file cannot be written.
        """
        with atomic_write(as_path("path", path), "the state", StateError) as file:
            file.write_bytes(self.to_bytes())

    @staticmethod
    def load(path: str | Path) -> "State":
        """Read a state that `save` or a diverged run has written.

        Raises:
            StateError: the file does not exist, or is not a state, or one of another version.
        """
        file = as_path("path", path)
        if not file.is_file():
            raise StateError(f"no saved state '{file}'")
        try:
            block = file.read_bytes()
        except OSError as error:
            raise StateError(f"cannot read the state '{file}': {error.strerror or error}") from error
        return State.from_bytes(block)


def integration_state(model: mujoco.MjModel, data: mujoco.MjData) -> FloatArray:
    """MuJoCo's integration state (`mjSTATE_INTEGRATION`), a flat array."""
    flat = np.empty(mujoco.mj_stateSize(model, SIGNATURE))
    mujoco.mj_getState(model, data, flat, SIGNATURE)
    return flat


def set_integration_state(model: mujoco.MjModel, data: mujoco.MjData, flat: FloatArray) -> None:
    """Write back what `integration_state` gave."""
    mujoco.mj_setState(model, data, flat, SIGNATURE)


def _check_time(time: float) -> None:
    """Raise a StateError unless a state can be of this time [s]."""
    if not (math.isfinite(time) and 0.0 <= time <= MAX_TIME):
        raise StateError(f"invalid time {time:g} s of a state: from 0 to {MAX_TIME:g} s is needed")


def _check_version(version: int) -> None:
    """Raise a StateError unless this is the version that we write."""
    if version != STATE_VERSION:
        raise StateError(f"the state has version {version}; this version of vrx_mj reads {STATE_VERSION}")


def divergence_message(body: str, time: float, timestep: float, good: State, kept: str) -> str:
    """Message of a divergence: the body, the time [s], and what became of the last good state, as `kept` has it."""
    return (
        f"{body} has a state that is not finite, or huge, at step {round(time / timestep)} (t = {time:g} s). "
        f"The state at t = {good.time:g} s {kept}"
    )


def rows_divergence_message(rows: IntArray, time: float) -> str:
    """Message that names the rows of a batch that diverged, the first at about this time [s]."""
    return (
        f"rows {first_names(map(str, rows), 5)} have a state that is not finite, or huge, at about t = "
        f"{time:g} s; they do not move until reset(rows)"
    )


def save_last_good_state(good: State) -> str:
    """Save a state to a new folder for this user alone, and return where it is; older ones make room for it."""
    try:
        file = Path(tempfile.mkdtemp(prefix=_PREFIX)) / _FILE
        good.save(file)
    except (OSError, VrxError) as error:
        return f"could not be saved: {getattr(error, 'strerror', None) or error}"
    others = sorted(_folders(file.parent), reverse=True)
    room, kept = MAX_KEPT_BYTES - file.stat().st_size, 1
    for _, size, folder in others:
        room -= size
        if kept < MAX_KEPT and room >= 0:
            kept += 1
        else:
            shutil.rmtree(folder, ignore_errors=True)
    return f"is in {file}: State.load reads it; the last {MAX_KEPT} such states are kept"


def _folders(newest: Path) -> Iterator[tuple[float, int, Path]]:
    """The other folders that diverged runs of this user have left: time of change [s], size [bytes] and path.

    Those of others, and symbolic links, are left alone.
    """
    getuid = getattr(os, "getuid", None)
    for folder in newest.parent.glob(f"{_PREFIX}*"):
        with contextlib.suppress(OSError):
            status = folder.lstat()
            ours = stat.S_ISDIR(status.st_mode) and (getuid is None or status.st_uid == getuid())
            if ours and folder != newest and re.fullmatch(rf"{_PREFIX}[a-z0-9_]+", folder.name):
                size = sum(file.lstat().st_size for file in folder.iterdir())
                yield status.st_mtime, size, folder
