"""The memory of rows on a graphics processor: a copy of the host's tables, and a table of runs that leads into it."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import cuda

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.cuda.kernels import SIMULATED, Stream, copy_rows, launcher
from vrx_mj.errors import CommandError
from vrx_mj.packages import importing
from vrx_mj.physics.lanes import WIDTH
from vrx_mj.physics.tables import Table
from vrx_mj.physics.vessel import HullMeshes, VesselWork, vessel_work
from vrx_mj.physics.waves import row_columns
from vrx_mj.runtime.row_tables import SEPARATE, RowTables, check_memory
from vrx_mj.runtime.views import ARRAYS

arrays: Any = np
"""The library of arrays that callers get: CuPy, or NumPy where the processor is simulated."""
if not SIMULATED:
    with importing("vrx_mj.cuda", "CuPy", "cuda"):
        import cupy

        arrays = cupy

DeviceArray = Any
"""An array on the device as numba has it, with `__cuda_array_interface__` and without DLPack."""
_Tables = tuple[DeviceArray, ...]

_COMMON_ARRAYS = ("time", "done", "features")
"""Arrays of all rows to which no run leads."""
_ROW_ARRAYS = {*SEPARATE, "qpos", "qvel", "xfrc_applied"}
"""Tables that a step changes; each thread that shares a row has a copy of its own."""
_STATE_ARRAYS = {*_ROW_ARRAYS, *_COMMON_ARRAYS}


class DeviceRows:
    """Arrays on the device under the names of the host's; each keeps its address until its size changes.

    In `_ROW_ARRAYS` the first n rows belong to the first threads of all rows, the next n to the second ones, and so on.
    """

    def __init__(self, rows: RowTables, stream: Stream) -> None:
        """Copy the rows' memory to the current device; CommandError: there is not enough memory."""
        self._rows, self._stream, self._marine = rows, stream, not rows.arrays.vrx_only
        self.threads = WIDTH if self._marine else 1
        """Threads that share a row."""
        self.arrays: dict[str, DeviceArray] = {}
        self._starts: tuple[_Tables, _Tables] = (), ()
        self._shared: _Tables = ()
        each = sum(part.nbytes for part in self._work()) if self._marine else 0
        size = sum(host.nbytes * self._copies(name) for name, host in self._hosts())
        self._check_memory(size + self.threads * rows.runs.nbytes + rows.n * each)
        self.push()

    def _check_memory(self, size: int) -> None:
        """Check that the device has so many bytes left; CommandError: it has not."""
        if not SIMULATED:
            free, _ = cuda.current_context().get_memory_info()
            check_memory(self._rows.n, size // self._rows.n + 1, int(free))

    def _hosts(self) -> Iterator[tuple[str, Table]]:
        """The host's arrays that are not empty, each with a name of its own."""
        rows = self._rows
        own = {f"{name}.{number}": table for number, (name, table) in enumerate(rows.own_tables())}
        named = rows.free_stacks() | own | {name: getattr(rows, name) for name in _COMMON_ARRAYS}
        return ((name, host) for name, host in named.items() if host.nbytes)

    def _copies(self, name: str) -> int:
        """Number of copies of an array: one for each thread of a row if a step changes it."""
        return self.threads if name in _ROW_ARRAYS else 1

    def _work(self) -> VesselWork:
        """Memory of a row for vessels."""
        tables: list[Any] = [self._rows.part(name, 0) for name in HullMeshes._fields]
        return vessel_work(HullMeshes(*tables), self._rows.part("waves", 0), self._rows.part("sea", 0)[0])

    @property
    def work(self) -> list[DeviceArray]:
        """Memory of the kernels: floats' drag, (n, floats, 3), and outside of VRX's profiles `VesselWork`."""
        return [self.arrays["damping"], *(self.arrays[name] for name in VesselWork._fields if self._marine)]

    def push(self) -> None:
        """Copy everything from the host."""
        rows, n = self._rows, self._rows.n
        runs, lanes = np.tile(rows.runs, self.threads), np.repeat(np.arange(self.threads), n)
        runs[["model", "contact_free", "data"]] = 0
        for name, host in self._hosts():
            copies, table = self._copies(name), name.partition(".")[0]
            self._put(name, _plain(host), copies)
            if table in ARRAYS:
                there = np.tile(rows.runs[table][:, 0] - host.ctypes.data, self.threads)
                inside = (there >= 0) & (there < host.nbytes)
                place = _address(self.arrays[name]) + (lanes * host.nbytes if copies > 1 else 0)
                runs[table][inside, 0] = (there + place)[inside]
        if self._marine:
            for name, part in self._work()._asdict().items():
                self._allocate(name, (n, *part.shape), part.dtype)
            self._put("columns", self._columns(np.arange(n)))
            self._put("sharing", np.tile(np.arange(n), self.threads))
            self._put("others", lanes > 0)
            self._shared = tuple(self._words(name) for name, _ in self._hosts() if name in _ROW_ARRAYS)
        self._put("damping", np.zeros((len(runs), max(1, len(rows.arrays.floats)), 3)))
        self._put("wind_velocity", np.zeros((n, 2)))
        self._put("surface", np.zeros((n, len(rows.arrays.hulls))))
        self._put("going", np.ones(n, np.bool_))
        self._put("runs", runs)
        self._stream.synchronize()

    def share(self) -> None:
        """Copy what a step changes from the first thread of each row to the others."""
        if self._shared:
            self._copy_rows(self.arrays["others"], self.arrays["sharing"], self._shared, self._shared)

    def threads_agree(self) -> bool:
        """Whether all threads of a row have come to the same bits in the last launch; waits for the device."""
        parts = (whole.copy_to_host().reshape(self.threads, -1) for whole in self._shared)
        return all(bool((part == part[0]).all()) for part in parts)

    def _words(self, name: str) -> DeviceArray:
        """A table on the device as words of four bytes, (rows, words)."""
        table = self.arrays[name]
        return table.view(np.uint32).reshape(table.shape[0], -1)

    def _columns(self, which: IntArray) -> FloatArray:
        """Waves of rows in columns, and memory, as in `VesselWork`."""
        sea, waves = self._rows.stacks["sea"], self._rows.seas.waves(which)
        return row_columns(waves, sea[which] if len(sea) > 1 else sea, self._work().columns)

    def _stacks(self, hosts: dict[str, Table]) -> list[str]:
        """Names of the host's arrays of which each row has a part."""
        return [name for name, host in hosts.items() if "." not in name and len(host) == self._rows.n]

    def keep(self) -> None:
        """Copy everything from the host, and keep it as starts, for `begin`; CommandError: no memory is left."""
        self.push()
        names = self._stacks(dict(self._hosts())) + ["columns"] * self._marine
        wholes = tuple(self._words(name)[: self._rows.n] for name in names)
        self._starts = (), ()
        self._check_memory(4 * sum(whole.size for whole in wholes))
        kept = tuple(map(cuda.device_array_like, wholes))
        for start, whole in zip(kept, wholes, strict=True):
            start.copy_to_device(whole, stream=self._stream)
        self._starts = kept, wholes

    def begin(self, begun: DeviceArray, starts: DeviceArray) -> None:
        """Reset the rows that are `begun`, (n,) of bool, to the kept starts with the numbers `starts`, (n,).

        Raises:
            CommandError: no starts are kept, or a table has had another size since.
        """
        if not self._starts[0]:
            raise CommandError("no starts are kept of rows as they are: call keep() before begin()")
        self._copy_rows(begun, starts, *self._starts)

    def _copy_rows(self, which: DeviceArray, sources: DeviceArray, parts: _Tables, wholes: _Tables) -> None:
        """Launch `copy_rows`."""
        launcher(copy_rows, sources.size, 0, self._stream)(which, sources, parts, wholes)

    def push_rows(self, which: IntArray, *, moving: bool) -> None:
        """Copy these rows' parts of the stacks from the host, with or without what moves.

        Where a table has another size than on the device, everything is copied, other rows in the device's state.
        """
        hosts, n = dict(self._hosts()), self._rows.n
        sizes = {name: self.arrays[name].nbytes for name in hosts if name in self.arrays}
        own: dict[str, Any] = {
            name: hosts[name][which] for name in self._stacks(hosts) if moving or name not in _STATE_ARRAYS
        }
        if sizes != {name: host.nbytes * self._copies(name) for name, host in hosts.items()}:
            self.pull()
            for name in own.keys() & _STATE_ARRAYS:
                hosts[name][which] = own[name]
            self.push()
        elif len(which):
            if self._marine:
                own["columns"] = self._columns(which)
            begun, places = np.zeros(n, np.bool_), np.zeros(n, np.int64)
            begun[which], places[which] = True, np.arange(len(which))
            words = [part.reshape(len(which), -1).view(np.uint32) for part in own.values()]
            begun, places, *parts = (cuda.to_device(each, stream=self._stream) for each in (begun, places, *words))
            self._copy_rows(begun, places, tuple(parts), tuple(map(self._words, own)))

    def _put(self, name: str, values: npt.NDArray[np.generic], copies: int = 1) -> None:
        """Copy an array of the host to the first of so many parts of one on the device."""
        self._allocate(name, (copies * len(values), *values.shape[1:]), values.dtype)
        self.arrays[name][: len(values)].copy_to_device(values, stream=self._stream)

    def _allocate(self, name: str, shape: tuple[int, ...], dtype: npt.DTypeLike) -> None:
        """Allocate an array on the device, unless there is one of this shape."""
        if name not in self.arrays or self.arrays[name].shape != shape:
            self._starts = (), ()
            self.arrays[name] = cuda.device_array(shape, dtype)

    def pull(self) -> None:
        """Copy what moves back to the host, when the device has done all that it was given."""
        for name, host in self._hosts():
            if name in _STATE_ARRAYS:
                self.arrays[name][: len(host)].copy_to_host(_plain(host), stream=self._stream)
        self._stream.synchronize()


def _plain(host: Table) -> Table:
    """The memory of records as bytes, (rows, bytes); other arrays as they are."""
    return host.reshape(len(host), -1).view(np.uint8) if host.dtype.names else host


def _address(array: DeviceArray) -> int:
    """Address of an array on the device, or in numba's simulator."""
    interface = getattr(array, "__cuda_array_interface__", None) or getattr(array, "__array_interface__")  # noqa: B009
    return int(interface["data"][0])
