"""Rows of `vrx_mj.cuda.Batch` in numba's simulator and of `vrx_mj.Batch`, side by side; prints what differs.

In the simulator a kernel is Python, so what a thread does for its row is the function compiled for the CPU. It runs in
a process of its own, since numba decides at its import whether to simulate: `NUMBA_ENABLE_CUDASIM=1`.
"""

import sys
import threading

import numpy as np
from numba import cuda

import vrx_mj
from integration.sailing import boats, water
from vrx_mj.cuda import Batch, kernels
from vrx_mj.errors import CommandError, DivergedError
from vrx_mj.physics.vessel import VesselWork

SEED, ROWS = 5, 3
PARAMETERS = {"vrx": "a.stations.0.length", "marine": "a.hull.vessel.added_mass.roll.pitch"}


def on_host(value):
    """The numpy array behind one of the simulator's."""
    inner = getattr(value, "_item", value)
    return getattr(inner, "_ary", inner)


def run_as_compiled():
    """Let the simulator call the functions of a thread as they are compiled for the CPU."""
    for name in ("command_row", "observe_row"):
        setattr(kernels, name, in_the_simulator(getattr(kernels, name)))
    kernels.advance_free_row = by_itself(kernels.advance_free_row)


def in_the_simulator(function):
    return lambda *arguments: function(*map(on_host, arguments))


def by_itself(function):
    """The function of a thread that here has all lanes, and so copies of what threads of a row share."""

    def advance(runs, run, row, time, done, features, dt, steps, damping, work):
        shared = on_host(time), on_host(done)
        own = [each.copy() for each in shared]
        work = work and VesselWork(*(on_host(part).copy() for part in work))
        threading.current_thread().syncthreads()
        function(on_host(runs), run, row, *own, on_host(features), dt, steps, on_host(damping), work)
        for whole, each in zip(shared, own, strict=True):
            whole[row] = each[row]

    return advance


def compare(world, parameter):
    """Name what differs after fifteen steps, in five launches, of rows that were varied, reset and commanded."""
    batches = vrx_mj.Batch(world, ROWS, seed=SEED, threads=1, engine="free"), Batch(world, ROWS, seed=SEED)
    values = np.linspace(0.2, 0.6, ROWS)[:, None] * np.ones(len(batches[0].channels))
    for batch in batches:
        batch.vary(rows=[1], waves=0.5, wind_speed=7.0, parameters={parameter: 1.1})
        batch.reset([1, 2], seed=9)
        batch.command(values)
        batch.advance(7)
        batch.vary(rows=[2], waves=0.8, thrust=1.2)
        batch.reset([0], seed=4)  # the others go on
        batch.advance(2)
        own = batch.host() if isinstance(batch, Batch) else batch
        own.vary(rows=[0], parameters={parameter: 1.05})  # which is on the device with the reset
        batch.reset([0], seed=3)
        batch.advance(1)
        batch.step(0.5 * values, duration=0.03)
        batch.advance(2, rows=np.array([True, False, True]))
    host, device = batches
    device.check()
    kept = np.from_dlpack(device.qpos)
    features, wind, surface = device.observe()
    assert features.tobytes() == host.features.tobytes()
    assert wind.tobytes() == host.wind.tobytes()
    assert surface.tobytes() == host.sea_height(features[..., 0], features[..., 1]).tobytes()
    for name in ("qpos", "features", "time"):
        assert getattr(device, name).tobytes() == getattr(host, name).tobytes(), name
    assert np.shares_memory(kept, on_host(device._rows.arrays["qpos"]))
    assert len(np.unique(host.features[:, 0, 0])) == ROWS
    for row in range(ROWS):
        assert device.host().get_state(row).sha256 == host.get_state(row).sha256, row


def stop(world):
    """A row beside a buoy stops and is named, and goes on with MuJoCo; one that diverges is named; others go on."""
    batch = Batch(world, ROWS, seed=SEED)
    host = batch.host()
    host.set_boat("a", pose=[99.0, 0.0, 0.0, 0.0, 0.0, 0.0], rows=[1])
    host.set_boat("a", velocity=[9e6, 0.0, 0.0, 0.0, 0.0, 0.0], rows=[2])
    batch.push()
    batch.advance(10)
    assert batch.near().tolist() == [1]
    assert batch.done.tolist() == [10, 0, -1]
    assert batch.diverged.tolist() == [False, False, True]
    messages = []
    for kind in (DivergedError, CommandError):
        try:
            batch.check()
        except kind as error:
            messages.append(str(error))
        batch.reset([2])
        batch.advance(1)
    batch.host().advance(10, rows=[1])
    batch.push()
    assert batch.time[1] > 0.09
    batch.command(cuda.to_device(np.zeros((ROWS, 4), np.float32)))
    for values in (np.zeros((ROWS, 1)), "x"):
        try:
            batch.command(values)
        except CommandError as error:
            messages.append(str(error))
    print("\n".join(messages))


if __name__ == "__main__":
    run_as_compiled()
    fleet = boats((0.0, 0.0, 0.3), engines="fixed")
    buoy = {"model": "mb_round_buoy_black", "name": "b", "pose": [100.0, 0, 0, 0, 0, 0]}
    for profile in sys.argv[1:]:
        world = vrx_mj.compile_world(water(physics={"profile": profile}, objects=[buoy]), fleet=fleet)
        compare(world, PARAMETERS[profile])
    stop(vrx_mj.compile_world(water(objects=[buoy]), fleet=fleet))
