"""`python -m vrx_mj.cuda.check` in numba's simulator, a few rows and steps of it, with what it needs of PyTorch."""

import contextlib
import sys
from types import SimpleNamespace

import numpy as np
from numba import cuda
from numba.cuda.simulator.kernel import FakeCUDAKernel

from unit.cuda.simulated_environment import Strict, host, take_strict_arrays
from vrx_mj.cuda import check


class Tensor(Strict):
    """A strict array with what is asked of a tensor."""

    def __getitem__(self, index):
        return Tensor(self.own[host(index)])

    def cuda(self):
        return self

    cpu = cuda

    def numpy(self):
        return self.own

    def tanh(self):
        return Tensor(np.tanh(self.own))


class Graph:
    """Launches that were captured."""

    def __init__(self):
        self.launches = []

    def replay(self):
        for kernel, grid, block, arguments in self.launches:
            kernel[grid, block](*arguments)


@contextlib.contextmanager
def capturing(graph, stream):
    """A context in which kernels are captured, and arrays neither copied nor allocated."""

    def launch(kernel, *arguments):
        graph.launches.append((kernel, kernel.grid_dim, kernel.block_dim, arguments))

    kept, to_device = FakeCUDAKernel.__call__, cuda.to_device
    FakeCUDAKernel.__call__ = launch
    cuda.to_device = None
    try:
        yield
    finally:
        FakeCUDAKernel.__call__, cuda.to_device = kept, to_device


def full(shape, value, device):
    assert device == "cuda"
    return Tensor(np.full(shape, value, np.float32))


class Stream:
    cuda_stream = 1

    def synchronize(self):
        """Nothing is queued here."""


if __name__ == "__main__":
    take_strict_arrays()
    cuda.external_stream = lambda _: cuda.default_stream()
    on_card = SimpleNamespace(
        Stream=Stream, stream=lambda _: contextlib.nullcontext(), CUDAGraph=Graph, graph=capturing,
        synchronize=lambda: None,
    )  # fmt: skip
    sys.modules["torch"] = SimpleNamespace(
        from_dlpack=lambda array: Tensor(host(array)), from_numpy=Tensor, full=full, cuda=on_card
    )
    sys.exit(check.main(check.Extent({1: 0.0}, more=5, divisor=16_384, launches=1, episode=2)))
