"""The pieces of a world that was loaded, from its MJCF: saved worlds hold no other trace of them.

The parameters list the names by which a piece is known. Its text is what the file holds, so the MJCF that joins the
pieces again is the same.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from xml.parsers import expat

from markupsafe import Markup, escape

from vrx_mj.mjcf.pieces import PREFIX, Part, Piece, Pieces, hull_file
from vrx_mj.model.world import Parameters

__all__ = ["pieces_of"]

JOINED = ("asset", "worldbody", "contact", "equality", "sensor")
"""Sections that join elements of pieces."""


@dataclass
class _Element:
    """An element of a section, with what is in it."""

    tag: str
    attributes: Mapping[str, str]
    start: int
    """Where it starts in the text [bytes]."""
    end: int = 0
    bodies: list[str] = field(default_factory=list)
    meshes: dict[str, bool] = field(default_factory=dict)
    """Names of meshes, and whether one of their shapes can collide."""
    visuals: list[tuple[int, int]] = field(default_factory=list)
    """Where cameras and shapes that cannot collide are."""
    shapes: list[tuple[int, int]] = field(default_factory=list)
    """Where the other shapes are."""


class _Text:
    """An MJCF cut into the elements of its sections."""

    def __init__(self, mjcf: str) -> None:
        self.sections: list[tuple[_Element, list[_Element]]] = []
        self._text, self._depth, self._open = mjcf.encode(), 0, list[_Element]()
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler, self._parser.EndElementHandler = self._start, self._end
        self._parser.Parse(self._text, True)

    def cut(self, start: int, end: int, without: Iterable[tuple[int, int]] = ()) -> str:
        """The text between two places, without some spans."""
        parts = []
        for first, last in sorted(without):
            parts.append(self._text[start:first])
            start = last
        return b"".join((*parts, self._text[start:end])).decode()

    def elements(self, *sections: str) -> list[_Element]:
        """All elements of sections, in their order."""
        return [element for section, inside in self.sections if section.tag in sections for element in inside]

    def line(self, element: _Element) -> str:
        """An element on a line of its own."""
        return f"\n    {self.cut(element.start, element.end)}"

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        element = _Element(tag, attributes, self._parser.CurrentByteIndex)
        self._open.append(element)
        if len(self._open) == 2:
            self.sections.append((element, []))
        elif len(self._open) == 3:
            self.sections[-1][1].append(element)
        if len(self._open) > 2 and tag == "body" and (name := attributes.get("name")):
            self._open[2].bodies.append(name)

    def _end(self, tag: str) -> None:
        element = self._open.pop()
        element.end = self._text.index(b">", element.start) + 1
        if self._text[element.end - 2 : element.end] != b"/>":
            element.end = self._text.index(b">", self._parser.CurrentByteIndex) + 1
        if len(self._open) > 1 and tag in ("camera", "geom"):
            (*_, whole) = [*self._open, element][:3]
            values = element.attributes
            solid = tag == "geom" and not values.get("contype") == values.get("conaffinity") == "0"
            (whole.shapes if solid else whole.visuals).append((element.start, element.end))
            if mesh := values.get("mesh"):
                whole.meshes[mesh] = solid or whole.meshes.get(mesh, False)


def pieces_of(mjcf: str, files: Mapping[str, bytes], world: Parameters) -> Pieces:
    """The pieces of a world's MJCF, whose form was checked; `world` are its parameters."""
    text = _Text(mjcf)
    meshes = {element.attributes.get("name", ""): element for element in text.elements("asset")}
    names = {hull.body: boat.name for hull, boat in zip(world.hulls, world.boats, strict=True)}
    names |= {item.body: item.name for item in world.objects}
    placed = [item for item in text.elements("worldbody") if item.tag in ("frame", "body")]
    parts = [_part(text, item, names, meshes, files) for item in placed]
    touches = {item.attributes["name"].partition("/")[2]: text.line(item) for item in text.elements("sensor")}
    assets = tuple(text.line(item).strip() for item in text.elements("asset"))
    return Pieces(_own(text, placed, world), tuple(parts), assets, touches)


def _own(text: _Text, placed: list[_Element], world: Parameters) -> Piece:
    """What belongs to nothing that was placed."""
    sections = [section for section, _ in text.sections]
    at = next(index for index, section in enumerate(sections) if section.tag == "option")
    last = max(index for index, section in enumerate(sections) if section.tag in JOINED)
    option = sections[at]
    before = len(text.cut(0, option.start).rstrip().encode())
    own = [item for item in text.elements("worldbody") if item not in placed]
    settings = [text.cut(one.start, one.end) for one in sections[at + 1 : last] if one.tag not in JOINED]
    values = {
        "head": text.cut(0, before),
        "option": text.cut(before, option.end),
        "settings": "".join(f"\n  {section}" for section in settings),
        "whole": "".join(map(text.line, own)),
        "without_visuals": "".join(text.cut(item.start, item.end, item.visuals) for item in own),
        "contact_free": "".join(text.cut(item.start, item.end, [*item.visuals, *item.shapes]) for item in own),
        "tail": text.cut(sections[last].end, -1) + "\n",
    }
    marked = {name: Markup(value) for name, value in values.items()}
    options = {"asleep": False, "timestep": world.timestep, "gravity": world.gravity}
    return Piece("saved.xml.j2", marked | options, {})


def _part(
    text: _Text,
    item: _Element,
    names: Mapping[str, str],
    meshes: Mapping[str, _Element],
    files: Mapping[str, bytes],
) -> Part:
    """Something that was placed."""
    root = item.bodies[0] if item.bodies else "terrain/"
    name = names.get(root, root.partition("/")[0])
    start, end = _inside(text, item)
    used = [meshes[mesh] for mesh in item.meshes if mesh in meshes]
    hulls = {
        mesh: hull_file([float(number) for number in points.split()])
        for mesh in item.meshes
        if mesh in meshes and (points := meshes[mesh].attributes.get("vertex"))
    }
    bodies = set(item.bodies)

    def joined(section: str) -> str:
        return "".join(text.line(one) for one in text.elements(section) if one.attributes.get("body1") in bodies)

    lead = "" if item.tag == "frame" else "\n    "
    values = {
        "assets": "".join(map(text.line, used)),
        "solid_assets": "".join(
            _solid_line(text, meshes[mesh], hulls.get(mesh)) if solid else "\n" for mesh, solid in item.meshes.items()
        ),
        "whole": lead + text.cut(start, end),
        "without_visuals": lead + text.cut(start, end, item.visuals),
        "contact_free": lead + text.cut(start, end, [*item.visuals, *item.shapes]),
        "contacts": joined("contact"),
        "equalities": joined("equality"),
    }
    own = f'"{escape(name)}/'
    marked = {key: Markup(value.replace(own, f'"{PREFIX}')) for key, value in values.items()}
    own_files = [file for mesh in used if (file := mesh.attributes.get("file"))]
    piece = Piece("saved.xml.j2", marked, {file: files[file] for file in own_files}, dict(hulls.values()))
    return Part(name, piece, text.cut(item.start, start) if item.tag == "frame" else "")


def _inside(text: _Text, item: _Element) -> tuple[int, int]:
    """Where the bodies are: within the frame, if there is one."""
    if item.tag != "frame":
        return item.start, item.end
    start = item.start + text.cut(item.start, item.end).index(">") + 1
    return start, start + len(text.cut(start, item.end).rpartition("</")[0].rstrip().encode())


def _solid_line(text: _Text, mesh: _Element, hull: tuple[str, bytes] | None) -> str:
    """A mesh that can be hit; its points are in a file."""
    if hull is None:
        return text.line(mesh)
    return f'\n    <mesh name="{escape(mesh.attributes["name"])}" file="{hull[0]}"/>'
