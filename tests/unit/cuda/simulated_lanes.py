"""Rows of profile `marine` whose lanes are threads, as on a processor, as far apart as may be; prints what differs.

Everything that a thread does runs here as Python, on the memory of `vrx_mj.cuda.Batch` in numba's simulator. One thread
runs at a time, until it waits for the others of its row; then the next one does, in an order that is given, or at
random, and then threads also stop between any two accesses to what they share. So whatever a thread reads too early or
too late, or changes for the others, is another number.
"""

import ctypes
import functools
import math
import sys
import threading
from types import SimpleNamespace

import numpy as np
from numba import cuda
from numba.core.extending import _Intrinsic

import vrx_mj
from integration.sailing import boats, water
from unit.cuda.simulated_rows import in_the_simulator, on_host
from vrx_mj.cuda import Batch, kernels
from vrx_mj.physics.kernel import Kernel
from vrx_mj.physics.lanes import WIDTH
from vrx_mj.runtime.views import ARRAYS, Views

ROWS, STEPS, SEED = 2, 2, 5
ORDERS = "up", "down", "mixed"


class Team:
    """The threads of a row."""

    def __init__(self, order):
        self._order, self._random = order, np.random.default_rng(1)
        self._turns, self._given, self._met = [threading.Semaphore(0) for _ in range(WIDTH)], [None] * WIDTH, ()
        self._left, self.waits, self._errors = [], 0, []

    def run(self, work):
        """Have all threads call a function of their numbers."""
        threads = [threading.Thread(target=self._work, args=(work, lane)) for lane in range(WIDTH)]
        for thread in threads:
            thread.start()
        self._left = self._new_order()
        self._next()
        for thread in threads:
            thread.join()
        if self._errors:
            raise self._errors[0]

    def _new_order(self):
        lanes = list(range(WIDTH))
        if self._order == "mixed":
            return self._random.permutation(WIDTH).tolist()
        return lanes if self._order == "down" else lanes[::-1]  # they are taken from the end

    def _next(self):
        self._turns[self._left.pop()].release()

    def _work(self, work, lane):
        NOW.team, NOW.lane = self, lane
        self._turns[lane].acquire()
        try:
            work(lane)
            self.meet("end")
        except BaseException as error:  # the others go on, and end likewise
            self._errors.append(error)
            for turn in self._turns:
                turn.release()

    def meet(self, place, value=None):
        """Wait for all, who must be at the same place; returns what each has given."""
        lane = NOW.lane
        if self._errors:
            raise RuntimeError("another thread has failed")
        self._given[lane] = place, value
        if self._left:
            self._next()
        else:
            places, self._met = zip(*self._given, strict=True)
            assert len(set(places)) == 1, f"threads are at {places}"
            self._left, self.waits = self._new_order(), self.waits + 1
            self._next()
        self._turns[lane].acquire()
        if place == "end" and self._left:
            self._next()
        return self._met

    def pause(self):
        """Perhaps let another thread run that does not wait."""
        if self._order == "mixed" and self._left and self._random.random() < 0.1:
            other = self._left.pop(self._random.integers(len(self._left)))
            self._left.append(NOW.lane)
            self._turns[other].release()
            self._turns[NOW.lane].acquire()


NOW = threading.local()


class Shared(np.ndarray):
    """Memory of all threads of a row."""

    def __getitem__(self, index):
        NOW.team.pause()
        return super().__getitem__(index)

    def __setitem__(self, index, value):
        NOW.team.pause()
        super().__setitem__(index, value)


class Row:
    """A row of a table, by names."""

    def __init__(self, own):
        object.__setattr__(self, "own", own)

    def __getattr__(self, name):
        return self.own[name]

    def __setattr__(self, name, value):
        self.own[name] = value


class Rows:
    """A table of rows by names."""

    def __init__(self, own):
        self.own, self.size, self.ndim, self.shape = own, own.size, own.ndim, own.shape

    def __len__(self):
        return len(self.own)

    def __getitem__(self, index):
        found = self.own[index]
        return Row(found) if isinstance(found, np.void) else Rows(found)


def views_of(run, *, own_waves=True):
    found = []
    for name, array in ARRAYS.items():
        address, *shape = run.own[name].tolist()
        size = math.prod(shape) * array.dtype.itemsize
        memory = (ctypes.c_char * size).from_address(address) if size else b""
        table = np.frombuffer(memory, array.dtype).reshape(shape)
        found.append(Rows(table) if array.dtype.names else table)
    return Views(*found)._replace(**{} if own_waves else {"own_waves": None})


def store(array, index, value):
    NOW.team.meet("before")
    array[index + NOW.lane] = value
    NOW.team.meet("after")


def folded(values):
    while len(values) > 1:
        half = len(values) // 2
        values = [one + other for one, other in zip(values[:half], values[half:], strict=True)]
    return values[0]


def totals(*values):
    return folded([own[NOW.lane] for own in NOW.team.meet("totals", values)])


def by_quarters(shifted, even, odd):
    turns = int(np.float64(shifted).view(np.int64))
    return (odd if turns & 1 else even) * (-1.0 if turns & 2 else 1.0)


AS_THREADS = {
    "views": functools.partial(views_of, own_waves=False), "row_views": views_of,
    "load": lambda array, index: array.reshape(-1)[index + NOW.lane], "store": store,
    "sync_lanes": lambda: NOW.team.meet("sync"),
    "broadcast": float, "total": lambda value: folded(NOW.team.meet("total", value)), "totals": totals,
    "any_positive": lambda value: any(each > 0.0 for each in NOW.team.meet("any", value)),
    "product_and": lambda one, other, more: one * other + more, "by_quarters": by_quarters,
    "larger": lambda one, other: one if one > other else other,
    "smaller": lambda one, other: one if one < other else other,
    "choose": lambda sign, one, other: one if sign > 0.0 else other,
    "power_of_two": lambda shifted: math.ldexp(1.0, int(shifted - 1.5 * 2.0**52)),
}  # fmt: skip


def advance(batch, order):
    """What `Batch.advance` does."""
    rows, whole = batch._rows, SimpleNamespace(**{name: on_host(each) for name, each in batch._rows.arrays.items()})
    rows.share()
    damping, *shared = map(on_host, rows.work)
    work, waits = [each.view(Shared) for each in shared], 0
    kernels.cuda = SimpleNamespace(grid=lambda _: NOW.index)
    for row in range(batch.n):
        team = Team(order)

        def thread(lane, row=row):
            NOW.index = row * WIDTH + lane
            own = Rows(whole.runs), whole.time, whole.going, whole.done, whole.features, batch.timestep, STEPS
            kernels.advance_marine(*own, damping, *work)

        team.run(thread)
        waits += team.waits
    kernels.cuda = cuda
    return waits


def main():
    places = [(0.0, 0.0, 0.3), (30.0, 0.0, 1.0)]
    buoy = {"model": "mb_round_buoy_black", "name": "buoy", "pose": [100.0, 0, 0, 0, 0, 0]}
    current = {"speed": 0.3, "var_gain": 0.05}
    world = vrx_mj.compile_world(
        water(physics={"profile": "marine"}, objects=[buoy], current=current), fleet=boats(*places, engines="fixed")
    )
    kernels.command_row = in_the_simulator(kernels.command_row)
    host = vrx_mj.Batch(world, ROWS, seed=SEED, threads=1, engine="free")
    batches = {order: Batch(world, ROWS, seed=SEED) for order in ORDERS}
    for batch in (host, *batches.values()):
        batch.command(np.linspace(0.2, 0.6, ROWS)[:, None] * np.ones(len(batch.channels)))
    for _ in range(2):
        host.advance(STEPS)
    plain_call, plain_intrinsic = Kernel.__call__, _Intrinsic.__call__
    Kernel.__call__ = lambda self, *given, **named: self.py_func(*given, **named)
    _Intrinsic.__call__ = lambda self, *given: AS_THREADS[self._name](*given)
    waits = {order: [advance(batch, order) for _ in range(2)] for order, batch in batches.items()}
    Kernel.__call__, _Intrinsic.__call__ = plain_call, plain_intrinsic
    for order, batch in batches.items():
        error = max(np.abs(getattr(batch, name) - getattr(host, name)).max() for name in ("qpos", "features", "time"))
        print(f"{order}: {error:.0e} from the CPU's, {waits[order]} waits")
        assert error < 1e-12, (order, error)
        assert batch._rows.threads_agree(), order
        assert batch.qpos.tobytes() == batches["up"].qpos.tobytes(), order


if __name__ == "__main__":
    sys.setswitchinterval(1e-4)
    np.seterr(all="ignore")
    main()
