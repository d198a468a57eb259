"""Kernels compile at their first call, which is no reason to fail an example for being slow.

Slow tests come first in what each worker is given, which is a block of the list: at the end no worker then waits for a
slow one that another has begun. The others stay in their order, for those of a module share what is made for it.
"""

import os

from hypothesis import settings

settings.register_profile("kernels", deadline=None)
settings.load_profile("kernels")


def pytest_collection_modifyitems(items):
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    slow = [item for item in items if item.get_closest_marker("slow")]
    others = [item for item in items if not item.get_closest_marker("slow")]
    left = len(items)
    items.clear()
    for worker in range(workers):
        own = slow[worker::workers]
        rest = left // (workers - worker) - len(own)
        items += own + others[:rest]
        left -= len(own) + len(others[:rest])
        del others[:rest]
