"""Kernels compile at their first call, which is no reason to fail an example for being slow."""

from hypothesis import settings

settings.register_profile("kernels", deadline=None)
settings.load_profile("kernels")
