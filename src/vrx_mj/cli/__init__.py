"""The command line, `vrx-mj`.

A sourced ROS puts packages of its own on PYTHONPATH, for another Python or too old for us: ours are looked up first.
"""

import gc
import importlib.util
import os
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

__all__ = ["main"]
PACKAGES = frozenset({
    "IPython", "PIL", "av", "capytaine", "cbor2", "collada", "cupy", "foxglove", "gymnasium", "jinja2",
    "llvmlite", "lxml", "lz4", "markupsafe", "matplotlib", "mujoco", "numba", "numba_cuda", "numpy",
    "pettingzoo", "psutil", "pyais", "pyarrow", "pydantic", "pynmea2", "ray", "rerun", "rerun_notebook", "rich",
    "rosbags", "scipy", "shapely", "trimesh", "typer", "websockets", "xacro", "yaml", "yourdfpy",
})  # fmt: skip
"""Packages that the sources import, by the names of their modules."""
EXTRAS = {
    "ros1": ("rosbags", "lz4"), "foxglove": ("rosbags", "foxglove"), "rosbridge": ("rosbags", "websockets", "cbor2"),
    "rl": ("gymnasium", "pettingzoo"), "ray": ("ray",), "notebook": ("ipykernel", "rerun_notebook"),
    "video": ("av",), "hydro": ("capytaine",), "nmea": ("rosbags", "pynmea2", "pyais"),
    "cuda": ("numba_cuda", "cupy"), "warp": ("mujoco_warp",),
}  # fmt: skip
"""Modules that each extra brings."""


def main() -> None:
    """Run the command line on the packages that are installed, whatever PYTHONPATH names."""
    gc.set_threshold(10_000)  # packages make much and drop little: Python's 700 cost a twentieth of a short run
    try:
        Path.cwd()
    except OSError as error:
        sys.stderr.write(f"the current folder cannot be used: {error.strerror}; change to another\n")
        raise SystemExit(2) from None
    installed_first()
    try:
        from vrx_mj.cli.program import main as start

        start()
    except KeyboardInterrupt:  # while packages were loaded; from then on commands report it
        raise SystemExit(130) from None
    except Exception as error:
        if _is_interrupt(error):
            raise SystemExit(130) from None
        line = shadowed_package(error)
        if line is None:
            raise
        sys.stderr.write(f"{line}\n")
        raise SystemExit(2) from None


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an error: a package that it hits while it loads may raise another one in its place."""
    return error is not None and (
        isinstance(error, KeyboardInterrupt) or _is_interrupt(error.__cause__ or error.__context__)
    )


def missing_modules(extra: str) -> list[str]:
    """The modules of an extra that are not installed."""
    return [module for module in EXTRAS[extra] if importlib.util.find_spec(module) is None]


def installed_first() -> None:
    """Move the folders of PYTHONPATH behind those of installed packages in the search path of modules."""
    named = set(_named_folders())
    sys.path.sort(key=lambda entry: Path(entry).resolve() in named)


def shadowed_package(error: BaseException) -> str | None:
    """The message where a package from PYTHONPATH failed in the place of one we need; else None.

    After `installed_first` that happens only to a package that is not installed here.
    """
    for file in _files(error):
        for folder in _named_folders():
            path = Path(file).resolve()
            name = path.relative_to(folder).parts[0].removesuffix(".py") if path.is_relative_to(folder) else ""
            if name in PACKAGES:
                cause = str(error).partition("\n")[0]
                return (
                    f"vrx-mj: {name} in {path}, from PYTHONPATH, is in the way ({type(error).__name__}: {cause}): "
                    f"run with PYTHONPATH empty; if {name} is missing then, install vrx_mj again"
                )
    return None


def _named_folders() -> Iterator[Path]:
    """The folders that PYTHONPATH names, and the current one, which `python -m` and an empty entry mean."""
    return (Path(entry).resolve() for entry in ["", *os.environ.get("PYTHONPATH", "").split(os.pathsep)])


def _files(error: BaseException) -> Iterator[str]:
    """The files that an error and its causes are about, the innermost first."""
    frames = reversed(traceback.extract_tb(error.__traceback__))
    about = (
        getattr(error, "filename", None),  # SyntaxError
        getattr(error, "path", None),  # ImportError
        getattr(getattr(error, "obj", None), "__file__", None),  # AttributeError
        *(frame.filename for frame in frames),
    )
    yield from (file for file in about if isinstance(file, str))
    cause = error.__cause__ or error.__context__
    if cause is not None:
        yield from _files(cause)
