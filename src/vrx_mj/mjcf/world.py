"""A compiled world: all that a run needs, how it is kept in a folder, and its MJCF for other simulators.

Other simulators get MJCF without what they refuse.
"""

import hashlib
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import NamedTuple

from vrx_mj.arguments import as_path, check_name
from vrx_mj.config.search import ReadingError, read_limited
from vrx_mj.errors import StateError, warn
from vrx_mj.mjcf.pieces import Pieces
from vrx_mj.mjcf.saved import piece_files, read_world
from vrx_mj.model.numbers import Number, numbers_of
from vrx_mj.model.world import (
    FORMER,
    MOST_BYTES,
    Parameters,
    joined_entries,
    json_entries,
    other_physics,
    without_descriptions,
)
from vrx_mj.outputs import write_files
from vrx_mj.signals import delays_exit

_HEADER = re.compile(r"(<mujoco [^<>]*>\s*<!-- [^\n]*compiled by vrx_mj)\.\n.*?-->", re.DOTALL)
"""First comment of a saved MJCF."""
_ABOUT = re.compile(r'\s*<text name="vrx_mj/about"[^<>]*/>')
"""Text element that names the program."""
_SLEEP = r' (?:sleep|sleep_tolerance)="[^"]*"', "sleep: the balls of shooters fall from their places under the ground"
"""A part of our MJCF: a regular expression of its text, and what is different without it, as the header says it."""
_AUTORESET = r' autoreset="[^"]*"', "autoreset: a run that diverges may start again"
_TOUCHES = r'\s*<contact name="[^"]*"[^<>]*/>', "contact sensors: what the boat of a task touches"


@dataclass(frozen=True, repr=False)
class World:
    """A compiled world: its MJCF, asset files, and parameters of sea, wind, hulls and floating objects.

    `save` writes exactly this to a folder; `Simulation` and `Batch` run it.
    """

    pieces: Pieces
    """MJCF by parts: `parts` has name, piece and pose of each boat, dock and object, and `spec()` makes an `MjSpec`."""
    parameters: Parameters
    """Sea, wind, hulls, thrusters, sensors, objects, docks, task and more."""

    def __reduce__(self) -> tuple[type["World"], tuple[Pieces, Parameters]]:
        """Pickle and copy it as its parts: what keeps the assets from being changed cannot be pickled."""
        return World, (self.pieces, self.parameters)

    def __repr__(self) -> str:
        boats = f"{len(self.boats)} boat{'' if len(self.boats) == 1 else 's'}"
        return f"<World {self.name}, fleet {self.parameters.fleet}, {boats}, seed {self.seed}>"

    @cached_property
    def mjcf(self) -> str:
        """MJCF of the world, with every boat, dock and object attached under its name."""
        return self.pieces.text()

    @cached_property
    def assets(self) -> Mapping[str, bytes]:
        """Contents of the files that the MJCF refers to, by file name."""
        return MappingProxyType(dict(sorted(self.pieces.files.items())))

    @cached_property
    def _entries(self) -> dict[str, str]:
        return json_entries(self.parameters)

    @property
    def name(self) -> str:
        """Name of the world."""
        return self.parameters.name

    @property
    def seed(self) -> int:
        """Default seed of `Simulation.reset`."""
        return self.parameters.seed

    @cached_property
    def numbers(self) -> Mapping[str, Number]:
        """Numbers of its sea, current, wind and moorings, and of its boats, by name: `vrx_mj.parameters`."""
        return MappingProxyType(numbers_of(self.parameters))

    @cached_property
    def boats(self) -> tuple[str, ...]:
        """Names of the boats, in the order of the fleet."""
        return tuple(boat.name for boat in self.parameters.boats)

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the saved world, without the descriptions of its boats: these name places on this machine."""
        hulls = tuple(replace(hull, inertia=None) for hull in self.parameters.hulls)  # the MJCF has it
        former = {"format": FORMER, "hulls": hulls, "boats": without_descriptions(self.parameters).boats}
        digest = hashlib.sha256(self.mjcf.encode())
        digest.update(joined_entries({**self._entries, **json_entries(former)}).encode())
        for name in sorted(self.assets):
            digest.update(name.encode() + b"\0" + self.assets[name])
        return digest.hexdigest()

    def save(self, target: str | Path, *, simulator: str = "mujoco") -> Path:
        """Write the MJCF, its parameters, `pieces/` and `assets/` to a folder, and return the path of the MJCF.

        Plain MuJoCo can open the MJCF; `World.load` reads the whole world back.

        Args:
            target: a folder, in which the MJCF is named `scene.xml`, or the path of the MJCF, ending in `.xml`.
            simulator: program that opens the MJCF: "mujoco", "warp" (MuJoCo Warp) or "mjx" (MJX with JAX). For the
                latter two only the MJCF, without what they reject, and `assets/` are written.

        Raises:
            StateError: an asset's name contains a folder, a link is in the way, or a file cannot be written.
            UnknownNameError: there is no such simulator.
        """
        scene = _scene(as_path("target", target))
        write_files(scene.parent, self.files(scene.stem, simulator=simulator), "the world", StateError)
        return scene

    def files(self, name: str = "scene", *, simulator: str = "mujoco") -> dict[str, bytes]:
        """Files that `save` writes, by relative path; MJCF, parameters and list of pieces have this name.

        Raises:
            StateError: an asset's name has a folder in it.
            UnknownNameError: there is no such simulator.
        """
        for asset in self.assets:
            if asset != PurePosixPath(asset).name or "\\" in asset or ":" in asset:
                raise StateError(f"invalid asset name '{asset}': a file name without folders is needed")
        texts = {f"{name}.xml": mjcf_for(self.mjcf, simulator)}
        if simulator == "mujoco":
            texts |= {f"{name}.json": joined_entries(self._entries), **piece_files(self.pieces, name)}
        return {
            **{f"assets/{asset}": bytes(content) for asset, content in self.assets.items()},
            **{file: text.encode() for file, text in texts.items()},
        }

    @staticmethod
    def load(source: str | Path) -> "World":
        """Read a world that `save` wrote, from the same folder or path.

        It may come from somebody else: all of it is checked, and no file outside the folder is opened.

        Raises:
            StateError: there is no saved world, or it is damaged or of another version.

        Warns:
            VrxWarning: it is of another version of the physics.
        """
        scene = _scene(as_path("source", source))
        path = scene.with_suffix(".json")
        if not (path.is_file() and scene.is_file()):
            raise StateError(f"no saved world at {source}: {scene.name} and {path.name} are needed in {scene.parent}")
        folder = scene.parent
        world = world_of(lambda name: _read_file(folder / name), scene.stem, f"{folder}{os.sep}")
        if other := other_physics(world.parameters.physics_version):
            warn(f"the world {scene} is {other}", 2)
        return world


@delays_exit()
def world_of(read: Callable[[str], bytes], name: str, place: str) -> World:
    """The world of the files that `save` wrote by a name; `read` gives a file's content by its relative path.

    In messages `place` comes before that path. Nothing is written, and paths lead nowhere else: what was saved may come
    from somebody else.

    Raises:
        StateError: it is damaged or of another version.
    """
    return World(*read_world(read, name, place))


def _read_file(path: Path) -> bytes:
    """A file's content.

    Raises:
        StateError: it does not exist, is not a plain file, or is too large.
    """
    try:
        return read_limited(path, MOST_BYTES)
    except ReadingError as error:
        raise StateError(f"{path} {error}") from None


def _scene(target: Path) -> Path:
    """The MJCF's path, from it or from its folder."""
    return target if target.suffix == ".xml" else target / "scene.xml"


class Simulator(NamedTuple):
    """A program that reads our MJCF."""

    title: str
    """Its name for people."""
    omissions: tuple[tuple[str, str], ...] = ()
    """Parts that it refuses."""


SIMULATORS: Mapping[str, Simulator] = {
    "mujoco": Simulator("MuJoCo"),
    "warp": Simulator("MuJoCo Warp", (_SLEEP, _AUTORESET)),
    "mjx": Simulator("MJX", (_SLEEP, _AUTORESET, _TOUCHES)),
}
"""Simulators, by the names that `World.save` takes; the omissions are for MuJoCo Warp 4.0.0 and MJX 3.17.0 with JAX."""


def mjcf_for(mjcf: str, simulator: str) -> str:
    """The MJCF of a compiled world as a simulator takes it; its header says what was left out.

    Raises:
        UnknownNameError: `SIMULATORS` has no such name.
    """
    check_name("simulator", simulator, SIMULATORS)
    title, omissions = SIMULATORS[simulator]
    if not omissions:
        return mjcf
    for pattern, _ in omissions:
        mjcf = re.sub(pattern, "", mjcf)
    lines = "".join(f"\n         {consequence}" for _, consequence in omissions)
    header = f"""\\1 for {title}.

       There is no sea here, no wind and no thrust: these come from vrx_mj's loop alone, and boats fall. Masses, joints,
       shapes and contacts are those of vrx_mj. Left out, since {title} refuses it:
{lines}
  -->"""
    return _HEADER.sub(header, _ABOUT.sub("", mjcf))
