"""Environments on a processor, in numba's simulator, and on the CPU, side by side; prints messages of what is refused.

In the simulator CuPy's arrays are those of `Strict`: like them they are not converted to NumPy's, and neither mixed
with these nor asked for a truth, for which the host would wait.
"""

import importlib.util
import inspect
from types import SimpleNamespace

import gymnasium
import numpy as np
from numba import cuda
from numba.cuda.simulator.cudadrv.devicearray import FakeCUDAArray

from unit.cuda.simulated_rows import run_as_compiled
from vrx_mj.cuda import batch
from vrx_mj.errors import VrxError
from vrx_mj.rl import TeamVectorEnv, device

cupy = importlib.import_module("cupy") if importlib.util.find_spec("cupy") else None
ROWS, STEPS = 3, 5
OPTIONS = {"waves": (0, 1), "wind_speed": (0, 6), "gusts": 1.0, "mass": (0.9, 1.1), "max_episode_steps": STEPS}
PROBLEMS = "StationKeeping", "Wayfinding", "FollowPath"
METHODS = ("all", "any", "astype", "clip", "copy", "max", "min", "reshape", "sum", "take", "transpose")
SIZES = ("shape", "ndim", "size", "dtype")


def host(value):
    """NumPy's array behind a strict one; no array of NumPy's may be beside it."""
    assert not (isinstance(value, np.ndarray) and value.ndim), "an array of the host among those of the device"
    if isinstance(value, tuple | list):
        return type(value)(map(host, value))
    return value.own if isinstance(value, Strict) else value


def strict(value):
    if isinstance(value, tuple | list):
        return type(value)(map(strict, value))
    return Strict(value) if isinstance(value, np.ndarray | np.generic) else value


class Strict(np.lib.mixins.NDArrayOperatorsMixin):
    """An array that only the functions of NumPy take that hand over to another library."""

    def __init__(self, own):
        self.own = np.asarray(own)

    def __array_ufunc__(self, ufunc, method, *inputs, out=None, **options):
        assert method == "__call__"
        assert not cupy or hasattr(cupy, ufunc.__name__), ufunc
        if out is not None:
            options["out"] = host(out)
        found = strict(ufunc(*host(inputs), **options))
        return found if out is None else out[0]

    def __array_function__(self, function, types, inputs, options):
        if cupy:
            inspect.signature(getattr(cupy, function.__name__)).bind(*inputs, **options)
        return strict(function(*host(inputs), **{name: host(value) for name, value in options.items()}))

    def __array__(self, *_, **__):
        raise TypeError("an array of the device is not converted")

    def __bool__(self):
        raise TypeError("the host would wait for the device")

    __int__ = __float__ = __index__ = __bool__

    def __getattr__(self, name):
        if name not in METHODS:
            raise AttributeError(name)
        return lambda *inputs, **options: strict(getattr(self.own, name)(*host(inputs), **options))

    def __getitem__(self, index):
        return strict(self.own[host(index)])

    def __setitem__(self, index, value):
        self.own[host(index)] = host(value)

    def __iter__(self):
        return map(strict, self.own)

    def __len__(self):
        return len(self.own)

    T = property(lambda self: strict(self.own.T))
    shape, ndim, size, dtype = (property(lambda self, name=name: getattr(self.own, name)) for name in SIZES)
    __cuda_array_interface__ = property(lambda self: self.own.__array_interface__)


class Library:
    """What `rl.device` asks of CuPy."""

    asarray = staticmethod(lambda given: given if isinstance(given, Strict) else Strict(given))
    array = staticmethod(lambda given: Strict(np.array(given)))
    zeros = staticmethod(lambda *shape: Strict(np.zeros(*shape)))
    arange = staticmethod(lambda n: Strict(np.arange(n)))


def refuse(*_, **__):
    raise AssertionError("a step copies, allocates or waits")


def compare(problem):
    """Two episodes: the second of a row is the first of the row after it."""
    name = f"vrx_mj/{problem}-v0"
    ours = gymnasium.make_vec(name, num_envs=ROWS, device="cuda", **OPTIONS)
    cpu = gymnasium.make_vec(name, num_envs=ROWS, engine="free", **OPTIONS)
    random = np.random.default_rng(1)
    (seen, info), (expected, drawn) = ours.reset(seed=4), cpu.reset(seed=4)
    for episode in range(3):
        assert host(seen).tobytes() == expected.tobytes(), (problem, episode)
        assert host(info["start"]).tolist() == [(row + episode) % ROWS for row in range(ROWS)]
        assert all(host(value).tobytes() == drawn[fact].tobytes() for fact, value in info.items() if fact in drawn)
        for step in range(STEPS):
            actions = random.uniform(-1, 1, (ROWS, 4)).astype(np.float32)
            *found, info = free_of_the_host(ours.step, Strict(actions))
            *wanted, facts = cpu.step(actions)
            for one, other in zip(found, wanted, strict=True):
                assert (one.dtype, host(one).tobytes()) == (other.dtype, other.tobytes()), (problem, episode, step)
            for fact, value in facts.items():
                assert fact.startswith("_") or host(info[fact]).tobytes() == value.tobytes(), (problem, fact)
        assert host(found[3]).all()
        seen, reward, *_, info = free_of_the_host(ours.step, Strict(actions))
        assert not host(reward).any()
        expected, drawn = cpu.reset(seed=[4 + (row + episode + 1) % ROWS for row in range(ROWS)])


def compare_at_once(problem):
    """Episodes that begin in the step that ends the one before: what was last seen, and the first of the next."""
    name = f"vrx_mj/{problem}-v0"
    ours = gymnasium.make_vec(name, num_envs=ROWS, device="cuda", autoreset_mode="SameStep", **OPTIONS)
    cpu = gymnasium.make_vec(name, num_envs=ROWS, engine="free", autoreset_mode="Disabled", **OPTIONS)
    random = np.random.default_rng(1)
    ours.reset(seed=4)
    expected, _ = cpu.reset(seed=4)
    for episode in range(3):
        for step in range(STEPS):
            actions = random.uniform(-1, 1, (ROWS, 4)).astype(np.float32)
            seen, *found, info = free_of_the_host(ours.step, Strict(actions))
            expected, *wanted, facts = cpu.step(actions)
            for one, other in zip((info["final_obs"], *found), (expected, *wanted), strict=True):
                assert host(one).tobytes() == other.tobytes(), (problem, episode, step)
            for fact, value in facts.items():
                assert fact.startswith("_") or host(info["final_info"][fact]).tobytes() == value.tobytes(), fact
            over = host(found[1] | found[2])
            assert over.all() or not over.any()
            if not over.any():
                assert host(seen).tobytes() == expected.tobytes(), (problem, episode, step)
        assert over.all()
        expected, drawn = cpu.reset(seed=[4 + (row + episode + 1) % ROWS for row in range(ROWS)])
        assert host(seen).tobytes() == expected.tobytes(), (problem, episode)
        assert host(info["start"]).tolist() == [(row + episode + 1) % ROWS for row in range(ROWS)]
        assert all(host(value).tobytes() == drawn[fact].tobytes() for fact, value in info.items() if fact in drawn)


def free_of_the_host(step, actions):
    """What a step returns in which nothing is copied to or from the host, allocated by numba or waited for."""
    kept = cuda.to_device, cuda.device_array, FakeCUDAArray.copy_to_host
    cuda.to_device = cuda.device_array = FakeCUDAArray.copy_to_host = refuse
    try:
        return step(actions)
    finally:
        cuda.to_device, cuda.device_array, FakeCUDAArray.copy_to_host = kept


def refusals():
    """Lines that say what to do."""

    def make(**options):
        return gymnasium.make_vec("vrx_mj/StationKeeping-v0", num_envs=2, **{"device": "cuda"} | options)

    buoy = {"model": "mb_round_buoy_black", "name": "b", "pose": [100.0, 0, 0, 0, 0, 0]}
    ours = make()
    for call in (
        lambda: make(world={"extends": "ocean", "objects": [buoy]}), lambda: make(render_mode="rgb_array"),
        lambda: make(autoreset_mode="Disabled"), lambda: make(device="tpu"),
        lambda: gymnasium.make_vec("vrx_mj/Docking-v0", num_envs=2, device="cuda"),
        lambda: TeamVectorEnv("Formation", 2, device="cuda"),
        lambda: ours.reset(options={"reset_mask": np.array([True, False])}), lambda: ours.step(Strict(np.zeros(3))),
    ):  # fmt: skip
        try:
            call()
        except (VrxError, gymnasium.error.Error) as error:
            print(error)
        ours.reset(seed=1)


def take_strict_arrays():
    """Let the simulator run compiled functions, and environments strict arrays."""
    run_as_compiled()
    device.arrays = batch.arrays = Library
    cuda.as_cuda_array = lambda given, sync: FakeCUDAArray(given.own)
    cuda.get_current_device = lambda: SimpleNamespace(id=0)


if __name__ == "__main__":
    take_strict_arrays()
    for problem in PROBLEMS:
        compare(problem)
        compare_at_once(problem)
    refusals()
