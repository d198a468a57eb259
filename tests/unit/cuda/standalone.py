"""Modules of `vrx_mj.cuda` by themselves, with stand-ins for numba-cuda, which need not be installed."""

import importlib.util
import sys
from pathlib import Path

import numba

import vrx_mj


def load(monkeypatch, name, cuda, modules):
    """The module of this name; `cuda` stands for `numba.cuda`, `modules` for others that it imports."""
    monkeypatch.setattr(numba, "cuda", cuda, raising=False)
    for other, stand_in in modules.items():
        monkeypatch.setitem(sys.modules, other, stand_in)
    spec = importlib.util.spec_from_file_location(name, Path(vrx_mj.__file__).parent / "cuda" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
