"""The memory of rows on a graphics processor: a copy of the host's tables, and a table of runs that leads into it."""

from collections.abc import Iterable, Iterator
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from numba import cuda

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.cuda.kernels import SIMULATED, Stream, begin_rows, launcher, write_rows
from vrx_mj.physics.lanes import WIDTH
from vrx_mj.physics.tables import Table
from vrx_mj.physics.vessel import HullMeshes, VesselWork, vessel_work
from vrx_mj.runtime.row_tables import SEPARATE, RowTables, check_memory
from vrx_mj.runtime.views import ARRAYS

_COMMON_ARRAYS = ("time", "done", "features")
"""Arrays of all rows to which no run leads."""
_ROW_ARRAYS = {*SEPARATE, "qpos", "qvel", "xfrc_applied"}
"""Tables that a step changes: of threads that share a row, each has its own."""
_STATE_ARRAYS = {*_ROW_ARRAYS, *_COMMON_ARRAYS}


class DeviceArray(Protocol):
    """An array on the device, as numba has it, with `__cuda_array_interface__`."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Its shape."""

    @property
    def size(self) -> int:
        """How many numbers it has."""

    @property
    def dtype(self) -> npt.DTypeLike:
        """Type of its numbers."""

    def copy_to_host(self, ary: npt.NDArray[np.generic] | None = None, stream: Stream | int = 0) -> FloatArray:
        """A copy of it on the host; `ary` takes it, if given."""

    def copy_to_device(self, ary: "npt.NDArray[np.generic] | DeviceArray", stream: Stream | int = 0) -> None:
        """Take over an array of the host or the device."""

    def view(self, dtype: npt.DTypeLike) -> "DeviceArray":
        """The same memory as numbers of another type."""

    def reshape(self, *shape: int) -> "DeviceArray":
        """The same memory in another shape."""


class DeviceRows:
    """Arrays on the device by the names of the host's; each stays where it is while its size does."""

    def __init__(self, rows: RowTables, stream: Stream) -> None:
        """Copy the rows' memory to the current device; CommandError: there is not enough memory."""
        self._rows, self._stream, self._marine = rows, stream, not rows.arrays.vrx_only
        self.threads = WIDTH if self._marine else 1
        """Threads that share a row."""
        self.arrays: dict[str, DeviceArray] = {}
        self._starts: tuple[tuple[DeviceArray, ...], tuple[DeviceArray, ...]] = (), ()
        self._twins: dict[str, DeviceArray] = {}
        each = sum(part.nbytes for part in self._work(0)) if self._marine else 0
        sizes = {name: host.nbytes for name, host in self._hosts()} | {"runs": rows.runs.nbytes}
        more = (self.threads - 1) * sum(sizes[name] for name in sizes.keys() & {*_ROW_ARRAYS, "runs"})
        self._check_memory(sum(sizes.values()) + more + rows.n * each)
        self.push()

    def _check_memory(self, size: int) -> None:
        """CommandError: the device has not so many bytes left."""
        if not SIMULATED:
            free, _ = cuda.current_context().get_memory_info()
            check_memory(self._rows.n, size // self._rows.n + 1, int(free))

    def _hosts(self) -> Iterator[tuple[str, Table]]:
        """The host's arrays that are not empty, each with a name of its own."""
        rows = self._rows
        own = {f"{name}.{number}": table for number, (name, table) in enumerate(rows.own_tables())}
        named = rows.free_stacks() | own | {name: getattr(rows, name) for name in _COMMON_ARRAYS}
        return ((name, host) for name, host in named.items() if host.nbytes)

    def _work(self, row: int) -> VesselWork:
        """Memory of a row for vessels, with the row's waves in its columns."""
        tables: list[Any] = [self._rows.part(name, row) for name in HullMeshes._fields]
        return vessel_work(HullMeshes(*tables), self._rows.part("waves", row), self._rows.part("sea", row)[0])

    @property
    def work(self) -> list[DeviceArray]:
        """Memory of the kernels: floats' drag, (n, floats, 3), and outside of VRX's profiles `VesselWork`."""
        return [self.arrays["damping"], *(self.arrays[name] for name in VesselWork._fields if self._marine)]

    def push(self) -> None:
        """Copy everything from the host."""
        rows = self._rows
        runs = np.tile(rows.runs, self.threads)
        for name in ("model", "contact_free", "data"):
            runs[name] = 0
        for name, host in self._hosts():
            flat = host.reshape(-1).view(np.uint8) if host.dtype.names else host
            start, table = host.ctypes.data, name.partition(".")[0]
            self._put(name, flat)
            if table in ARRAYS:
                there = rows.runs[table][:, 0]
                inside = (there >= start) & (there < start + host.nbytes)
                for own, place in zip(np.split(runs[table], self.threads), self._places(name, host), strict=True):
                    own[inside, 0] = there[inside] - start + place
        if self._marine:
            for name, part in self._work(0)._asdict().items():
                if name not in self.arrays or self.arrays[name].shape[1:] != part.shape:
                    self.arrays[name] = cuda.device_array((rows.n, *part.shape), part.dtype)
            self._put("columns", self._columns(range(rows.n)))
            self._put("sharing", np.tile(np.arange(rows.n), self.threads - 1))
            self._put("shared", np.ones((self.threads - 1) * rows.n, np.bool_))
        self._put("damping", np.zeros((len(runs), max(1, len(rows.arrays.floats)), 3)))
        self._put("wind_velocity", np.zeros((rows.n, 2)))
        self._put("surface", np.zeros((rows.n, len(rows.arrays.hulls))))
        self._put("going", np.ones(rows.n, np.bool_))
        self._put("runs", runs)
        self._stream.synchronize()

    def _places(self, name: str, host: Table) -> list[int]:
        """Addresses of a table on the device for each of the threads that share a row."""
        first, more = _address(self.arrays[name]), self.threads - 1
        if name not in _ROW_ARRAYS or not more:
            return [first] * self.threads
        if name not in self._twins or self._twins[name].size * 4 != more * host.nbytes:
            shape = more * self._rows.n, host.nbytes // self._rows.n // 4
            self._twins[name] = cuda.device_array(shape, np.uint32)
        second = _address(self._twins[name])
        return [first, *range(second, second + more * host.nbytes, host.nbytes)]

    def share(self) -> None:
        """Give each thread of a row what the first has, and what its step changes."""
        if self._twins:
            firsts, at = tuple(map(self._words, self._twins)), self.arrays
            launch = launcher(begin_rows, at["sharing"].size, 0, self._stream)
            launch(at["shared"], at["sharing"], firsts, tuple(self._twins.values()))

    def threads_agree(self) -> bool:
        """Whether all threads of a row have come to the same bits in the last launch; waits for the device."""
        firsts = (self._words(name).copy_to_host().ravel() for name in self._twins)
        twins = (twin.copy_to_host().reshape(self.threads - 1, -1) for twin in self._twins.values())
        return all(bool((twin == first).all()) for first, twin in zip(firsts, twins, strict=True))

    def _words(self, name: str) -> DeviceArray:
        """A table on the device as words of four bytes, (n, words)."""
        return self.arrays[name].view(np.uint32).reshape(self._rows.n, -1)

    def _columns(self, which: Iterable[int]) -> FloatArray:
        """Waves of rows in columns, and memory, as in `VesselWork`."""
        return np.stack([self._work(row).columns for row in which])

    def keep(self) -> None:
        """Copy everything from the host, and keep it as starts, for `begin`; CommandError: no memory is left."""
        self.push()
        hosts, n = dict(self._hosts()), self._rows.n
        names = [name for name in hosts if "." not in name and len(hosts[name]) == n]
        names += ["columns"] if self._marine else []
        wholes = tuple(map(self._words, names))
        self._starts = (), ()
        self._check_memory(4 * sum(whole.size for whole in wholes))
        kept = tuple(map(cuda.device_array_like, wholes))
        for start, whole in zip(kept, wholes, strict=True):
            start.copy_to_device(whole, stream=self._stream)
        self._starts = kept, wholes

    def begin(self, begun: DeviceArray, starts: DeviceArray) -> None:
        """Let rows that are `begun`, (n,) of bool, go on from those of the kept starts that `starts`, (n,), names."""
        launcher(begin_rows, self._rows.n, 0, self._stream)(begun, starts, *self._starts)

    def push_rows(self, which: IntArray, *, moving: bool) -> None:
        """Copy these rows' parts of the stacks from the host, with or without what moves.

        Where a table has another size than on the device, everything is copied, other rows in the device's state.
        """
        hosts = dict(self._hosts())
        sizes = {name: self.arrays[name].view(np.uint8).size for name in hosts if name in self.arrays}
        stacks = {name for name in hosts if "." not in name and len(hosts[name]) == self._rows.n}
        own: dict[str, Any] = {name: hosts[name][which] for name in stacks if moving or name not in _STATE_ARRAYS}
        if sizes != {name: host.nbytes for name, host in hosts.items()}:
            self.pull()
            for name in own.keys() & _STATE_ARRAYS:
                hosts[name][which] = own[name]
            self.push()
        elif len(which):
            rows = cuda.to_device(which, stream=self._stream)
            if self._marine:
                own["columns"] = self._columns(which.tolist())
            for name, parts in own.items():
                given = cuda.to_device(parts.reshape(-1).view(np.uint8).reshape(len(which), -1), stream=self._stream)
                there = self.arrays[name].view(np.uint8).reshape(self._rows.n, -1)
                launcher(write_rows, given.size, 0, self._stream)(rows, given, there)

    def _put(self, name: str, flat: npt.NDArray[np.generic]) -> None:
        known = self.arrays.get(name)
        if known is not None and known.shape == flat.shape:
            known.copy_to_device(flat, stream=self._stream)
        else:
            self.arrays[name] = cuda.to_device(flat, stream=self._stream)

    def pull(self) -> None:
        """Copy what moves back to the host, when the device has done all that it was given."""
        for name, host in self._hosts():
            if name in _STATE_ARRAYS:
                flat = host.reshape(-1).view(np.uint8) if host.dtype.names else host
                self.arrays[name].copy_to_host(flat, stream=self._stream)
        self._stream.synchronize()


def _address(array: DeviceArray) -> int:
    """Address of an array on the device, or in numba's simulator."""
    interface = getattr(array, "__cuda_array_interface__", None) or getattr(array, "__array_interface__")  # noqa: B009
    return int(interface["data"][0])
