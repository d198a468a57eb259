"""`vrx-mj bench`: the budgets of the design, measured here and now.

Everything is warmed up first; ratios alternate their two sides and take medians.

`vrx-mj bench --recordings` measures the cost of recordings: it runs the commands themselves, each in a fresh process.
What a recording costs alone is measured inside one process, in which runs with and without it alternate.

The order of the variants reverses from round to round. Beside each figure is its A/A row, the difference between the
figures of even and of odd rounds. Where that is wider than the margin to the budget there is no verdict.
"""

import importlib.util
import itertools
import math
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, suppress
from functools import cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import mujoco
import numpy as np
import numpy.typing as npt
import psutil
from typer import echo

from vrx_mj.autopilot import ArduPilot
from vrx_mj.autopilot.ardupilot import FORMATS
from vrx_mj.bar import Bar
from vrx_mj.cli.bench_campaign import campaign_times
from vrx_mj.cli.screen import print_table
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.packages import needs_extra
from vrx_mj.runtime.batch import Batch, Engine
from vrx_mj.runtime.limits import process_memory
from vrx_mj.runtime.simulation import Simulation

if TYPE_CHECKING:
    from vrx_mj.rl import VectorEnv


DT = 0.01
"""Physics step of all of them [s]."""
SEA: dict[str, Any] = {
    "physics": {"profile": "vrx"},
    "sea": {"scale": 2.5},
    "wind": {
        "mean_velocity": 5.0,
        "var_gain": 1.0,
        "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}],
    },
}
"""Open water with the sea of VRX's Sydney worlds and a gusty wind."""
_OCEAN = {**SEA, "sea": {"model": "jonswap", "sea_state": 2, "spreading": 10}}
"""Open water with a sea of 60 waves."""
_MARINE = {**_OCEAN, "physics": {"profile": "marine"}, "current": {"speed": 0.3, "var_gain": 0.05}}
"""Open water in profile `marine`, with a sea of 60 waves and a current."""
_CALM = {"physics": {"profile": "vrx"}, "sea": {"model": "none"}}
_TASK = {"type": "stationkeeping", "goal_cart": [8, 0, 0]}
_FREE_BARS = ("vrx", 64, 2.0), ("vrx", 1024, 2.0), ("60_waves", 64, 1.3), ("60_waves", 1024, 1.5)
_SEAS = {"vrx": SEA, "60_waves": _OCEAN}
_ROUNDS = 15
_FIGURE_COUNT = 29
"""Number of figures that `measure` takes, for the progress bar."""
_VERDICTS = {True: "yes", False: "no", None: ""}
_BARE_BOAT = """
<body name="boat{i}" pos="{x} {y} 0"><freejoint/>
  <inertial pos="-0.286 0 0.146" mass="258" diaginertia="217 566 683"/>
  <geom type="cylinder" size="0.2 2" pos="-0.4 1.03 0.2" euler="0 1.57 0"/>
  <geom type="cylinder" size="0.2 2" pos="-0.4 -1.03 0.2" euler="0 1.57 0"/>
  <geom type="box" size="0.925 0.5 0.05" pos="0 0 1.25"/>
</body>"""
_BARE_WORLD = """
<mujoco><compiler angle="radian"/>
  <option timestep="0.01" gravity="0 0 0" solver="Newton" jacobian="sparse">
    <flag warmstart="disable" autoreset="disable"/>
  </option>
  <worldbody>{boats}</worldbody>
</mujoco>"""
BATCH_ROWS = 512
_STEPS = 10
"""Physics steps of a call: one decision at 10 Hz."""
_SCALING_BARS = ("2_threads", 0.85, BATCH_ROWS, _STEPS), ("4_rows", 0.9, 4, 2000)
"""Figures of two threads: name, bound, rows, and physics steps of a call."""
WINDOW, BATCH_ROUNDS = 0.5, 7
"""How long one side of batches is timed [s], and how often; of what is timed the median counts."""
_THROTTLE = 0.1
_RECORDING_ROUNDS = 4
"""Number of rounds with a recording, an even one."""
_THRUST = ("--seed", "7", "--thrust", "left=0.6,right=0.4")
_README = ("run", "example_course", "--fleet", "trio", *_THRUST)
_HUNDRED = ("run", "ocean", "--fleet", "hundred.yaml", *_THRUST)
_RUNS = {"minute": (*_README, "--duration", "60"), "hundred": (*_HUNDRED, "--duration", "60")}
SIDES = {
    **_RUNS,
    **{f"{name}.rrd": (*words, "--record", f"{name}.rrd") for name, words in _RUNS.items()},
    "ten.rrd": (*_README, "--duration", "600", "--record", "ten.rrd"),
    "film": ("replay", "minute.rrd", "--video", "film.mp4"),
}
"""Commands by name, in an order in which each has the files that it needs; `.rrd` is the same run recorded."""
RECORDINGS = {"start": (1, 4), "ten": (600, 1)}
"""Recordings whose own cost is taken: simulated seconds, and how many in each round."""
_START = (*_HUNDRED, "--duration", "0.1", "--record", "hundred_start.rrd")
PARTS = {
    "/record/rows": "exact rows",
    "/record/states": "states",
    "/plots": "plots",
    "/world/trails": "trails",
    "/world/sea": "sea",
    "/world/wakes": "wakes",
    "/world/boats": "shown poses",
}


def fleet(count: int) -> Mapping[str, object]:
    """Boats with two fixed engines each, 12 m apart in rows of 25."""
    places = [{"x": 12.0 * (i % 25), "y": 12.0 * (i // 25)} for i in range(count)]
    return {"usv_count": count, "thrusters": "H", "positions": places}


def sailing(count: int, world: Mapping[str, object] = SEA) -> Simulation:
    """Boats under way in the sea, warmed up."""
    sim = Simulation(compile_world(world, fleet=fleet(count)))
    sim.step({boat: {"left": 0.1, "right": 0.1} for boat in sim.boats}, duration=2.0)
    return sim


Row = dict[str, Any]


def measure() -> list[Row]:
    """Every row: name, value, unit, budget, whether it is inside, and the figures that the value was made of.

    Where something is missing here, value and verdict are None, and `missing` names it.
    """
    rows: list[Row] = []
    with Bar("measuring", _FIGURE_COUNT, "figures") as bar:
        for found in itertools.chain(_core_rows(), batch_rows()):
            rows.append(found)
            bar.update(len(rows), found["name"])
    return rows


def _core_rows() -> Iterator[Row]:
    yield bench_row("step_ratio_1", step_ratio(1, 2000), "x bare mj_step", 1.5)
    yield bench_row("step_ratio_100", step_ratio(100, 100), "x bare mj_step", 2.5)
    yield bench_row("sea_60_ratio", step_ratio(1, 2000, _OCEAN), "x bare mj_step", 4.0)
    yield bench_row("marine_step_ratio_1", step_ratio(1, 2000, _MARINE), "x bare mj_step", 8.0)
    yield bench_row("marine_step_ratio_100", step_ratio(100, 100, _MARINE), "x bare mj_step", 8.0)
    yield bench_row("boats_in_real_time", boats_in_real_time(500), "boats", 3000, at_least=True)
    yield bench_row("import_s", import_seconds(), "s", 0.1)
    yield bench_row("help_s", processor_seconds("--help"), "s of processor time", 0.3)
    yield bench_row("list_s", processor_seconds("list", "worlds"), "s of processor time", 0.5)
    yield bench_row("compile_100_s", compile_seconds(100), "s", 3.0)
    yield bench_row("lidar_scans", lidar_scans(30), "scans/s", 100.0, at_least=True)
    yield bench_row("rtf_1", real_time_factor(), "x real time", None)
    yield bench_row("ardupilot_rtf", ardupilot_factor(2000), "x real time", 5.0, at_least=True)
    task = {**_OCEAN, "task": _TASK}
    for name, worlds in (("calm", [_CALM]), ("sea", [SEA]), ("task", [task]), ("mix", [_CALM, task])):
        simulated, taken = map(sum, zip(*(campaign_times(world, len(worlds)) for world in worlds), strict=True))
        yield bench_row(f"campaign_share_{name}", simulated / taken, "of processor time", 0.85, at_least=True)


def batch_rows() -> list[Row]:
    """Rows about `vrx_mj.Batch`."""
    scaling = [
        bench_row(f"batch_scaling_{name}", threads / processes, "of 2 processes", least, at_least=True,
                  parts={"boat steps/s, 2 threads": threads, "boat steps/s, 2 processes": processes})
        for name, least, rows, steps in _SCALING_BARS
        for threads, processes in [two_threads_and_two_processes(rows, steps)]
    ]  # fmt: skip
    without = needs_extra("it", "Gymnasium", "rl")
    one, every = free_rates()
    return [
        bench_row("batch_boat_steps_per_s", boat_steps_per_second(), "boat steps/s", None),
        *scaling,
        bench_row("vector_env_steps_per_s", environment_steps_per_second(), "env steps/s", None, missing=without),
        bench_row("batch_mb_per_row", megabytes_per_row(), "MB", None),
        bench_row("free_boat_steps_per_s", every, "boat steps/s", None, parts={"boat steps/s, 1 thread": one}),
        *(
            bench_row(f"free_ratio_{rows}_{sea}", engine_ratio(rows, sea), "x engine mujoco", least, at_least=True)
            for sea, rows, least in _FREE_BARS
        ),
        bench_row("free_row_of_4096", row_cost(4096, 64), "x a row of 64", 1.15),
        bench_row("free_kb_per_row", 1e3 * megabytes_per_row(100_000, "free"), "kB", 2.5),
    ]


def print_rows(rows: list[Row]) -> None:
    """Print the rows as a table."""
    from rich.text import Text

    texts: list[tuple[str | Text, ...]] = []
    for row in rows:
        budget = "" if row["budget"] is None else f"{row['limit']} {row['budget']:g}"
        verdict = Text(_VERDICTS[row["ok"]], style="red" if row["ok"] is False else "")
        texts.append((row["name"], row["unit"], _figure(row["value"]), budget, verdict))
        texts += [("", part, _figure(figure), "", "") for part, figure in row["parts"].items()]
    print_table("vrx-mj bench", ("name", "unit"), ("value", "budget", "ok"), texts)
    for row in rows:
        if row["missing"]:
            echo(f"{row['name']} is not measured: {row['missing']}")


def _figure(value: float | None) -> str:
    if value is None:
        return "not measured"
    return f"{value:,.0f}" if value >= 1e4 else f"{value:.4g}"


def bench_row(
    name: str,
    value: float,
    unit: str,
    budget: float | None,
    *,
    at_least: bool = False,
    parts: Mapping[str, float] | None = None,
    missing: str = "",
) -> Row:
    """A row. A value of NaN was not measured; `missing` says what that needs."""
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
    boats = "".join(_BARE_BOAT.format(i=i, x=12 * (i % 25), y=12 * (i // 25)) for i in range(count))
    model = mujoco.MjModel.from_xml_string(_BARE_WORLD.format(boats=boats))
    return partial(mujoco.mj_step, model, mujoco.MjData(model))


def median_seconds(call: Callable[[], object], rounds: int, warm_up: int = 0) -> float:
    """Median wall time of a call [s], after some that do not count."""
    seconds = []
    for _ in range(warm_up + rounds):
        begun = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - begun)
    return statistics.median(seconds[warm_up:])


def ratio(ours: Callable[[], object], theirs: Callable[[], object]) -> float:
    """Median of ours / theirs, alternating."""
    pairs = [[median_seconds(side, 1) for side in (theirs, ours)] for _ in range(_ROUNDS + 2)]
    return statistics.median(own / other for other, own in pairs[2:])


def step_ratio(count: int, steps: int, world: Mapping[str, object] = SEA) -> float:
    """Cost of our step, sea and wind and all, over that of a bare one."""
    return ratio(partial(sailing(count, world).advance, steps), partial(bare(count), steps))


def boats_in_real_time(count: int) -> float:
    """How many boats one core carries at 10 ms, from the cost of `count` of them."""
    return count * DT * 20 / median_seconds(partial(sailing(count).advance, 20), _ROUNDS)


def import_seconds() -> float:
    """Time of `import vrx_mj` in a fresh interpreter [s]."""
    code = "import time; t = time.perf_counter(); import vrx_mj; print(time.perf_counter() - t)"
    runs = [subprocess.run([sys.executable, "-c", code], capture_output=True, check=True) for _ in range(5)]
    return statistics.median(float(run.stdout) for run in runs)


def processor_seconds(*words: str) -> float:
    """Processor time of `vrx-mj` with these words, warm: user and system, median of nine [s]."""
    return statistics.median(child_cost(_vrx_mj(words))[0] for _ in range(9))


def child_cost(command: list[str], folder: str | None = None) -> tuple[float, float]:
    """Processor time [s] of a command and its children, and its largest memory [MB], as seen every millisecond.

    Windows counts nothing of ended processes.
    """
    memory = 0
    with psutil.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder) as child:
        while child.poll() is None:
            with suppress(psutil.NoSuchProcess):
                spent, memory = child.cpu_times(), max(memory, child.memory_info().rss)
            time.sleep(0.001)
    subprocess.CompletedProcess(command, child.returncode).check_returncode()
    return float(sum(spent[:4])), memory / 1e6


def compile_seconds(count: int) -> float:
    """Time from a fleet to a model that MuJoCo has loaded."""

    def load() -> None:
        world = compile_world(SEA, fleet=fleet(count))
        mujoco.MjModel.from_xml_string(world.mjcf, dict(world.assets))

    return median_seconds(load, 3)


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
    sim = Simulation(compile_world({"physics": {"profile": "vrx"}, "objects": objects}, fleet=fleet(2)))
    model = sim.visual_model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    body = model.body(f"{sim.boats[0]}/base_link").id
    lidar = Lidar(model, LidarConfig(name="lidar", link="lidar_link"), body, (0.7, 0.0, 1.8), np.eye(3))
    indices = itertools.count()
    return 1.0 / median_seconds(lambda: lidar.scan(data, key=1, index=next(indices)), 100, warm_up=2)


def real_time_factor() -> float:
    """Simulated over wall time of one boat on the example course."""
    sim = Simulation(compile_world("example_course"))
    return 60.0 / median_seconds(lambda: sim.step({"wamv": {"left": 0.5, "right": 0.4}}, duration=60.0), 1)


def ardupilot_factor(frames: int) -> float:
    """Simulated over wall time of a BlueBoat in waves that a stand-in of ArduPilot asks for 100 frames a second."""
    boat = {"name": "a", "robot": "blueboat", "pose": [0, 0, 0, 0, 0, 0]}
    sim = Simulation(compile_world(_MARINE, fleet={"boats": [boat]}))
    with ArduPilot(sim, {"a": 0}) as autopilots, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sitl:
        begun = 0.0
        for number in range(100 + frames):
            if number == 100:
                begun = time.perf_counter()
            sitl.sendto(FORMATS[18458].pack(18458, 100, number, *(1700,) * 16), autopilots.addresses["a"])
            autopilots.step()
            sitl.recv(4096)
    return frames * DT / (time.perf_counter() - begun)


def fresh_process() -> ProcessPoolExecutor:
    """A process of its own, which loads all code itself."""
    return ProcessPoolExecutor(1, get_context("spawn"))


@cache
def batch_of(rows: int, threads: int | None = None, engine: Engine = "mujoco", sea: str = "vrx") -> Batch:
    """Rows under way, warmed up, which this process keeps; `threads` and `engine` as `Batch` takes them."""
    batch = Batch(compile_world(_SEAS[sea], fleet=fleet(1)), rows, threads=threads, engine=engine)
    batch.step([[_THROTTLE] * len(batch.channels)] * rows, duration=2.0)
    return batch


def boat_steps_per_second() -> float:
    """Physics steps of boats per second, all cores together."""
    return statistics.median(each for (each,) in rates(batch_of(BATCH_ROWS)))


def two_threads_and_two_processes(rows: int, steps: int) -> tuple[float, float]:
    """Boat steps per second of a batch with two threads, and those of two processes at once with half the rows each.

    They alternate, so that what else the machine does hits both.
    """
    ours, theirs = [], []
    with ExitStack() as stack:
        workers = [stack.enter_context(fresh_process()) for _ in range(2)]
        for _ in range(BATCH_ROUNDS + 1):  # the first makes the rows
            ours.append(rate(batch_of(rows, threads=2), WINDOW, steps))
            pair = [worker.submit(rate_on_one_thread, rows // 2, WINDOW, steps) for worker in workers]
            theirs.append(sum(one.result() for one in pair))
    return statistics.median(ours[1:]), statistics.median(theirs[1:])


def rate_on_one_thread(rows: int, window: float, steps: int) -> float:
    """Boat steps per second of rows of this process in a window [s]."""
    return rate(batch_of(rows, threads=1), window, steps)


def engine_ratio(rows: int, sea: str) -> float:
    """Boat steps of the engine `free` over those of `mujoco` on one thread, by turns."""
    pairs = rates(*(batch_of(rows, 1, engine, sea) for engine in get_args(Engine)))
    return statistics.median(free / ours for ours, free in pairs)


def free_rates() -> tuple[float, float]:
    """Boat steps per second of 1,024 rows of the engine `free`, on one thread and on all cores."""
    one, every = zip(*rates(*(batch_of(1024, threads, "free") for threads in (1, None))), strict=True)
    return statistics.median(one), statistics.median(every)


def row_cost(many: int, few: int) -> float:
    """Cost of a row of the engine `free` among `many` over its cost among `few`, on one thread, measured by turns."""
    pairs = rates(*(batch_of(rows, 1, "free") for rows in (many, few)))
    return statistics.median(among_few / among_many for among_many, among_few in pairs)


def rates(*batches: Batch) -> list[list[float]]:
    """Boat steps per second of batches that take turns, in each of `BATCH_ROUNDS` windows."""
    return [[rate(batch, WINDOW) for batch in batches] for _ in range(BATCH_ROUNDS)]


def per_second(call: Callable[[], object], window: float) -> float:
    """How often something is called per second, one call after another, in a window [s]."""
    calls, begun = 0, time.perf_counter()
    while time.perf_counter() - begun < window:
        call()
        calls += 1
    return calls / (time.perf_counter() - begun)


def rate(batch: Batch, window: float, steps: int = _STEPS) -> float:
    """Boat steps per second in a window [s], so many steps a call."""
    return per_second(lambda: batch.advance(steps), window) * steps * batch.n * len(batch.boats)


def environment_steps_per_second() -> float:
    """Decisions per second of Gymnasium's `VectorEnv`, each of 10 physics steps.

    Not a number where the extra `rl` is not installed.
    """
    if importlib.util.find_spec("gymnasium") is None:
        return math.nan
    from vrx_mj.rl import VectorEnv

    rows = VectorEnv("StationKeeping", BATCH_ROWS)
    rows.reset(seed=0)
    actions = np.full_like(rows.action_space.sample(), _THROTTLE)
    return statistics.median(decisions(rows, actions, WINDOW) for _ in range(BATCH_ROUNDS))


def decisions(rows: "VectorEnv", actions: npt.NDArray[np.float32], window: float) -> float:
    """Decisions per second of a `VectorEnv` in a window [s]."""
    return per_second(lambda: rows.step(actions), window) * int(rows.num_envs)


def megabytes_per_row(rows: int = 1000, engine: Engine = "mujoco") -> float:
    """Memory that each of so many rows takes [MB], in a fresh process."""
    with fresh_process() as process:
        return process.submit(megabytes, rows, engine).result() / rows


def megabytes(rows: int, engine: Engine) -> float:
    """Memory that rows take of this process [MB], after a few have brought in all the code."""
    batch_of(8, engine=engine)
    before = process_memory()
    batch_of(rows, engine=engine)
    return (process_memory() - before) / 1e6


_Costs = Mapping[str, float]
"""Processor time [s] by side, of recordings alone too, and with ` MB` behind a side its largest resident memory."""


def _cost(costs: _Costs, run: str) -> float:
    return costs[f"{run}.rrd"] - costs[run]


FIGURES: Mapping[str, tuple[Callable[[_Costs], float], str, float]] = {
    "readme_run_s": (lambda costs: costs["minute.rrd"], "s of processor time, recorded", 2.8),
    "readme_run_ratio": (lambda costs: costs["minute.rrd"] / costs["minute"], "x the same run without", 1.35),
    "record_open_close_s": (lambda costs: costs["start"], "s of processor time", 0.5),
    "record_share": (
        lambda costs: (costs["ten"] - costs["start"]) / costs["ten.rrd"],
        "of a run of 10 minutes, beyond that",
        0.1,
    ),
    "record_rss_mb": (lambda costs: costs["minute.rrd MB"], "MB resident, 3 recorded boats", 300.0),
    "record_boat_of_100": (
        lambda costs: 0.03 * _cost(costs, "hundred") / _cost(costs, "minute"),
        "x that of one of 3 boats",
        1.0,
    ),
    "film_minute_s": (lambda costs: costs["film"], "s of processor time", 30.0),
}
"""Name, figure, unit and budget."""


def recording_rows(rounds: int = _RECORDING_ROUNDS) -> list[Row]:
    """A row for each budget of recordings; it takes some minutes."""
    found: dict[str, list[float]] = defaultdict(list)
    sides = [*SIDES, *RECORDINGS]
    with tempfile.TemporaryDirectory() as folder, Bar("measuring", rounds * len(sides), "figures") as bar:
        (Path(folder) / "hundred.yaml").write_text("usv_count: 100\nlayout: grid\n", encoding="utf-8")
        for number, place in itertools.product(range(rounds), range(len(sides))):
            side = sides[place if number % 2 == 0 else -1 - place]
            bar.update(number * len(sides) + place, side)
            if side in RECORDINGS:
                seconds, count = RECORDINGS[side]
                for _ in range(count):
                    with fresh_process() as process:
                        found[side].append(process.submit(recording_seconds, seconds).result())
                continue
            try:
                cost = child_cost(_vrx_mj(SIDES[side]), folder)
            except subprocess.CalledProcessError:
                if side != "film":
                    raise
                cost = math.nan, math.nan  # nothing can draw here, or the extra `video` is missing
            found[side].append(cost[0])
            found[f"{side} MB"].append(cost[1])
        child_cost(_vrx_mj(_START), folder)
        early, late = (sizes(Path(folder) / f"{name}.rrd") for name in ("hundred_start", "hundred"))
    growth = {part: (late[part] - early[part]) / 1e5 for part in late}
    return [
        *rows_of(found),
        bench_row("record_kb", sum(growth.values()), "kB a boat and minute, of 100", 150.0, parts=growth),
        bench_row("record_start_mb", sum(early.values()) / 1e6, "MB before the first second of 100 boats", 10.0),
    ]


def _vrx_mj(words: Sequence[str]) -> list[str]:
    return [sys.executable, "-m", "vrx_mj", *words]


def recording_seconds(seconds: int) -> float:
    """Processor time [s] that a recording of so many simulated seconds of the README's run takes, in this process.

    A run with the recording and one without take turns, second by second. Children count, but on Windows.
    """
    from vrx_mj.cli.sailing import recording

    def cpu_time(call: Callable[[], object]) -> float:
        begun = time.process_time() + sum(os.times()[2:4])
        call()
        return time.process_time() + sum(os.times()[2:4]) - begun

    world = compile_world("example_course", fleet="trio")
    sims = [Simulation(world, seed=7) for _ in range(2)]
    commands = {boat: {"left": 0.6, "right": 0.4} for boat in world.boats}
    recorded, plain = (partial(sim.step, commands, duration=1.0) for sim in sims)
    recorded(), plain()
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        run = recording(sims[0], Path(folder) / "run.rrd", ())
        opening = cpu_time(lambda: stack.enter_context(run))
        return opening + sum(cpu_time(recorded) - cpu_time(plain) for _ in range(seconds)) + cpu_time(stack.close)


def rows_of(costs: Mapping[str, Sequence[float]]) -> list[Row]:
    """The rows of what the rounds cost, each with the difference between even and odd rounds."""
    whole, even, odd = (
        {side: statistics.median(rounds[part]) for side, rounds in costs.items()}
        for part in (slice(None), slice(0, None, 2), slice(1, None, 2))
    )
    rows = []
    for name, (figure, unit, budget) in FIGURES.items():
        value, spread = figure(whole), abs(figure(even) - figure(odd))
        missing = "it needs the extra `video`, and something that draws"
        found = bench_row(name, value, unit, budget, parts={"A/A": spread}, missing=missing)
        rows.append({**found, "ok": found["ok"] if spread <= abs(value - budget) else None})
    return rows


def sizes(recording: Path) -> Counter[str]:
    """Bytes of a recording by what they are for: those of its chunks, and the rest."""
    from rerun.chunk import RrdReader

    found = Counter({"the rest": recording.stat().st_size})
    index = RrdReader(recording).store()._chunk_index().to_arrow()
    columns = (index[f"chunk_{name}"].to_pylist() for name in ("entity_path", "byte_size"))
    for entity, size in zip(*columns, strict=True):
        part = next((part for path, part in PARTS.items() if entity.startswith(path)), "the rest")
        found[part] += size
        found["the rest"] -= size
    return found
