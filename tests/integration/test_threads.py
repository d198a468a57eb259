"""Threads that share a run get errors, not a segmentation fault, and the run is what it was."""

import subprocess
import sys

import pytest

from vrx_command import environment

pytestmark = pytest.mark.slow

START = """
import collections, gc, os, signal, sys, threading, time
import numpy
import vrx_mj
from vrx_mj.errors import CommandError

world = vrx_mj.compile_world("ocean", fleet="trio")
seen = collections.Counter()

def hammer(calls, seconds=2.0, threads=8):
    until = time.monotonic() + seconds
    def work(number):
        while time.monotonic() < until:
            number += 1
            try:
                calls[number % len(calls)]()
                seen["done"] += 1
            except Exception as error:
                seen[f"{type(error).__name__}: {' '.join(str(error).split()[1:])}"] += 1
    workers = [threading.Thread(target=work, args=(number,)) for number in range(threads)]
    for worker in workers: worker.start()
    for worker in workers: worker.join()

def refused(what):
    return (
        f"CommandError: cannot be called while another thread advances the {what}: call it afterwards, or from that "
        "thread"
    )
"""
SIMULATION = """
sim = vrx_mj.Simulation(world)
state = sim.get_state()
boat = sim.boats[0]
numbers = iter(range(10**6))
def come_and_go():
    number = next(numbers)
    sim.spawn(f"guest{number}", pose=[500.0 + 20.0 * number, 500.0, 0.1, 0, 0, 0])
    while True:
        try:
            return sim.remove(f"guest{number}")
        except CommandError:
            seen["waited"] += 1
hammer([
    lambda: sim.advance(50), lambda: sim.step({boat: {"left": 0.5}}, duration=0.1), lambda: sim.reset(3), sim.get_state,
    sim.observe, lambda: sim.set_boat(boat, velocity=(1, 0, 0, 0, 0, 0)), lambda: sim.forces(boat),
    lambda: sim.command(boat, left=0.4), lambda: sim.wind.velocity(sim.time), lambda: sim.thrust(boat),
    lambda: sim.sense(boat)["imu_wamv"],
])
hammer([
    come_and_go, sim.observe, lambda: sim.advance(200), lambda: sim.command(boat, left=0.4), lambda: sim.thrust(boat),
])
assert set(seen) <= {"done", "waited", refused("simulation")}, seen
fresh = vrx_mj.Simulation(world)
for run in (sim, fresh):
    run.reset(7)
    run.step({boat: {"left": 0.5}}, duration=3.0)
assert sim.get_state().sha256 == fresh.get_state().sha256
"""
BATCH = """
batch, fresh = (vrx_mj.Batch(world, 16, seed=1, threads=2) for _ in range(2))
values = numpy.full((16, len(batch.channels)), 0.3)
hammer([
    lambda: batch.advance(100), lambda: batch.step(values, duration=0.1), lambda: batch.reset([1, 2], seed=3),
    lambda: batch.command(values), lambda: batch.get_state(4), lambda: batch.vary(wind_speed=3.0),
    lambda: batch.set_boat(batch.boats[0], velocity=(1, 0, 0, 0, 0, 0)), lambda: batch.vary(waves=1.0),
])
assert set(seen) <= {"done", refused("batch")}, seen
for rows in (batch, fresh):
    rows.vary(wind_speed=3.0, waves=1.0)
    rows.reset(seed=7)
    rows.step(values, duration=1.0)
assert [batch.get_state(row).sha256 for row in range(16)] == [fresh.get_state(row).sha256 for row in range(16)]
"""
FORGOTTEN = """
sim = vrx_mj.Simulation(world)
worker = threading.Thread(target=sim.advance, args=(5000,))
worker.start()
del sim
gc.collect()
worker.join()
"""
LEFT_RUNNING = """
import atexit
runs = vrx_mj.Simulation(world), vrx_mj.Batch(world, 16, threads=2)
left = [threading.Thread(target=run.advance, args=(10**8,), daemon=True) for run in runs]
for thread in left: thread.start()
time.sleep(0.3)
assert [thread.is_alive() for thread in left] == [True, True]
atexit._run_exitfuncs()  # as the interpreter does, before it frees what the threads use
for thread in left: thread.join(timeout=5.0)
assert [thread.is_alive() for thread in left] == [False, False]
assert [run._turn.claim for run in runs] == [{}, {}]
runs[0].advance(10)  # the thread that exits may go on, as another function at exit may
runs[1].advance(10)
"""
LEFT_TO_EXIT = """
for run in (vrx_mj.Simulation(world), vrx_mj.Batch(world, 16, threads=2)):
    threading.Thread(target=run.advance, args=(10**8,), daemon=True).start()
def observe(sim=vrx_mj.Simulation(world)):
    while True:
        sim.get_state()
threading.Thread(target=observe, daemon=True).start()
time.sleep(0.3)
"""
MAKING = """
import atexit, copy
from vrx_mj import signals as exits
world.save("saved")
makers = [
    lambda: vrx_mj.compile_world("ocean"), lambda: vrx_mj.Simulation(world), lambda: vrx_mj.Batch(world, 2, threads=1),
    lambda: vrx_mj.World.load("saved"), lambda: copy.copy(sim),
]
sim = vrx_mj.Simulation(world)
ended = []
def make(maker):
    try:
        while True:
            maker()
    except SystemExit:
        ended.append(maker)
threads = [threading.Thread(target=make, args=(maker,), daemon=True) for maker in makers]
for thread in threads: thread.start()
time.sleep(0.3)
atexit._run_exitfuncs()
assert exits._inside == set()
for thread in threads: thread.join(timeout=60.0)
assert sorted(map(id, ended)) == sorted(map(id, makers))
vrx_mj.Simulation(vrx_mj.compile_world("ocean")).advance(1)  # another function at exit may
"""
MADE_AT_EXIT = """
def make():
    while True:
        vrx_mj.Simulation(vrx_mj.compile_world("ocean"))
for _ in range(3): threading.Thread(target=make, daemon=True).start()
time.sleep(0.5)
"""
FORKED = """
sim, batch = vrx_mj.Simulation(world), vrx_mj.Batch(world, 32, threads=2)
batch.advance(10)
worker = threading.Thread(target=sim.advance, args=(10**5,), daemon=True)
worker.start()
while not sim._turn.claim: time.sleep(0.001)
child = os.fork()
if not child:
    try:
        sim.advance(1)
    except CommandError:
        batch.advance(10)
        vrx_mj.Simulation(world).advance(10)
        os._exit(0)
    os._exit(1)
assert os.waitpid(child, 0) == (child, 0)
"""
INTERRUPTED = """
sim = vrx_mj.Simulation(world)
def interrupt(*_):
    raise KeyboardInterrupt
signal.signal(signal.SIGALRM, interrupt)
for number in range(500):
    try:
        signal.setitimer(signal.ITIMER_REAL, 1e-5 + number % 97 * 3e-6)
        while True:
            sim.advance(1)
    except KeyboardInterrupt:
        assert sim._turn.claim == {}, number
hammer([lambda: sim.set_boat(sim.boats[0], velocity=(0,) * 6)], seconds=0.1)  # nobody holds the lock
assert set(seen) == {"done"}
"""


@pytest.mark.parametrize(
    "program", [SIMULATION, BATCH, FORGOTTEN, LEFT_RUNNING, LEFT_TO_EXIT, MAKING, MADE_AT_EXIT, FORKED, INTERRUPTED],
    ids=["simulation", "batch", "forgotten", "left_running", "left_to_exit", "making", "made_at_exit", "forked",
         "interrupted"],
)  # fmt: skip
def test_threads_on_one_run(program, tmp_path):
    if sys.platform == "win32" and program in {FORKED, INTERRUPTED}:
        pytest.skip("no fork and no alarms")
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", START + program + "\nprint('end', flush=True)"],
        env=environment(), capture_output=True, encoding="utf-8", check=False, timeout=300,
        cwd=tmp_path,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, "end\n"), done.stderr
