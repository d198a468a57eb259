"""Pieces of MJCF that make up a world, each rendered once for its kind and placed under a name, joined at the end.

The MJCF of a world joins whole pieces. Models that step leave out what is only seen, or all shapes. For each element
that it reads, MuJoCo goes over all that it has read before, so many pieces are read in groups.
"""

import hashlib
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from itertools import groupby, takewhile

import mujoco
import numpy as np
import numpy.typing as npt
from markupsafe import Markup, escape

from vrx_mj.frames import Pose
from vrx_mj.mjcf.templates import render

PREFIX = "@prefix@/"
"""Prefix of names in a piece until it has a place in a world."""
MIN_GROUPED, _GROUP_SIZE = 100, 50
"""Number of parts above which they are read in groups, and number of parts in a group."""
_SLEEP_OPTIONS = ("enableflags", "sleep_tolerance")
"""Options that the first sleeping part changes."""
_SENSOR_FIELDS = ("name", "type", "objtype", "objname", "reftype", "refname", "intprm", "datatype", "needstage", "dim")
"""Fields of a sensor that are copied."""
_MESH_FIELDS = ("name", "file", "scale", "inertia")
"""Fields of a mesh that are copied."""
_SECTIONS = {
    "assets": "asset", "bodies": "worldbody", "contacts": "contact", "equalities": "equality", "sensors": "sensor",
}  # fmt: skip
"""Tags of the sections of a piece that hold its elements, by the names of their blocks."""
_BODY_KEYS = ("body1", "body2", "subtree2")
"""Attributes that name a body."""
_COMPILED, _MAX_COMPILED = set[str](), 4096
"""Digests of pieces that MuJoCo has compiled, and how many of them are remembered."""


class Detail(Enum):
    """Level of detail of a model of a world."""

    WHOLE = "whole"
    """Everything, as the saved MJCF has it."""
    VISUALS = "visuals"
    """Bodies and what is only seen."""
    WITHOUT_VISUALS = "without visuals"
    """Bodies and shapes that can move or collide."""
    CONTACT_FREE = "contact-free"
    """Bodies that can move, without any shape."""


@dataclass(frozen=True)
class Piece:
    """One kind of thing as an MJCF document. Its names, but for those of shared meshes, start with `PREFIX`."""

    text: str
    """The document."""
    files: Mapping[str, bytes]
    """Contents of the files that it names, by file name."""

    @staticmethod
    def from_template(template: str, files: Mapping[str, bytes], **values: object) -> "Piece":
        """The piece that a template makes of values."""
        return Piece(render(template, prefix=PREFIX, **values), files)

    @cached_property
    def file(self) -> str:
        """Name of the file that holds it in a saved world."""
        return f"piece_{hashlib.sha256(self.text.encode()).hexdigest()[:16]}.xml"

    @cached_property
    def digest(self) -> str:
        """SHA-256 of its document and files."""
        contents = [(name, hashlib.sha256(content).hexdigest()) for name, content in self.files.items()]
        return hashlib.sha256(repr((self.text, contents)).encode()).hexdigest()

    @cached_property
    def blocks(self) -> Mapping[str, str]:
        """Elements of its sections: `assets`, `bodies`, `contacts`, `equalities`, `sensors`; `head` and `tail`."""
        blocks, rest = {"head": ""}, self.text
        for name, tag in _SECTIONS.items():
            before, opened, inside = rest.partition(f"<{tag}>")
            if opened and (name in ("assets", "bodies") or not before.strip()):
                blocks["head"] += before.rstrip()
                blocks[name], _, rest = inside.partition(f"</{tag}>")
        return dict.fromkeys(_SECTIONS, "") | {name: block.rstrip() for name, block in blocks.items()} | {"tail": rest}

    def block(self, name: str, detail: Detail = Detail.WHOLE) -> str:
        """A block of the piece, of `bodies` what a detail has of them."""
        if name != "bodies" or detail is Detail.WHOLE:
            return self.blocks[name]
        return self._visuals if detail is Detail.VISUALS else self._details[detail]

    @cached_property
    def _details(self) -> Mapping[Detail, str]:
        """Bodies of the piece without cameras and visual shapes, and without any shape."""
        root = _parse(self.blocks["bodies"])
        return {
            Detail.WITHOUT_VISUALS: _text_without(root, _is_visual),
            Detail.CONTACT_FREE: _text_without(root, _is_shape),
        }

    @cached_property
    def _visuals(self) -> str:
        """Bodies of the piece without shapes that can collide."""
        return _text_without(_parse(self.blocks["bodies"]), lambda one: _is_shape(one) and not _is_visual(one))

    @cached_property
    def hulls(self) -> Mapping[str, bytes]:
        """Files of the points that its meshes have: MuJoCo keeps the hulls of files from one world to the next."""
        return dict(self._points.values())

    @cached_property
    def _points(self) -> Mapping[str, tuple[str, bytes]]:
        """Name and content of the file of points of each mesh that has its points in the MJCF."""
        named = ((mesh.get("name", ""), mesh.get("vertex")) for mesh in _parse(self.blocks["assets"]).iter("mesh"))
        return {name: hull_file([float(number) for number in points.split()]) for name, points in named if points}

    @cached_property
    def assets(self) -> Mapping[str, Mapping[Detail, str]]:
        """Assets of the piece, an element each, with what a detail has of each."""
        shapes = [*_parse(self.blocks["bodies"]).iter("geom")]
        solid, seen = (
            {shape.get("mesh") for shape in shapes if _is_visual(shape) is visual} for visual in (False, True)
        )
        found = {}
        for element in _parse(self.blocks["assets"]):
            line, name = _text_of([element]).strip(), element.get("name", "")
            file = self._points[name][0] if name in self._points else ""
            left = f'<mesh name="{escape(name)}" file="{file}"/>' if file else line
            visual = "" if element.tag == "mesh" and name not in seen else line
            found[line] = {Detail.WITHOUT_VISUALS: left if name in solid else "", Detail.VISUALS: visual}
        return found

    @cached_property
    def is_prefixed(self) -> bool:
        """Whether the names of its bodies, joints and shapes start with `PREFIX`, and there are bodies."""
        bodies = self.blocks["bodies"]
        return "<body " in bodies and bodies.count(' name="') == bodies.count(f' name="{PREFIX}')

    @cached_property
    def owners(self) -> AbstractSet[str]:
        """First parts of the names of its bodies."""
        return {owner_of(body.get("name", "")) for body in _parse(self.blocks["bodies"]).iter("body")}

    def without(self, owners: AbstractSet[str]) -> "Piece":
        """The piece without the bodies of some boats, objects and docks, and without references to them."""
        blocks = {name: _without(self.blocks[name], owners) for name in _SECTIONS if name != "assets"}
        return self if blocks.items() <= self.blocks.items() else self.with_blocks(**blocks)

    def with_blocks(self, **blocks: str) -> "Piece":
        """The piece with other blocks."""
        return Piece(_document(**{**self.blocks, **blocks}), self.files)

    def document(self, name: str = "piece") -> str:
        """MJCF of the piece alone, as a model called `name`, its names without a prefix."""
        blocks = {**self.blocks, "head": self.blocks["head"].replace('"piece"', f'"{escape(name)}"', 1)}
        return _document(**blocks).replace(PREFIX, "")


@dataclass(frozen=True)
class Part:
    """A piece under its name in a world."""

    name: str
    piece: Piece
    pose: Pose | None = None
    """Pose of the frame around its bodies [m, rad]; None: they need none."""

    def block(self, name: str, detail: Detail = Detail.WHOLE, *, skipped: int = 0) -> str:
        """A block of its piece, with its own names, which lack the first `skipped` characters."""
        return self._rename(self.piece.block(name, detail), skipped)

    def _rename(self, text: str, skipped: int = 0) -> str:
        return text.replace(PREFIX, escape(f"{self.name}/"[skipped:]))

    def bodies(self, detail: Detail, skipped: int = 0) -> str:
        """Bodies of the piece in their frame; names lack the first `skipped` characters."""
        text = self.block("bodies", detail, skipped=skipped)
        return f"\n    {self._frame}{text}\n    </frame>" if self.pose else text

    @cached_property
    def _frame(self) -> str:
        return render("frame.xml.j2", pose=self.pose)

    @cached_property
    def assets(self) -> Mapping[str, Mapping[Detail, str]]:
        """Assets of the piece, an element each, with what a detail has of each."""
        return {
            self._rename(line): {detail: self._rename(left) for detail, left in lefts.items()}
            for line, lefts in self.piece.assets.items()
        }

    @property
    def owner(self) -> str:
        """The boat, dock or object that it is a part of: itself, or the boat whose ball it is."""
        return owner_of(self.name)

    @property
    def is_prefixed(self) -> bool:
        """Whether the names of its bodies, joints and geoms start with its own name."""
        return self.name[0].isalnum() and self.piece.is_prefixed


def owner_of(name: str) -> str:
    """The boat, object or dock to which a body, a sensor, a ball or a part of an object belongs, by its name."""
    return name.partition("/")[0]


@dataclass(frozen=True)
class Pieces:
    """All pieces of a world, in the order of its MJCF."""

    own: Piece
    """Head, sky and water of the world, and sensors of what the boat that a task scores touches.

    In a world that was saved without its pieces it holds everything."""
    parts: tuple[Part, ...] = ()
    """Boats, docks, objects and what else was placed."""

    @cached_property
    def assets(self) -> Mapping[str, Mapping[Detail, str]]:
        """All assets, an element each, with what a detail has of each."""
        found = dict(self.own.assets)
        for part in self.parts:
            found |= part.assets
        return found

    @cached_property
    def files(self) -> Mapping[str, bytes]:
        """Contents of the files that are named, by file name."""
        return {file: content for piece in self._kinds for file, content in piece.files.items()}

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything that goes into MuJoCo's models."""
        parts = [(part.name, part.pose, part.piece.digest) for part in self.parts]
        return hashlib.sha256(repr((self.own.digest, parts)).encode()).hexdigest()

    @property
    def _kinds(self) -> list[Piece]:
        """Each piece once."""
        return list({id(piece): piece for piece in (self.own, *(part.piece for part in self.parts))}.values())

    def with_parts(self, parts: Iterable[Part], *, option: str = "", touches: str = "") -> "Pieces":
        """The pieces with `parts` after all others, `option` as element of options, and `touches` as more sensors."""
        head, sensors = self.own.blocks["head"], self.own.blocks["sensors"] + touches
        if option:
            before, _, rest = head.partition("<option ")
            head = before + option + rest.partition("</option>")[2]
        own = self.own.with_blocks(head=head, sensors=sensors) if option or touches else self.own
        return Pieces(own, (*self.parts, *parts))

    def without(self, *owners: str) -> "Pieces":
        """The pieces without boats and their balls, objects with their parts, or docks, and what only they use."""
        return Pieces(self.own.without({*owners}), tuple(part for part in self.parts if part.owner not in owners))

    def first_of_each_kind(self) -> "Pieces":
        """The pieces with one boat, dock and object of each kind: if MuJoCo takes these, it takes all of them."""
        groups: dict[str, list[Part]] = {part.name: [] for part in self.parts}
        for part in self.parts:
            groups[part.owner if part.owner in groups else part.name].append(part)
        kinds: dict[object, list[Part]] = {}
        for name, group in groups.items():
            kinds.setdefault(tuple((id(part.piece), part.name.removeprefix(name)) for part in group), group)
        parts = tuple(part for group in kinds.values() for part in group)
        left = {part.owner for part in self.parts} - {part.owner for part in parts}
        return Pieces(self.own.without(left), parts)

    def check(self) -> None:
        """Compile one boat, dock and object of each kind in MuJoCo, unless this process has done so.

        Raises:
            ValueError: MuJoCo refuses the MJCF.
        """
        one = self.first_of_each_kind()
        if one.digest not in _COMPILED:
            try:
                one.spec().compile()
            except ValueError:
                self.spec().compile()
            if len(_COMPILED) == _MAX_COMPILED:
                _COMPILED.clear()
            _COMPILED.add(one.digest)

    def text(self) -> str:
        """The MJCF of the world."""
        return self._document(self.parts, Detail.WHOLE)

    def spec(self, detail: Detail = Detail.WHOLE) -> mujoco.MjSpec:
        """The MuJoCo spec, with what `detail` leaves in it.

        Raises:
            ValueError: MuJoCo refuses the MJCF.
        """
        first, *groups = self._groups()
        spec = mujoco.MjSpec.from_string(self._document(first, detail), assets=self._files(detail))
        spec.compiler.discardvisual = detail in (Detail.WITHOUT_VISUALS, Detail.CONTACT_FREE)
        for group in groups:
            self._attach(spec, group, detail)
        return spec

    def grow_spec(self, spec: mujoco.MjSpec, before: "Pieces", detail: Detail) -> bool:
        """Attach to `spec`, that of `before` in a `detail`, the parts that came last; return whether that is possible.

        Raises:
            ValueError: MuJoCo refuses them; the spec cannot be used any more.
        """
        count = len(before.parts)
        new = self.parts[count:]
        plain = all(part.is_prefixed and not part.block("equalities").strip() for part in new)
        if not plain or self.parts[:count] != before.parts or len({part.name[0] for part in new}) != 1:
            return False
        known = {*before._elements(detail)}
        if more := [element for element in self._elements(detail) if element not in known]:
            spec.assets |= self._files(detail)
            for mesh in mujoco.MjSpec.from_string(f"<mujoco><asset>{_lines(more)}</asset></mujoco>").meshes:
                spec.add_mesh(**{name: getattr(mesh, name) for name in _MESH_FIELDS})
        self._attach(spec, new, detail, with_contacts=True)
        touches = self.own.blocks["sensors"].removeprefix(before.own.blocks["sensors"])
        read = mujoco.MjSpec.from_string(f"<mujoco><sensor>{touches}</sensor></mujoco>").sensors if touches else []
        for sensor in read:
            spec.add_sensor(**{name: getattr(sensor, name) for name in _SENSOR_FIELDS})
        return True

    def spec_of(self, name: str) -> mujoco.MjSpec:
        """The spec of the part called `name` alone, with all that is seen of it."""
        part = next(part for part in self.parts if part.name == name)
        text = _document(
            head=self.own.blocks["head"],
            assets=_lines(filter(None, (lefts[Detail.VISUALS] for lefts in part.assets.values()))),
            bodies=part.bodies(Detail.VISUALS),
            tail="\n</mujoco>",
        )
        return mujoco.MjSpec.from_string(text, assets=dict(part.piece.files))

    def _document(self, parts: Sequence[Part], detail: Detail) -> str:
        """An MJCF of all but the bodies of other parts than these."""
        pairs = {
            name: self.own.blocks[name] + "".join(part.block(name) for part in self.parts)
            for name in ("contacts", "equalities")
        }
        bodies = self.own.block("bodies", detail) + "".join(part.bodies(detail) for part in parts)
        return _document(**{**self.own.blocks, **pairs, "assets": _lines(self._elements(detail)), "bodies": bodies})

    def _elements(self, detail: Detail) -> Iterable[str]:
        """Assets of the piece with what a detail leaves in them."""
        if detail is Detail.WHOLE:
            return self.assets
        return filter(None, (lefts.get(detail) for lefts in self.assets.values()))

    def _files(self, detail: Detail) -> dict[str, bytes]:
        """Contents of the files that these name, by file name."""
        if detail is Detail.CONTACT_FREE:
            return {}
        kinds = self._kinds if detail is Detail.WITHOUT_VISUALS else ()
        return {**self.files, **dict(pair for piece in kinds for pair in piece.hulls.items())}

    def _groups(self) -> list[Sequence[Part]]:
        """The parts that are read together; but for the first ones, names of a group have one first letter."""
        fixed = list(takewhile(lambda part: not part.is_prefixed, self.parts))
        others = self.parts[len(fixed) :]
        runs = [list(run) for _, run in groupby(others, key=lambda part: part.name[0])]
        groups = [run[start : start + _GROUP_SIZE] for run in runs for start in range(0, len(run), _GROUP_SIZE)]
        many = len(self.parts) > max(MIN_GROUPED, 10 * len(groups))
        return [fixed, *groups] if many and all(part.is_prefixed for part in others) else [self.parts]

    def _attach(
        self, spec: mujoco.MjSpec, group: Sequence[Part], detail: Detail, *, with_contacts: bool = False
    ) -> None:
        """Attach parts, with what is asleep among them; MuJoCo wants a prefix, the first letter of all their names."""
        bodies = "".join(part.bodies(detail, 1) for part in group)
        contacts = "".join(part.block("contacts", skipped=1) for part in group) if with_contacts else ""
        inside = f"<worldbody><frame>{bodies}</frame></worldbody><contact>{contacts}</contact>"
        child = mujoco.MjSpec.from_string(f"{self.own.blocks['head']}{inside}</mujoco>")
        for option in _SLEEP_OPTIONS:
            setattr(spec.option, option, getattr(child.option, option))
        shared = [(geom, geom.meshname) for geom in child.geoms if geom.meshname]
        spec.worldbody.attach_frame(child.worldbody.first_frame(), group[0].name[0], "")
        for geom, mesh in shared:
            geom.meshname = mesh


def hull_file(points: npt.ArrayLike) -> tuple[str, bytes]:
    """Name and content of a file with points (n, 3) [m], in MuJoCo's format MSH, without normals, texture and faces.

    Its numbers are those that MuJoCo has of points in the MJCF: floats of 32 bits.
    """
    array = np.asarray(points, np.float64).reshape(-1, 3).astype(np.float32)
    content = np.array([len(array), 0, 0, 0], np.int32).tobytes() + array.tobytes()
    return f"points_{hashlib.sha256(content).hexdigest()[:16]}.msh", content


def _document(*, head: str, tail: str, **sections: str) -> str:
    """An MJCF of blocks, without the sections that are empty."""
    blocks = dict.fromkeys(_SECTIONS, "") | {"head": head, "tail": tail} | sections
    return render("joined.xml.j2", **{name: Markup(block) for name, block in blocks.items()})


def _lines(elements: Iterable[str]) -> str:
    return "".join(f"\n    {element}" for element in elements)


def _parse(block: str) -> ET.Element:
    """The elements of a block in one."""
    return ET.fromstring(f"<block>{block}</block>")


def _text_of(elements: Iterable[ET.Element]) -> str:
    """The block that consists of elements."""
    inside = "".join(ET.tostring(element, "unicode") for element in elements)
    return f"\n    {inside.replace(' />', '/>')}".rstrip()


def _text_without(root: ET.Element, is_left_out: Callable[[ET.Element], bool]) -> str:
    """The block that consists of elements, from which those that are left out are removed."""
    for element in list(root.iter()):
        for child in filter(is_left_out, list(element)):
            element.remove(child)
    return _text_of(root)


def _is_shape(element: ET.Element) -> bool:
    return element.tag in ("camera", "geom")


def _is_visual(element: ET.Element) -> bool:
    """Whether an element is only seen: a camera, or a shape that cannot collide."""
    collides = not element.get("contype") == element.get("conaffinity") == "0"
    return _is_shape(element) and not (element.tag == "geom" and collides)


def _without(block: str, owners: AbstractSet[str]) -> str:
    """A block without the elements in which bodies of some boats, objects and docks are named."""
    root = _parse(block)
    gone = [element for element in root if any(owner_of(body) in owners for body in _bodies_in(element))]
    for element in gone:
        root.remove(element)
    return _text_of(root) if gone else block


def _bodies_in(element: ET.Element) -> list[str]:
    """Names of the bodies that an element has or refers to."""
    own = [body.get("name", "") for body in element.iter("body")]
    return own + [name for key in _BODY_KEYS if (name := element.get(key))]
