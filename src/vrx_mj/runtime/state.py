"""The whole state of a run: what `get_state` returns and `set_state` takes."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import as_path, check_kind
from vrx_mj.errors import StateError, printable
from vrx_mj.outputs import written

STATE_VERSION = 3


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
    mujoco: npt.NDArray[np.float64]
    """MuJoCo's integration state (`mjSTATE_INTEGRATION`), a flat array."""
    ours: bytes
    """Bytes of the compiled loop's state: gusts, commands, servos, wave memory, shots, beacons, sensors' moments."""
    moving: int
    """Number of bytes of `ours` that affect the motion; the rest are the sensors' moments."""
    task: str = ""
    """State of the referee as JSON; empty if the world has no task."""

    @property
    def sha256(self) -> str:
        """SHA-256 of everything that moves; equal runs have the same, whichever sensors were read."""
        digest = hashlib.sha256(f"{self.version} {self.seed}".encode())
        digest.update(np.float64(self.time).tobytes())
        digest.update(self.mujoco.tobytes())
        digest.update(self.ours[: self.moving])
        digest.update(self.task.encode())
        return digest.hexdigest()

    def check(self, world: str) -> None:
        """Check that a run of the world with this fingerprint can continue from this state.

        Raises:
            StateError: the state belongs to another world or another version, or is not finite.
        """
        check_version(self.version)
        check_kind("check", world, str, "the sha256 of a world", StateError)
        if self.world != world:
            raise StateError(
                f"the state belongs to the world {self.world[:12]}, not to this one, {printable(world[:12])}"
            )
        if not np.isfinite(self.mujoco).all():
            raise StateError(f"the state at t = {self.time:g} s is not finite")

    def to_bytes(self) -> bytes:
        """The state as one block of bytes for `from_bytes`, without pickle."""
        header = {
            "version": self.version,
            "world": self.world,
            "seed": self.seed,
            "time": self.time.hex(),
            "mujoco": len(self.mujoco),
            "moving": self.moving,
            "task": self.task,
        }
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
            header = json.loads(head)
            version = header["version"]
            size = 8 * header["mujoco"]
            fields = (header["world"], header["seed"], float.fromhex(header["time"]))
            moving, task = int(header["moving"]), str(header["task"])
        except (ValueError, TypeError, KeyError) as error:
            raise StateError(f"these {len(block)} bytes are not a saved state: {error}") from error
        check_version(version)
        if len(body) < size:
            raise StateError(f"the saved state is truncated: {len(body)} of {size} bytes")
        return State(version, *fields, np.frombuffer(body[:size], "<f8").copy(), body[size:], moving, task)

    def save(self, path: str | Path) -> None:
        """Write the state to a file, as a whole or not at all.

        Raises:
            CommandError: `path` is no path.
            StateError: the file cannot be written.
        """
        with written(as_path("path", path), "the state", StateError) as file:
            file.write_bytes(self.to_bytes())

    @staticmethod
    def load(path: str | Path) -> "State":
        """Read a state that `save` or a diverged run has written.

        Raises:
            StateError: the file is not a state, or one of another version.
        """
        file = as_path("path", path)
        try:
            block = file.read_bytes()
        except OSError as error:
            raise StateError(f"cannot read the state '{file}': {error.strerror}") from None
        return State.from_bytes(block)


def check_version(version: int) -> None:
    """Raise a StateError unless this is the version that we write."""
    if version != STATE_VERSION:
        raise StateError(f"the state has version {version}; this version of vrx_mj reads {STATE_VERSION}")
