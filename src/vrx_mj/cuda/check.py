"""`python -m vrx_mj.cuda.check`: rows on this machine's graphics processor beside the CPU's, and how fast they are.

Environments, too, and a CUDA graph, where Gymnasium and PyTorch are installed. Exits with 1 where something is farther
apart than its bound, or differs from run to run.
"""

import importlib
import sys
import time
from types import ModuleType
from typing import Any

import numpy as np
from numba import cuda

from vrx_mj.cuda.batch import Batch
from vrx_mj.errors import VrxError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.world import World
from vrx_mj.runtime import batch

_WIND: dict[str, Any] = {
    "mean_velocity": 5.0, "var_gain": 1.0, "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}]
}  # fmt: skip
_SEA: dict[str, Any] = {"model": "jonswap", "sea_state": 2, "spreading": 10}
_WORLDS: dict[str, dict[str, Any]] = {
    "vrx, 5 waves": {"sea": {"model": "cwr", "number": 5, "scale": 1.5, "amplitude": 0.1, "period": 4.0}},
    "vrx, 60 waves": {"sea": _SEA},
    "marine, 60 waves": {"sea": _SEA, "physics": {"profile": "marine"}, "current": {"speed": 0.3, "var_gain": 0.05}},
}
_SIZES = {"vrx, 5 waves": (1024, 262_144), "vrx, 60 waves": (1024, 262_144), "marine, 60 waves": (1024, 32_768)}
_BOUNDS = {10: 1e-9, 60: 1e-6}
"""How far rows may be from the CPU's [m, rad] after so many seconds: the processor's exponentials and angles differ in
their last bits."""
_FEW, _MORE, _SEED, _STEPS, _LAUNCHES = 4, 256, 7, 10, 20
_ENVIRONMENT: dict[str, Any] = {"id": "vrx_mj.rl:vrx_mj/StationKeeping-v0", "waves": (0, 1), "wind_speed": (0, 6)}
_ENVIRONMENTS, _EPISODE, _OBSERVED, _WANTED = 262_144, 100, 1e-6, 100e6
"""Environments that are measured, steps that are compared, how far observations may be apart, and steps a second."""


def _commanded(rows: Batch | batch.Batch, count: int, channels: int) -> None:
    shares = np.linspace(0.1, 0.6, _FEW)[np.arange(count) % _FEW]
    rows.command(shares[:, None] * np.ones(channels))


def _apart(world: World) -> bool:
    """Print how far rows are from the CPU's, and whether they are equal for any number of rows; whether all is well."""
    seeds = [_SEED + k % _FEW for k in range(_MORE)]
    host = batch.Batch(world, _FEW, seed=seeds[:_FEW], engine="free")
    few, more, again = (Batch(world, n, seed=seeds[:n]) for n in (_FEW, _MORE, _MORE))
    well, reached = True, 0
    for seconds, bound in _BOUNDS.items():
        for _ in range(seconds - reached):
            for rows, count in ((host, _FEW), (few, _FEW), (more, _MORE), (again, _MORE)):
                _commanded(rows, count, len(host.channels))
                rows.advance(round(1.0 / host.timestep))
        reached = seconds
        found = few.qpos.copy_to_host()
        error = float(np.abs(found - host.qpos).max())
        print(f"  after {seconds} s: {error:.1e} from the CPU's (bound {bound:.0e})")
        well &= error <= bound
    one, other = more.qpos.copy_to_host(), again.qpos.copy_to_host()
    equal = one.tobytes() == other.tobytes() and one[:_FEW].tobytes() == found.tobytes()
    print(f"  the same bits from run to run, and in {_FEW} and {_MORE} rows: {'yes' if equal else 'NO'}")
    return well and equal


def _speed(world: World, n: int) -> None:
    """Print how many boat steps a second `n` rows make."""
    begun = time.perf_counter()
    rows = Batch(world, n, seed=_SEED)
    _commanded(rows, n, len(rows.channels))
    rows.advance(_STEPS)
    rows.check()
    made, start, end = time.perf_counter() - begun, cuda.event(), cuda.event()
    start.record()
    for _ in range(_LAUNCHES):
        rows.advance(_STEPS)
    end.record()
    end.synchronize()
    rate = n * _STEPS * _LAUNCHES / (1e-3 * cuda.event_elapsed_time(start, end))
    print(f"  {n} rows: {rate / 1e6:.1f} million boat steps a second ({made:.1f} s to make and reset)", flush=True)


def _environments(gymnasium: ModuleType, torch: ModuleType) -> bool:
    """Print how far environments are from the CPU's, and how many steps they make with tensors; whether all is well."""
    here, there = (
        gymnasium.make_vec(num_envs=_FEW, **_ENVIRONMENT, **how) for how in ({"engine": "free"}, {"device": "cuda"})
    )
    seen, found, error = here.reset(seed=_SEED)[0], there.reset(seed=_SEED)[0], 0.0
    for number in range(_EPISODE):
        error = max(error, float(np.abs(torch.from_dlpack(found).cpu().numpy() - seen).max()))
        actions = np.full(seen.shape[:1] + here.single_action_space.shape, np.sin(0.1 * number), np.float32)
        seen, found = here.step(actions)[0], there.step(torch.from_numpy(actions).cuda())[0]
    print(f"  after {_EPISODE} steps: {error:.1e} from the CPU's (bound {_OBSERVED:.0e})")
    many = gymnasium.make_vec(num_envs=_ENVIRONMENTS, device="cuda", **_ENVIRONMENT)
    observation = torch.from_dlpack(many.reset(seed=_SEED)[0])
    for launch in range(3 * _LAUNCHES):
        if launch == _LAUNCHES:
            torch.cuda.synchronize()
            begun = time.perf_counter()
        observation = torch.from_dlpack(many.step(observation[:, :4].tanh())[0])
    torch.cuda.synchronize()
    rate = _ENVIRONMENTS * 2 * _LAUNCHES / (time.perf_counter() - begun)
    text = f"{rate / 1e6:.1f} million steps a second ({_WANTED / 1e6:.0f} wanted)"
    print(f"  {_ENVIRONMENTS} environments: {text}", flush=True)
    return error <= _OBSERVED


def _graph(world: World, torch: ModuleType) -> bool:
    """Print whether steps that a CUDA graph replays are those of plain calls, to the bit."""
    stream, graph = torch.cuda.Stream(), torch.cuda.CUDAGraph()
    with torch.cuda.stream(stream):
        captured, plain = (Batch(world, _MORE, seed=_SEED, stream=stream.cuda_stream) for _ in range(2))
        actions = torch.full((_MORE, len(plain.channels)), 0.3, device="cuda")
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
    equal = captured.qpos.copy_to_host().tobytes() == plain.qpos.copy_to_host().tobytes()
    print(f"  the same bits from a CUDA graph: {'yes' if equal else 'NO'}")
    return equal


def main() -> int:
    """Compare and measure every world."""
    fleet = {"usv_count": 1, "thrusters": "H", "engines": "fixed", "sensors": "none", "positions": [{"x": 0, "y": 0}]}
    well = True
    for name, more in _WORLDS.items():
        world = compile_world({"physics": {"profile": "vrx"}, "wind": _WIND, **more}, fleet=fleet)
        print(f"{name}:", flush=True)
        begun = time.perf_counter()
        well &= _apart(world)
        print(f"  compiled and compared in {time.perf_counter() - begun:.0f} s", flush=True)
        for n in _SIZES[name]:
            _speed(world, n)
    try:
        gymnasium, torch = map(importlib.import_module, ("gymnasium", "torch"))
    except ModuleNotFoundError as error:
        print(f"environments are not measured: {error.name} is not installed")
    else:
        print("StationKeeping, 3 waves of each row's own:", flush=True)
        well &= _environments(gymnasium, torch)
        well &= _graph(world, torch)
    return 0 if well else 1


if __name__ == "__main__":
    try:
        device = cuda.get_current_device() if cuda.is_available() else None
        print(device.name.decode() if device else "no device", flush=True)
        sys.exit(main())
    except VrxError as error:
        sys.exit(str(error))
