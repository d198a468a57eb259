"""`vrx-mj bench`: the budgets of the design, measured here and now.

Everything is warmed up first; ratios alternate their two sides and take medians.
"""

import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import nullcontext
from itertools import chain
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from rich.console import Console
from rich.table import Table

from vrx_mj.bar import Bar
from vrx_mj.cli.bench_batch import (
    boat_steps_per_second,
    environment_steps_per_second,
    megabytes_per_row,
    two_threads_and_two_processes,
)
from vrx_mj.cli.bench_worlds import DT, SEA, fleet, sailing
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.packages import needs_extra
from vrx_mj.runtime.simulation import Simulation

Row = dict[str, Any]
ROUNDS = 15
ROWS = 15
"""Figures that `measure` takes: for the progress only."""
VERDICTS = {True: "yes", False: "[red]no[/]", None: ""}
NO_MEMORY = "it needs the memory of a process, which only Linux gives"
NO_TIMES = "it needs the processor time of ended processes, which Windows does not give"

BARE_BOAT = """
<body name="boat{i}" pos="{x} {y} 0"><freejoint/>
  <inertial pos="-0.286 0 0.146" mass="258" diaginertia="217 566 683"/>
  <geom type="cylinder" size="0.2 2" pos="-0.4 1.03 0.2" euler="0 1.57 0"/>
  <geom type="cylinder" size="0.2 2" pos="-0.4 -1.03 0.2" euler="0 1.57 0"/>
  <geom type="box" size="0.925 0.5 0.05" pos="0 0 1.25"/>
</body>"""
BARE_WORLD = """
<mujoco><compiler angle="radian"/>
  <option timestep="0.01" gravity="0 0 0" solver="Newton" jacobian="sparse">
    <flag warmstart="disable" autoreset="disable"/>
  </option>
  <worldbody>{boats}</worldbody>
</mujoco>"""


def measure() -> list[Row]:
    """Every row: name, value, unit, budget, whether it is inside, and the figures that the value was made of.

    Where something is missing here, value and verdict are None, and `missing` names it.
    """
    rows: list[Row] = []
    with Bar("measuring", ROWS, "figures") as bar:
        for row in chain(_measured(), batch_rows()):
            rows.append(row)
            bar.update(len(rows), row["name"])
    return rows


def _measured() -> Iterator[Row]:
    yield _row("step_ratio_1", step_ratio(1, 2000), "x bare mj_step", 1.5)
    yield _row("step_ratio_100", step_ratio(100, 100), "x bare mj_step", 2.5)
    yield _row("boats_in_real_time", boats_in_real_time(500), "boats", 3000, at_least=True)
    yield _row("record_overhead", record_overhead(), "of the run", 0.05)
    yield _row("import_s", import_seconds(), "s", 0.1)
    yield _row("help_s", processor_seconds("--help"), "s of processor time", 0.3, missing=NO_TIMES)
    yield _row("list_s", processor_seconds("list", "worlds"), "s of processor time", 0.5, missing=NO_TIMES)
    yield _row("compile_100_s", compile_seconds(100), "s", 3.0)
    yield _row("lidar_scans", lidar_scans(30), "scans/s", 100.0, at_least=True)
    yield _row("rss_3_mb", resident_megabytes(), "MB", 350.0, missing=NO_MEMORY)
    yield _row("rtf_1", real_time_factor(), "x real time", None)


def batch_rows() -> list[Row]:
    """Those about `vrx_mj.Batch`."""
    threads, processes = two_threads_and_two_processes()
    parts = {"boat steps/s, 2 threads": threads, "boat steps/s, 2 processes": processes}
    without = needs_extra("it", "Gymnasium", "rl")
    return [
        _row("batch_boat_steps_per_s", boat_steps_per_second(), "boat steps/s", None),
        _row("batch_scaling_2_threads", threads / processes, "of 2 processes", 0.85, at_least=True, parts=parts),
        _row("vector_env_steps_per_s", environment_steps_per_second(), "env steps/s", None, missing=without),
        _row("batch_mb_per_row", megabytes_per_row(), "MB", None, missing=NO_MEMORY),
    ]


def print_rows(rows: list[Row]) -> None:
    """The rows as a table."""
    table = Table(title="vrx-mj bench")
    for name in ("name", "value", "unit", "budget", "ok"):
        table.add_column(name, justify="left" if name in {"name", "unit"} else "right")
    for row in rows:
        budget = "" if row["budget"] is None else f"{row['limit']} {row['budget']:g}"
        table.add_row(row["name"], _figure(row["value"]), row["unit"], budget, VERDICTS[row["ok"]])
        for part, figure in row["parts"].items():
            table.add_row("", f"{figure:,.0f}", part)
    out = Console()
    out.print(table)
    for row in rows:
        if row["missing"]:
            out.print(f"{row['name']} is not measured: {row['missing']}", highlight=False, markup=False, soft_wrap=True)


def _figure(value: float | None) -> str:
    if value is None:
        return "not measured"
    return f"{value:,.0f}" if value >= 1e4 else f"{value:.4g}"


def _row(
    name: str,
    value: float,
    unit: str,
    budget: float | None,
    *,
    at_least: bool = False,
    parts: Mapping[str, float] | None = None,
    missing: str = "",
) -> Row:
    """A row; a value that is not a number was not measured, and `missing` names it that takes."""
    known = not math.isnan(value)
    inside = value >= (budget or 0.0) if at_least else value <= (budget or 0.0)
    return {
        "name": name,
        "value": value if known else None,
        "unit": unit,
        "budget": budget,
        "limit": "at least" if at_least else "at most",
        "ok": inside if known and budget is not None else None,
        "parts": dict(parts or {}),
        "missing": "" if known else missing,
    }


def bare(count: int) -> Callable[[int], None]:
    """`mj_step` of the same boats as free bodies with three geoms each."""
    boats = "".join(BARE_BOAT.format(i=i, x=12 * (i % 25), y=12 * (i // 25)) for i in range(count))
    model = mujoco.MjModel.from_xml_string(BARE_WORLD.format(boats=boats))
    data = mujoco.MjData(model)

    def step(steps: int) -> None:
        mujoco.mj_step(model, data, nstep=steps)

    return step


def ratio(ours: Callable[[], object], theirs: Callable[[], object]) -> float:
    """Median of ours / theirs, alternating."""
    seconds: dict[Any, list[float]] = {ours: [], theirs: []}
    for number in range(ROUNDS + 2):
        for side in (theirs, ours):
            begun = time.perf_counter()
            side()
            if number >= 2:
                seconds[side].append(time.perf_counter() - begun)
    return statistics.median(a / b for a, b in zip(seconds[ours], seconds[theirs], strict=True))


def step_ratio(count: int, steps: int) -> float:
    """Cost of our step, sea and wind and all, over that of a bare one."""
    sim, step = sailing(count), bare(count)
    return ratio(lambda: sim.advance(steps), lambda: step(steps))


def boats_in_real_time(count: int) -> float:
    """How many boats one core carries at 10 ms, from the cost of `count` of them."""
    sim = sailing(count)
    seconds = []
    for _ in range(ROUNDS):
        begun = time.perf_counter()
        sim.advance(20)
        seconds.append((time.perf_counter() - begun) / 20)
    return count * DT / statistics.median(seconds)


def record_overhead() -> float:
    """Share that recording poses and scalars adds to the README's run under way, start and end of the file apart.

    The sea's surface is left out here: it is a picture, and costs more than all the rest of a recording.
    """
    from vrx_mj.recording import record

    sim = Simulation(compile_world("example_course", fleet="trio"))
    minute = sim.steps_in(60.0)
    with tempfile.TemporaryDirectory() as folder:
        seconds: dict[bool, list[float]] = {False: [], True: []}
        for _ in range(7):
            for recorded, times in seconds.items():
                sim.reset()
                with record(sim, Path(folder) / "run.rrd", sea=False) if recorded else nullcontext():
                    begun = time.perf_counter()
                    sim.advance(minute)
                    times.append(time.perf_counter() - begun)
        return statistics.median(a / b for a, b in zip(seconds[True], seconds[False], strict=True)) - 1.0


def import_seconds() -> float:
    """What `import vrx_mj` takes in a fresh interpreter."""
    code = "import time; t = time.perf_counter(); import vrx_mj; print(time.perf_counter() - t)"
    runs = [subprocess.run([sys.executable, "-c", code], capture_output=True, check=True) for _ in range(5)]
    return statistics.median(float(run.stdout) for run in runs)


def processor_seconds(*words: str) -> float:
    """Processor time of `vrx-mj` with these words, warm: user and system, median of nine [s]."""
    return statistics.median(child_seconds([sys.executable, "-m", "vrx_mj", *words]) for _ in range(9))


def child_seconds(command: list[str]) -> float:
    """Processor time that a command takes [s]; not a number on Windows, which counts none of ended processes."""
    before = os.times()
    subprocess.run(command, capture_output=True, check=True)
    after = os.times()
    if os.name == "nt":
        return math.nan
    return (after.children_user - before.children_user) + (after.children_system - before.children_system)


def compile_seconds(count: int) -> float:
    """From a fleet to a model that MuJoCo has loaded."""
    seconds = []
    for _ in range(3):
        begun = time.perf_counter()
        world = compile_world(SEA, fleet=fleet(count))
        mujoco.MjModel.from_xml_string(world.mjcf, dict(world.assets))
        seconds.append(time.perf_counter() - begun)
    return statistics.median(seconds)


def lidar_scans(buoys: int) -> float:
    """Scans per second of 16 x 1875 rays with another boat in view, and buoys of three kinds, 15 to 100 m away."""
    from vrx_mj.config.sensors import LidarConfig
    from vrx_mj.sensors.lidar import Lidar

    kinds = ("mb_marker_buoy_red", "mb_round_buoy_orange", "polyform_a7")
    places = [(15.0 + 85.0 * i / buoys, 2.4 * i) for i in range(buoys)]  # a spiral: none hides another
    objects = [
        {"name": f"buoy{i}", "model": kinds[i % 3], "pose": [r * math.cos(a), r * math.sin(a), 0, 0, 0, 0]}
        for i, (r, a) in enumerate(places)
    ]
    sim = Simulation(compile_world({"objects": objects}, fleet=fleet(2)))
    model = sim.visual_model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    body = model.body(f"{sim.boats[0]}/base_link").id
    lidar = Lidar(model, LidarConfig(name="lidar", link="lidar_link"), body, (0.7, 0.0, 1.8), np.eye(3))
    seconds = []
    for number in range(100 + 2):
        begun = time.perf_counter()
        lidar.scan(data, key=1, index=number)
        seconds.append(time.perf_counter() - begun)
    return 1.0 / statistics.median(seconds[2:])


MEMORY_CODE = """
import vrx_mj
from vrx_mj.cli.bench_worlds import resident_memory
sim = vrx_mj.Simulation(vrx_mj.compile_world("example_course", fleet="trio"))
sim.step(duration=1.0)
print(resident_memory() / 1e6)
"""


def resident_megabytes() -> float:
    """Memory of a process that sails three boats, without cameras; not known but on Linux."""
    done = subprocess.run([sys.executable, "-c", MEMORY_CODE], capture_output=True, check=True)
    return float(done.stdout)


def real_time_factor() -> float:
    """Simulated over wall time of one boat on the example course."""
    sim = Simulation(compile_world("example_course"))
    begun = time.perf_counter()
    sim.step({"wamv": {"left": 0.5, "right": 0.4}}, duration=60.0)
    return 60.0 / (time.perf_counter() - begun)
