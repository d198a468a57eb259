"""`python -m vrx_mj.cuda.check`: rows on this machine's graphics processor beside the CPU's, and how fast they are.

Environments, too, and a CUDA graph, where Gymnasium and PyTorch are installed. Verdicts come last, each with the card's
name. Exits with 1 where something is farther apart than its bound, or differs from run to run; speeds are the card's.
"""

import importlib
import sys
import time
from collections.abc import Mapping
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numba import cuda

from vrx_mj.arrays import FloatArray
from vrx_mj.cuda.batch import Batch, check_driver
from vrx_mj.errors import VrxError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.world import World
from vrx_mj.runtime import batch

_WIND: dict[str, Any] = {
    "mean_velocity": 5.0, "var_gain": 1.0, "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}]
}  # fmt: skip
_SEA: dict[str, Any] = {"model": "jonswap", "sea_state": 2, "spreading": 10}
_FEW, _SEED, _STEPS = 4, 7, 10
_TOLERANCES = {10: 1e-9, 60: 1e-6}
"""How far rows may be from the CPU's [m, rad] after so many seconds: the processor's exponentials and angles differ in
their last bits."""
_OBSERVATION_TOLERANCE = 1e-6
"""How far observations may be apart."""
_ENVIRONMENT: dict[str, Any] = {"id": "vrx_mj.rl:vrx_mj/StationKeeping-v0", "waves": (0, 1), "wind_speed": (0, 6)}
_ENVIRONMENTS, _WANTED_RATE = 262_144, 100e6
"""Environments that are measured, and steps a second."""
_PERIODS_WORLD, _PERIODS_ROWS, _PERIODS_WANTED_RATE = "vrx, 60 waves", 65_536, 317e6
"""World whose rows are measured with waves of periods of their own, too, their number, and boat steps a second."""


class _Case(NamedTuple):
    """A world whose rows are compared and measured."""

    world: dict[str, Any]
    rows: int
    wanted: float
    """Boat steps a second."""


_CASES = {
    "vrx, 5 waves": _Case(
        {"sea": {"model": "cwr", "number": 5, "scale": 1.5, "amplitude": 0.1, "period": 4.0}}, 262_144, 1e9
    ),
    "vrx, 60 waves": _Case({"sea": _SEA}, 262_144, 400e6),
    "marine, 60 waves": _Case(
        {"sea": _SEA, "physics": {"profile": "marine"}, "current": {"speed": 0.3, "var_gain": 0.05}}, 32_768, 20e6
    ),
}
"""Worlds that are compared and measured, by name; the one that compiles longest is last."""


class Extent(NamedTuple):
    """How much is compared and measured."""

    seconds: Mapping[int, float] = _TOLERANCES
    """Bounds [m, rad] after so many seconds."""
    more: int = 256
    """Rows of which some are compared with the CPU's."""
    divisor: int = 1
    """Divisor of the numbers of rows and environments that are measured."""
    launches: int = 20
    """Launches that are measured."""
    episode: int = 100
    """Steps of an environment that are compared."""


class _Check:
    """One run of all comparisons and measurements."""

    def __init__(self, extent: Extent, torch: ModuleType | None, gymnasium: ModuleType | None) -> None:
        self._extent, self._torch, self._gymnasium = extent, torch, gymnasium
        self.card = str(getattr(cuda.get_current_device(), "name", "numba's simulator"))
        self.verdicts: list[str] = []
        self.well = True

    def judge(self, text: str, good: bool) -> None:
        """Print what must be so."""
        self.well &= good
        print(f"  {text}: {'yes' if good else 'NO'}", flush=True)
        self.verdicts.append(f"{text}: {'yes' if good else 'NO'}")

    def rate(self, what: str, rate: float, wanted: float | None = None) -> None:
        """Print a speed [1/s] and what is wanted of it."""
        text = f"{what}: {rate / 1e6:.1f} million a second"
        print(f"  {text}", flush=True)
        if wanted is not None:
            self.verdicts.append(f"{text}, wanted {wanted / 1e6:.0f}: {'met' if rate >= wanted else 'NOT MET'}")

    def compare(self, name: str, world: World) -> None:
        """Rows beside the CPU's, and for two numbers of rows."""
        more = self._extent.more
        seeds = [_SEED + k % _FEW for k in range(more)]
        host = batch.Batch(world, _FEW, seed=seeds[:_FEW], engine="free")
        few, many, again = (Batch(world, n, seed=seeds[:n]) for n in (_FEW, more, more))
        reached = 0
        for seconds, bound in self._extent.seconds.items():
            for _ in range(seconds - reached):
                for rows in (host, few, many, again):
                    _command(rows)
                    rows.advance(round(1.0 / host.timestep))
            reached, error = seconds, float(np.abs(few.host().qpos - host.qpos).max())
            self.judge(f"{name}, {seconds} s: {error:.1e} from the CPU's, within {bound:.0e}", error <= bound)
        found, one, other = (rows.host().qpos for rows in (few, many, again))
        equal = one.tobytes() == other.tobytes() and one[:_FEW].tobytes() == found.tobytes()
        self.judge(f"{name}: the same bits from run to run, and in {_FEW} and {more} rows", equal)
        if (threads := many._rows.threads) > 1:
            self.judge(f"{name}: the same bits from the {threads} threads of a row", many._rows.threads_agree())

    def measure(self, name: str, world: World, n: int, wanted: float | None, **varied: FloatArray) -> None:
        """Boat steps a second of `n` rows; `varied` is what `Batch.vary` is given."""
        begun = time.perf_counter()
        rows = Batch(world, n, seed=_SEED)
        if varied:
            rows.vary(**varied)
            rows.reset(seed=_SEED)
        _command(rows)
        rows.advance(_STEPS)
        rows.check()
        made, begun = time.perf_counter() - begun, time.perf_counter()
        for _ in range(self._extent.launches):
            rows.advance(_STEPS)
        cuda.synchronize()
        rate = n * _STEPS * self._extent.launches / (time.perf_counter() - begun)
        print(f"  {n} rows made and compiled in {made:.1f} s", flush=True)
        self.rate(f"{name}, {n} rows, {_STEPS} steps a launch, boat steps", rate, wanted)

    def environments(self) -> None:
        """Environments beside the CPU's, and how many steps they make with tensors."""
        if self._gymnasium is None or self._torch is None:
            print("environments are left out: Gymnasium or PyTorch is not installed")
            return
        make, torch, extent = self._gymnasium.make_vec, self._torch, self._extent
        here, there = (make(num_envs=_FEW, **_ENVIRONMENT, **how) for how in ({"engine": "free"}, {"device": "cuda"}))
        seen, found, error = here.reset(seed=_SEED)[0], there.reset(seed=_SEED)[0], 0.0
        for number in range(extent.episode):
            error = max(error, float(np.abs(torch.from_dlpack(found).cpu().numpy() - seen).max()))
            actions = np.full(seen.shape[:1] + here.single_action_space.shape, np.sin(0.1 * number), np.float32)
            seen, found = here.step(actions)[0], there.step(torch.from_numpy(actions).cuda())[0]
        text = f"environments, {extent.episode} steps: {error:.1e} from the CPU's, within {_OBSERVATION_TOLERANCE:.0e}"
        self.judge(text, error <= _OBSERVATION_TOLERANCE)
        n, warm, begun = _ENVIRONMENTS // extent.divisor, extent.launches, time.perf_counter()
        many = make(num_envs=n, device="cuda", **_ENVIRONMENT)
        observation = torch.from_dlpack(many.reset(seed=_SEED)[0])
        print(f"  {n} environments made and reset in {time.perf_counter() - begun:.1f} s", flush=True)
        for step in range(3 * warm):
            if step == warm:
                torch.cuda.synchronize()
                begun = time.perf_counter()
            observation = torch.from_dlpack(many.step(observation[:, :4].tanh())[0])
        torch.cuda.synchronize()
        rate = n * 2 * warm / (time.perf_counter() - begun)
        self.rate(f"StationKeeping, {n} environments with tensors, steps", rate, _WANTED_RATE)

    def graph(self, world: World) -> None:
        """Steps that a CUDA graph replays beside plain calls."""
        if self._torch is None:
            print("a CUDA graph is left out: PyTorch is not installed")
            return
        torch, more = self._torch, self._extent.more
        stream, graph = torch.cuda.Stream(), torch.cuda.CUDAGraph()
        with torch.cuda.stream(stream):
            captured, plain = (Batch(world, more, seed=_SEED, stream=stream.cuda_stream) for _ in range(2))
            actions = torch.full((more, len(plain.channels)), 0.3, device="cuda")
            for rows in (captured, plain, plain, plain):  # the first call compiles
                rows.step(actions, duration=0.1)
                rows.observe()
        stream.synchronize()
        with torch.cuda.graph(graph, stream=stream):
            captured.step(actions, duration=0.1)
            captured.observe()
        for _ in range(2):
            graph.replay()
        torch.cuda.synchronize()
        equal = captured.host().qpos.tobytes() == plain.host().qpos.tobytes()
        self.judge("the same bits from a CUDA graph", equal)


def _command(rows: Batch | batch.Batch) -> None:
    shares = np.linspace(0.1, 0.6, _FEW)[np.arange(rows.n) % _FEW]
    rows.command(shares[:, None] * np.ones(len(rows.channels)))


def _module(name: str) -> ModuleType | None:
    """A module by name; None if it is not installed."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        return None


def main(extent: Extent = Extent()) -> int:  # noqa: B008  (it is a tuple of numbers)
    """Compare and measure every world; 1 where something differs.

    Raises:
        CommandError: there is no graphics processor, or not enough memory.
    """
    check_driver("run this on a machine with an NVIDIA card")
    begun, check = time.perf_counter(), _Check(extent, _module("torch"), _module("gymnasium"))
    print(check.card, flush=True)
    fleet = {"usv_count": 1, "thrusters": "H", "engines": "fixed", "sensors": "none", "positions": [{"x": 0, "y": 0}]}
    for number, (name, case) in enumerate(_CASES.items()):
        world = compile_world({"physics": {"profile": "vrx"}, "wind": _WIND, **case.world}, fleet=fleet)
        print(f"{name}:", flush=True)
        check.compare(name, world)
        check.measure(name, world, max(1, 1024 // extent.divisor), None)
        check.measure(name, world, case.rows // extent.divisor, case.wanted)
        if name == _PERIODS_WORLD:
            own = np.linspace(0.9, 1.1, _PERIODS_ROWS // extent.divisor)
            check.measure(f"{name} of each row's own", world, len(own), _PERIODS_WANTED_RATE, wave_period=own)
        if not number:
            print("StationKeeping, 3 waves of each row's own:", flush=True)
            check.environments()
            check.graph(world)
    print(f"verdicts, after {time.perf_counter() - begun:.0f} s:", *check.verdicts, sep=f"\n{check.card}: ", flush=True)
    return 0 if check.well else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except VrxError as error:
        sys.exit(str(error))
