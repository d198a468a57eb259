"""The models that step, from the saved form of a world; made quickly again when boats come and go.

MuJoCo's specs are kept: a boat that comes is attached to them and the rest is not read again, which takes longer than
all else that is done. A model of such a spec is that of the text, to the last byte. A spec that something was deleted
from would be, too, but deleting takes MuJoCo as long as reading, so without a boat the text is read.
"""

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from vrx_mj.errors import CompileError
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.crowding import arena_bytes, row_arena_bytes

__all__ = ["PhysicsModels", "stepping_models"]

Models = tuple[mujoco.MjModel, mujoco.MjModel]
SEEN = re.compile(r'<(?:camera|texture|geom [^>]*contype="0" conaffinity="0") ?[^>]*/>')
"""What is only looked at, in the MJCF of a world."""
GEOM, MESH = re.compile(r"<geom [^>]*/>"), re.compile(r'<mesh name="([^"]+)"[^>]*/>')
EMPTY = re.compile(r"<frame [^>]*>\s*</frame>")
POINTS = re.compile(r'<mesh name="([^"]+)" vertex="([^"]+)"/>')
"""A mesh that is the hull of points which stand in the MJCF itself."""
FOLDER = ' meshdir="assets"'
"""Names of files without a folder are found faster."""
PLACED, END = "\n    <frame ", "\n    </frame>"
"""Around each thing that was placed in a world, as `placed.xml.j2` writes them."""
PREFIX = re.compile(r'<body name="([^"/]+/)')
"""In something that was placed: what its names start with."""
PAIR, TOUCH = "    <exclude ", '    <contact name="touch/'
SECTIONS = ("  <contact>", "  </contact>", "  <sensor>", "  </sensor>")
"""Lines after the world: pairs that never touch, sensors of what a scored boat touches, and what is around them."""
ASLEEP = (' sleep_tolerance="0"', ' sleep="enable"')
"""What the first ball that is parked adds to the options."""
SLEEP_OPTIONS = ("enableflags", "sleep_tolerance")
SENSOR_FIELDS = ("name", "type", "objtype", "objname", "reftype", "refname", "intprm", "datatype", "needstage", "dim")


def stepping_models(world: World) -> Models:
    """The model that steps, from the saved form without anything that is only looked at, and its quiet twin.

    The twin has no shapes at all; it steps the same data while nothing can touch anything. The model has the memory for
    contacts that its shapes can need (`row_arena_bytes`): thousands of rows may have data of it.

    Raises:
        CompileError: MuJoCo cannot compile the saved world.
    """
    return PhysicsModels(roomy=False).models(world)


class PhysicsModels:
    """The stepping models of a world, and of those that it becomes as boats come and go."""

    def __init__(self, *, roomy: bool = True) -> None:
        """`roomy`: whether there is memory for heaps of what was placed, as a `Simulation` has it but no row."""
        self._roomy = roomy
        self._text: _Text | None = None
        self._specs: tuple[mujoco.MjSpec, mujoco.MjSpec] | None = None
        self._thinned: dict[str, _Thin] = {}
        self._shapes: tuple[tuple[str, frozenset[str]], tuple[str, dict[str, bytes]]] | None = None

    def models(self, world: World) -> Models:
        """The same as `stepping_models`, quicker if the world is much like the one before.

        Raises:
            CompileError: MuJoCo cannot compile the saved world.
        """
        text, before = _Text.of(world.mjcf), self._text
        self._text = None
        self._thinned = {item: self._thinned.get(item) or _Thin.of(item) for item in text.items}
        newcomer = before and text.newcomer(before)
        try:
            models = self._joined(newcomer, text) if newcomer else None
            models = models or self._read(text, world.assets)
        except ValueError as error:
            raise CompileError(f"MuJoCo cannot compile the saved world {world.name}: {error}") from error
        self._text = text
        return models

    def _joined(self, newcomer: "_Newcomer", text: "_Text") -> Models | None:
        """The models of the kept specs with a boat more; None: MuJoCo refuses it, or it has shapes to share."""
        thin = [self._thinned[frame] for frame in newcomer.frames]
        if self._specs is None or any(item.meshes for item in thin):
            return None
        solid, quiet = self._specs
        try:
            newcomer.join(solid, "".join(item.solid for item in thin))
            newcomer.join(quiet, "".join(item.quiet for item in thin))
            return self._compiled(text)
        except ValueError:
            return None  # reading will tell why

    def _read(self, text: "_Text", files: Mapping[str, bytes]) -> Models:
        """The models of a text that is read, without what is only looked at: it saves most of the time."""
        used = frozenset().union(*(thin.meshes for thin in self._thinned.values()))
        if self._shapes is None or self._shapes[0] != (text.top, used):
            self._shapes = (text.top, used), _shapes(text.top, used)
        top, points = self._shapes[1]
        assets = {file: files[file] for file in re.findall(r' file="([^"]+)"', top) if file not in points} | points
        thin = [self._thinned[item] for item in text.items]
        solid = _spec(top, "".join(item.solid for item in thin), text.tail, assets)
        quiet = _spec(MESH.sub("", top), "".join(item.quiet for item in thin), text.tail, {})
        self._specs = solid, quiet
        return self._compiled(text)

    def _compiled(self, text: "_Text") -> Models:
        assert self._specs is not None, "nothing was read"
        solid, quiet = self._specs
        things = sum(item.startswith(PLACED) for item in text.items)
        for spec in self._specs if self._roomy else ():
            spec.memory = arena_bytes(things)
        models = solid.compile(), quiet.compile()
        if self._roomy:
            return models
        for spec, model in zip(self._specs, models, strict=True):
            spec.memory = row_arena_bytes(model)
        return solid.compile(), quiet.compile()


@dataclass(frozen=True)
class _Thin:
    """Something in the world without what is only looked at."""

    solid: str
    quiet: str
    """Without any shape."""
    meshes: frozenset[str]
    """Names of those that can be hit."""

    @staticmethod
    def of(item: str) -> "_Thin":
        solid = _without_visuals(SEEN.sub("", item))
        return _Thin(solid, _without_visuals(GEOM.sub("", solid)), frozenset(re.findall(r' mesh="([^"]+)"', solid)))


def _without_visuals(text: str) -> str:
    """A text without frames in which nothing is left."""
    count = 1
    while count:
        text, count = EMPTY.subn("", text)
    return text


def _shapes(top: str, used: frozenset[str]) -> tuple[str, dict[str, bytes]]:
    """What comes before the world with the meshes that are used, and files of the points that stand in it.

    MuJoCo keeps the hulls of meshes in files from one compilation to the next. In its format MSH these have the same
    numbers: an array of 32 bit floats, without normals, texture or faces.
    """
    files: dict[str, bytes] = {}

    def moved(found: re.Match[str]) -> str:
        points = np.array(found[2].split(), np.float64).astype(np.float32)
        content = np.array([len(points) // 3, 0, 0, 0], np.int32).tobytes() + points.tobytes()
        file = f"points_{hashlib.sha256(content).hexdigest()[:16]}.msh"
        files[file] = content
        return f'<mesh name="{found[1]}" file="{file}"/>'

    top = MESH.sub(lambda found: found[0] if found[1] in used else "", SEEN.sub("", top))
    return POINTS.sub(moved, top.replace(FOLDER, "", 1)), files


def _spec(top: str, world: str, tail: str, assets: Mapping[str, bytes]) -> mujoco.MjSpec:
    text = f"{top}\n  <worldbody>{world}\n  </worldbody>{tail}"
    spec = mujoco.MjSpec.from_string(text, assets=dict(assets))
    spec.compiler.discardvisual = True
    return spec


@dataclass(frozen=True)
class _Newcomer:
    """A boat that comes, as elements of MJCF."""

    prefix: str
    """What its names start with."""
    head: str
    """What the new world's MJCF starts with, down to its options."""
    frames: Sequence[str]
    """The boat, and its balls."""
    pairs: Sequence[str]
    touches: Sequence[str]

    def join(self, spec: mujoco.MjSpec, frames: str) -> None:
        """Attach it to a spec, with what that is to have of its frames."""
        # without its prefix, which comes with attaching: MuJoCo warns of an empty one
        own = f"<worldbody>{frames}</worldbody><contact>{''.join(self.pairs)}</contact>".replace(f'"{self.prefix}', '"')
        boat = mujoco.MjSpec.from_string(f"{self.head}{own}</mujoco>")
        for option in SLEEP_OPTIONS:
            setattr(spec.option, option, getattr(boat.option, option))
        for frame in list(boat.worldbody.frames):
            spec.worldbody.attach_frame(frame, self.prefix, "")
        if self.touches:
            scored = mujoco.MjSpec.from_string(f"<mujoco><sensor>{''.join(self.touches)}</sensor></mujoco>")
            for sensor in scored.sensors:
                spec.add_sensor(**{field: getattr(sensor, field) for field in SENSOR_FIELDS})


@dataclass(frozen=True)
class _Text:
    """The MJCF of a world, in the parts by which worlds can differ."""

    top: str
    """Down to the world."""
    items: Sequence[str]
    """What is in the world: what is placed, each in its frame, and what is not."""
    tail: str

    @staticmethod
    def of(mjcf: str) -> "_Text":
        """The parts of a text that `world.xml.j2` and `compiler.joining` wrote."""
        top, _, below = mjcf.partition("\n  <worldbody>")
        inside, _, tail = below.partition("\n  </worldbody>")
        items = []
        for chunk in inside.split(END):
            other, placed, frame = chunk.partition(PLACED)
            items += [other] * bool(other) + [placed + frame + END] * bool(placed)
        return _Text(top, items, tail)

    @property
    def head(self) -> str:
        """Down to the options."""
        return self.top.partition("\n  <asset>")[0]

    def newcomer(self, old: "_Text") -> _Newcomer | None:
        """Who is here and was not in an old text; None if that is not one boat that came after all else."""
        if _awake(self.head) != _awake(old.head):
            return None
        (*pairs, rest), (*before, former) = _lines(self.tail), _lines(old.tail)
        came = [_later(now, then) for now, then in zip((self.items, *pairs), (old.items, *before), strict=True)]
        if rest != former or any(part is None for part in came):
            return None
        frames, new_pairs, new_touches = (part or () for part in came)
        found = [PREFIX.search(frame) if frame.startswith(PLACED) else None for frame in frames]
        prefixes = {match and match[1] for match in found}
        prefix = prefixes.pop() if len(prefixes) == 1 else None
        return _Newcomer(prefix, self.head, frames, new_pairs, new_touches) if prefix else None


def _awake(head: str) -> str:
    """The start of a text as it would be if nothing slept in its world."""
    for option in ASLEEP:
        head = head.replace(option, "")
    return head


def _lines(tail: str) -> tuple[list[str], list[str], list[str]]:
    """Pairs that never touch, sensors of what a scored boat touches, and the other lines after a world."""
    lines = [line for line in tail.splitlines() if line not in SECTIONS]
    pairs, touches = ([line for line in lines if line.startswith(mark)] for mark in (PAIR, TOUCH))
    return pairs, touches, [line for line in lines if not line.startswith((PAIR, TOUCH))]


def _later(now: Sequence[str], then: Sequence[str]) -> Sequence[str] | None:
    """What comes after all that there was; None if that is not what there is first."""
    return now[len(then) :] if now[: len(then)] == then else None
