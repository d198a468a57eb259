"""Kernels compile at their first call, which is no reason to fail an example for being slow.

Slow tests come first: at the end no worker then waits for one that another one has begun.
"""

from hypothesis import settings

settings.register_profile("kernels", deadline=None)
settings.load_profile("kernels")


def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)
