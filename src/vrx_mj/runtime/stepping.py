"""The models that step, from the saved form of a world; made quickly again when a boat comes or goes.

MuJoCo's specs are kept. When the world's text differs by boats alone these are attached or deleted, and all the rest is
not read again; a model of an edited spec is that of the text to the last byte. Whatever else differs is read anew.
"""

import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from vrx_mj.compiler.world import World
from vrx_mj.errors import CompileError

__all__ = ["Stepping", "stepping_models"]

Models = tuple[mujoco.MjModel, mujoco.MjModel]
SEEN = re.compile(r'<(?:camera|texture|geom [^>]*contype="0" conaffinity="0") ?[^>]*/>')
"""What is only looked at, in the MJCF of a world."""
GEOM, MESH = re.compile(r"<geom [^>]*/>"), re.compile(r'<mesh name="([^"]+)"[^>]*/>')
POINTS = re.compile(r'<mesh name="([^"]+)" vertex="([^"]+)"/>')
"""A mesh that is the hull of points which stand in the MJCF itself."""
MESH_FOLDER = ' meshdir="assets"'
PLACED, END = "\n    <frame ", "\n    </frame>"
"""Around each thing that was placed in a world, as `placed.xml.j2` writes them."""
ROOT = re.compile(r'<body name="(?P<boat>[^"/]+/)(?P<link>[^"]+)"')
"""The first body of something that was placed."""
PAIR, TOUCH = "    <exclude ", '    <contact name="touch/'
SECTIONS = ("  <contact>", "  </contact>", "  <sensor>", "  </sensor>")
"""Lines after the world: pairs that never touch, sensors of what a scored boat touches, and what is around them."""
ASLEEP = (' sleep_tolerance="0"', ' sleep="enable"')
"""What the first ball that is parked adds to the options."""
SLEEP_OPTIONS = ("enableflags", "sleep_tolerance")
SENSOR_FIELDS = ("name", "type", "objtype", "objname", "reftype", "refname", "intprm", "datatype", "needstage", "dim")


def stepping_models(world: World) -> Models:
    """The model that steps, from the saved form without anything that is only looked at, and its quiet twin.

    The twin has no shapes at all; it steps the same data while nothing can touch anything.

    Raises:
        CompileError: MuJoCo refuses the saved world.
    """
    return Stepping().models(world)


class Stepping:
    """The stepping models of a world, and of those that it becomes as boats come and go."""

    def __init__(self) -> None:
        self._text: _Text | None = None
        self._specs: tuple[mujoco.MjSpec, ...] = ()

    def models(self, world: World) -> Models:
        """The same as `stepping_models`, quicker if the world differs by boats from the one before.

        Raises:
            CompileError: MuJoCo refuses the saved world.
        """
        text, before = _Text.of(world.mjcf), self._text
        change = before and text.change(before)
        self._text = None
        try:
            models = self._edited(change) if change else None
            models = models or self._read(world)
        except ValueError as error:
            raise CompileError(f"MuJoCo refuses the saved world {world.name}: {error}") from error
        self._text = text
        return models

    def _edited(self, change: "_Change") -> Models | None:
        """The models of the kept specs after a change; None: MuJoCo refuses it, and reading will tell why."""
        try:
            for spec, only in zip(self._specs, (_solid, _quiet), strict=True):
                change.make(spec, only)
            return self._models()
        except ValueError:
            return None

    def _read(self, world: World) -> Models:
        solid = _solid(world.mjcf).replace(MESH_FOLDER, "", 1)
        used = set(re.findall(r' mesh="([^"]+)"', solid))
        solid = MESH.sub(lambda found: found[0] if found[1] in used else "", solid)
        files = set(re.findall(r' file="([^"]+)"', solid))
        solid, points = _points_in_files(solid)
        assets = {file: world.assets[file] for file in files} | points
        self._specs = (_spec(solid, assets), _spec(_quiet(world.mjcf), {}))
        return self._models()

    def _models(self) -> Models:
        solid, quiet = (spec.compile() for spec in self._specs)
        return solid, quiet


def _spec(text: str, assets: Mapping[str, bytes]) -> mujoco.MjSpec:
    spec = mujoco.MjSpec.from_string(text, assets=dict(assets))
    spec.compiler.discardvisual = True
    return spec


def _solid(text: str) -> str:
    """MJCF without what is only looked at: reading it takes longer than all that is done with it."""
    return SEEN.sub("", text)


def _quiet(text: str) -> str:
    """MJCF without any shape."""
    return MESH.sub("", GEOM.sub("", _solid(text)))


def _points_in_files(text: str) -> tuple[str, dict[str, bytes]]:
    """MJCF with its points in files of MuJoCo's format MSH: hulls of files are kept from one compilation to the next.

    They hold the same numbers: an array of 32 bit floats, without normals, texture or faces.
    """
    files: dict[str, bytes] = {}

    def moved(found: re.Match[str]) -> str:
        points = np.array(found[2].split(), np.float64).astype(np.float32)
        content = np.array([len(points) // 3, 0, 0, 0], np.int32).tobytes() + points.tobytes()
        file = f"points_{hashlib.sha256(content).hexdigest()[:16]}.msh"
        files[file] = content
        return f'<mesh name="{found[1]}" file="{file}"/>'

    return POINTS.sub(moved, text), files


@dataclass(frozen=True)
class _Change:
    """What makes of one world another, which differs by boats."""

    leaving: Sequence[str]
    """Roots that go."""
    prefix: str
    """What the names of all that comes start with."""
    head: str
    """What the other world's MJCF starts with, down to its options."""
    frames: Sequence[str]
    pairs: Sequence[str]
    touches: Sequence[str]
    """What comes, as elements of MJCF: what is placed, pairs that never touch, and sensors."""

    def make(self, spec: mujoco.MjSpec, thinned: Callable[[str], str]) -> None:
        """Change a spec; `thinned` leaves of the text of a frame what the spec has."""
        for name in self.leaving:
            spec.delete(spec.body(name).frame)  # with all that names something in it
        if self.frames:
            child = mujoco.MjSpec.from_string(self._document(thinned))
            for option in SLEEP_OPTIONS:
                setattr(spec.option, option, getattr(child.option, option))
            for frame in list(child.worldbody.frames):
                spec.worldbody.attach_frame(frame, self.prefix, "")
        if self.touches:
            child = mujoco.MjSpec.from_string(f"<mujoco><sensor>{''.join(self.touches)}</sensor></mujoco>")
            for sensor in child.sensors:
                spec.add_sensor(**{field: getattr(sensor, field) for field in SENSOR_FIELDS})

    def _document(self, thinned: Callable[[str], str]) -> str:
        """What comes, alone, its names without their prefix: MuJoCo warns of specs that are attached without one."""
        world = f"<worldbody>{thinned(''.join(self.frames))}</worldbody><contact>{''.join(self.pairs)}</contact>"
        return self.head + world.replace(f'"{self.prefix}', '"') + "</mujoco>"


@dataclass(frozen=True)
class _Text:
    """The MJCF of a world, in the parts by which worlds can differ."""

    head: str
    """Down to the options."""
    items: Sequence[str]
    """What is in the world: what is placed, each in its frame, and what is not."""
    pairs: Sequence[str]
    touches: Sequence[str]
    rest: Sequence[str]
    """Other lines after the world."""

    @staticmethod
    def of(mjcf: str) -> "_Text":
        """The parts of a text that `world.xml.j2` and `compiler.joining` wrote."""
        top, _, below = mjcf.partition("\n  <worldbody>")
        inside, _, tail = below.partition("\n  </worldbody>")
        items = []
        for chunk in inside.split(END):
            other, placed, frame = chunk.partition(PLACED)
            items += [other] * bool(other) + [placed + frame + END] * bool(placed)
        lines = [line for line in tail.splitlines() if line not in SECTIONS]
        pairs, touches = ([line for line in lines if line.startswith(mark)] for mark in (PAIR, TOUCH))
        rest = [line for line in lines if not line.startswith((PAIR, TOUCH))]
        return _Text(top.partition("\n  <asset>")[0], items, pairs, touches, rest)

    def change(self, old: "_Text") -> _Change | None:
        """What makes this of an old text; None if it is more than boats that left, and one that came after all else.

        A boat with meshes to hit is more, too: meshes are shared.
        """
        if self.rest != old.rest or _awake(self.head) != _awake(old.head):
            return None
        known = set(self.items)
        frames = _later([item for item in old.items if item in known], self.items)
        left = [_root(item) for item in old.items if item not in known]
        came = [_root(frame) for frame in frames or ()]
        if frames is None or None in left or None in came or len({boat for boat, _ in filter(None, came)}) > 1:
            return None
        gone = tuple(f'"{boat}' for boat, _ in filter(None, left))  # what names something of them goes with them
        pairs, touches = (
            _later([line for line in before if not any(name in line for name in gone)], now)
            for before, now in ((old.pairs, self.pairs), (old.touches, self.touches))
        )
        if pairs is None or touches is None:
            return None
        prefix = next((boat for boat, _ in filter(None, came)), "")
        return _Change(["".join(root) for root in filter(None, left)], prefix, self.head, frames, pairs, touches)


def _awake(head: str) -> str:
    """The start of a text as it would be if nothing slept in its world."""
    for option in ASLEEP:
        head = head.replace(option, "")
    return head


def _later(stay: Sequence[str], now: Sequence[str]) -> Sequence[str] | None:
    """What comes after all that stays; None if that is not what there is first."""
    return now[len(stay) :] if now[: len(stay)] == stay else None


def _root(item: str) -> tuple[str, str] | None:
    """The first body of something that was placed: what its boat's names start with, and the rest of its name.

    None for what has no body, and for what has meshes to hit: these are shared.
    """
    found = ROOT.search(item) if item.startswith(PLACED) else None
    return None if found is None or ' mesh="' in _solid(item) else (found["boat"], found["link"])
