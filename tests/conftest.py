"""Kernels compile at their first call, which is no reason to fail an example for being slow.

Slow tests come first in what each worker is given, which is a block of the list: at the end no worker then waits for a
slow one that another has begun. Those of a module stay together, for they share what is made for it.
"""

import os
from itertools import groupby

from hypothesis import settings

settings.register_profile("kernels", deadline=None)
settings.load_profile("kernels")


def pytest_collection_modifyitems(items):
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    slow = [item for item in items if item.get_closest_marker("slow")]
    others = [item for item in items if not item.get_closest_marker("slow")]
    left = len(items)
    items.clear()
    modules = [list(group) for _, group in groupby(slow, key=lambda item: item.path)]
    for worker in range(workers):
        own = [item for module in modules[worker::workers] for item in module]
        rest = left // (workers - worker) - len(own)
        items += own + others[:rest]
        left -= len(own) + len(others[:rest])
        del others[:rest]
