"""Whether a saved world is one that we wrote: checked before anything of it runs, as it may come from somebody else.

MJCF can name files anywhere, plugins, and tables of any size. What the templates write needs few elements and
attributes: a text is accepted if it has no others. Its lexical form is as narrow, so that nothing hides in a comment or
an entity from one reader and is seen by another.
"""

import hashlib
import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Annotated

from pydantic import FailFast, Field, StringConstraints, TypeAdapter, ValidationError

from vrx_mj.config.docks import LIGHT_COLORS, OFF, SHAPES, SYMBOLS
from vrx_mj.config.loading import fault_text
from vrx_mj.config.tree import literal
from vrx_mj.constants import LONGEST_STEP, SHORTEST_STEP
from vrx_mj.errors import LONGEST_VALUE, StateError
from vrx_mj.formats.urdf.reader import is_binary_stl
from vrx_mj.mjcf.pieces import PREFIX, Part, Piece, Pieces, owner_of
from vrx_mj.model.kinds import MAX_NAME, MAX_NUMBER, Pose, record, record_from
from vrx_mj.model.world import FORMAT, FORMER, Parameters, broken_references, format_of, parameters_of, tree_of

_MOST_CHARACTERS = 100_000_000
"""Longest text that is read [characters]."""
_MAX_DEPTH = 500
"""Largest number of elements inside each other."""
_MOST_PIXELS = 8192
"""Largest edge of a picture."""

_TOKEN = re.compile(r'\s+|<!--[^<>]*-->|</[a-z]+>|<[a-z]+(?:\s+[a-z][a-z0-9_]*="[^"<>]*")*\s*/?>')
"""A token of the XML that we write: white space, a comment or a tag."""
_NUMBER = re.compile(r"[-+]?\d{1,40}(?:\.\d{0,40})?(?:[eE][-+]?\d{1,4})?")
"""A number as we write it."""

_Check = Callable[[str], object]
ATTRIBUTES: Mapping[str, Sequence[str]] = {
    tag: attributes.split()
    for tag, attributes in {
        "mujoco": "model",
        "compiler": "angle eulerseq meshdir",
        "option": "timestep gravity solver jacobian sleep_tolerance",
        "flag": "warmstart autoreset sleep",
        "statistic": "center extent",
        "visual": "",
        "headlight": "ambient diffuse specular",
        "map": "znear zfar fogstart fogend",
        "rgba": "fog haze",
        "quality": "shadowsize",
        "global": "offwidth offheight",
        "asset": "",
        "texture": "name type builtin rgb1 rgb2 width height",
        "material": "name rgba specular shininess reflectance",
        "mesh": "name file scale inertia vertex",
        "worldbody": "",
        "light": "name type pos dir diffuse specular castshadow",
        "frame": "pos euler",
        "body": "name pos euler gravcomp sleep",
        "freejoint": "name align",
        "joint": "name type pos axis range limited damping frictionloss stiffness springref",
        "inertial": "pos quat mass diaginertia fullinertia",
        "geom": "name type mesh material size pos euler rgba mass solref group contype conaffinity priority",
        "camera": "name pos xyaxes fovy resolution",
        "contact": "name body1 body2 subtree2 data num",
        "exclude": "body1 body2",
        "equality": "",
        "connect": "body1 body2 anchor solref solimp",
        "weld": "name body1 body2 solref solimp",
        "sensor": "",
        "custom": "",
        "text": "name data",
    }.items()
}
"""Elements that we write, and their attributes."""
_WORDS = {
    "compiler.angle": "radian", "compiler.eulerseq": "XYZ", "compiler.meshdir": "assets",
    "option.solver": "Newton", "option.jacobian": "sparse", "option.sleep_tolerance": "0",
    "flag.warmstart": "enable disable", "flag.autoreset": "disable", "flag.sleep": "enable disable",
    "texture.type": "skybox", "texture.builtin": "gradient", "mesh.inertia": "shell",
    "light.type": "directional", "light.castshadow": "true false", "body.sleep": "init", "freejoint.align": "false",
    "joint.type": "hinge slide ball", "joint.limited": "true false",
    "geom.type": "plane sphere capsule ellipsoid cylinder box mesh", "contact.data": "found", "contact.num": "1",
}  # fmt: skip
"""Words that an attribute may have."""
_MOST_ASSETS, _MOST_TRIANGLES = 10_000, 200_000
"""Largest number of files that an MJCF names, and of triangles in one."""
_LARGEST_ASSETS = 500_000_000
"""Largest size of these files together [bytes]."""
_CORNERS = re.compile(rb"^[ \t]*f([^\n]*)", re.MULTILINE)
"""Line of an OBJ file that lists the corners of a face."""
_HASH = re.compile(r"_([0-9a-f]{12,16})\.(?:obj|stl|xml)$")
"""End of a file's name: the first digits of its content's SHA-256."""
_TOUCH = "touch"
"""First word of the names of contact sensors; the name of the other body follows."""


def _numbers(value: str) -> bool:
    return all(_NUMBER.fullmatch(part) and abs(float(part)) <= MAX_NUMBER for part in value.split())


def _pixels(value: str) -> bool:
    return all(re.fullmatch(r"[0-9]{1,5}", part) and int(part) <= _MOST_PIXELS for part in value.split())


def _at_most(length: int) -> _Check:
    return lambda value: len(value) <= length


_CHECKS: Mapping[str, _Check] = {
    **dict.fromkeys(("name", "mesh", "material", "body1", "body2", "subtree2"), _at_most(MAX_NAME)),
    **dict.fromkeys(("mujoco.model", "text.data"), _at_most(100_000)),
    **dict.fromkeys(("width", "height", "offwidth", "offheight", "shadowsize", "resolution"), _pixels),
    **dict.fromkeys(("group", "contype", "conaffinity", "priority"), _pixels),
    **{attribute: frozenset(words.split()).__contains__ for attribute, words in _WORDS.items()},
    "option.timestep": lambda value: _numbers(value) and SHORTEST_STEP <= float(value) <= LONGEST_STEP,
    "mesh.file": re.compile(r"[A-Za-z0-9_]{1,100}\.(obj|stl)").fullmatch,
}
"""Checks of attributes' values, by `element.attribute` or by its name alone; all others hold numbers."""


class Contents:
    """Contents of an MJCF, by name.

    Args:
        root: its elements.

    Raises:
        ValueError: there are elements or attributes that no world has, or names that do not tell bodies apart.
    """

    def __init__(self, root: ET.Element) -> None:
        if root.tag != "mujoco":
            raise ValueError(f"<mujoco> is needed, got <{root.tag}>")
        self.joints: dict[str, tuple[tuple[str, str], ...]] = {}
        """Joints of every body, each as type and name; `free` for a free joint."""
        self.parents: dict[str, str] = {}
        """The body that each body hangs on; empty for one in the world."""
        stack = [(root, "", 0)]
        while stack:
            element, body, depth = stack.pop()
            if depth > _MAX_DEPTH:
                raise ValueError(f"elements are nested too deeply; at most {_MAX_DEPTH}")
            _check_element(element)
            name = element.get("name", "")
            if element.tag == "body":
                if not name or name in self.joints:
                    raise ValueError(f"invalid name '{name}' of <body>: a unique one is needed")
                self.joints[name], self.parents[name], body = (), body, name
            elif element.tag in {"joint", "freejoint"}:
                if body not in self.joints:
                    raise ValueError(f"invalid <{element.tag}> '{name}': it is in no body")
                kind = "free" if element.tag == "freejoint" else element.get("type", "hinge")
                self.joints[body] += ((kind, name),)
            stack += [(child, body, depth + 1) for child in reversed(element)]
        steps = [element.get("timestep", "0") for element in root.iter("option")]
        self.timestep = float(steps[-1]) if steps else 0.0
        """Physics step [s]."""
        self.files = dict.fromkeys(file for element in root.iter("mesh") if (file := element.get("file")))
        """Names of the files, in their order."""
        self.geoms = {element.get("name") for element in root.iter("geom")}
        """Names of geoms."""
        self.touches = [touch for element in root.iter("contact") if (touch := element.get("name"))]
        """Names of the contact sensors, in their order."""


def contents_of(mjcf: str, source: object) -> Contents:
    """Contents of an MJCF that we wrote; `source` names it in messages.

    Raises:
        StateError: it is not one that we write.
    """
    if len(mjcf) > _MOST_CHARACTERS:
        raise StateError(f"{source} has {len(mjcf):,} characters; at most {_MOST_CHARACTERS:,} are read")
    try:
        _check_tokens(mjcf)
        return Contents(ET.fromstring(mjcf))
    except (ValueError, ET.ParseError) as error:
        raise StateError(f"{source} is damaged: {error}") from None


def _check_tokens(mjcf: str) -> None:
    """Whether there are only tags with attributes in double quotes, blanks, and comments without tags."""
    end = 0
    while found := _TOKEN.match(mjcf, end):
        end = found.end()
    if end < len(mjcf):
        line = mjcf.count("\n", 0, end) + 1
        raise ValueError(f"line {line}: a tag is needed, got '{mjcf[end : end + LONGEST_VALUE].splitlines()[0]}'")


def _check_element(element: ET.Element) -> None:
    known = ATTRIBUTES.get(element.tag)
    if known is None:
        raise ValueError(f"invalid element <{element.tag[:LONGEST_VALUE]}>: not part of a world")
    for key, value in element.attrib.items():
        if key not in known:
            raise ValueError(f"invalid attribute {key[:LONGEST_VALUE]} of <{element.tag}>: not part of a world")
        check = _CHECKS.get(f"{element.tag}.{key}") or _CHECKS.get(key, _numbers)
        if not check(value):
            shown = value if len(value) <= LONGEST_VALUE else value[:LONGEST_VALUE] + "..."
            raise ValueError(f"invalid {key} '{shown}' of <{element.tag}>")


_PieceFile = Annotated[str, StringConstraints(pattern=r"^piece_[0-9a-f]{16}\.xml$")]


@record
class _SavedPart:
    """A piece and its place in a world."""

    name: Annotated[str, StringConstraints(min_length=1, max_length=MAX_NAME)]
    """Name of the part."""
    piece: _PieceFile
    """Name of the piece's file."""
    pose: Pose | None
    """Pose of the frame around its bodies [m, rad]; None: they need none."""


@record
class _Index:
    """List of the pieces of a world."""

    own: _PieceFile
    """File of the world's own piece."""
    parts: Annotated[tuple[_SavedPart, ...], Field(max_length=100_000), FailFast()]
    """Parts of the world, in the order of the MJCF."""


_INDEX = TypeAdapter(_Index)


def piece_files(pieces: Pieces, name: str) -> dict[str, str]:
    """Texts of the files of pieces and of their list, by relative path; `name` is that of the world's files."""
    parts = tuple(record_from(_SavedPart, part, piece=part.piece.file) for part in pieces.parts)
    index = json.dumps(tree_of(_Index(own=pieces.own.file, parts=parts)), indent=1) + "\n"
    kinds = {pieces.own.file: pieces.own, **{part.piece.file: part.piece for part in pieces.parts}}
    return {f"{name}.pieces.json": index, **{f"pieces/{file}": piece.text for file, piece in kinds.items()}}


def read_world(read: Callable[[str], bytes], name: str, place: str) -> tuple[Pieces, Parameters]:
    """The pieces and the parameters of a saved world.

    Args:
        read: gives a file's content by its path in the world's folder.
        name: of the world's files.
        place: comes before these paths in messages.

    Raises:
        StateError: a part is damaged or of another version, or the parts do not belong together.
    """
    source, scene = f"{place}{name}.json", f"{place}{name}.xml"
    typed = _read_parameters(read(f"{name}.json"), source)
    mjcf = _decode(read(f"{name}.xml"), scene)
    contents = contents_of(mjcf, scene)
    faults = chain(broken_references(typed), _signs(typed), _unlike(typed, contents))
    if fault := next(faults, None):  # what comes later trusts what came before
        raise StateError(f"{source} is damaged: {fault}")
    assets = _assets(contents.files, lambda file: read(f"assets/{file}"), scene)
    pieces = Pieces(_whole(Piece(mjcf, assets), scene))
    if typed.format == FORMAT and (parts := _pieces(read, name, place, assets)).text() == mjcf:
        pieces = parts  # an MJCF that somebody has edited is one piece
    return pieces, replace(typed, format=FORMAT)


def _pieces(read: Callable[[str], bytes], name: str, place: str, assets: Mapping[str, bytes]) -> Pieces:
    """The pieces of a saved world, whose text is still to be compared with its MJCF."""
    source = f"{place}{name}.pieces.json"
    try:
        index = _INDEX.validate_json(read(f"{name}.pieces.json"))
    except ValidationError as error:
        raise StateError(f"{source} is damaged: {fault_text(error)}") from None
    files = dict.fromkeys((index.own, *(part.piece for part in index.parts)))
    found = {file: _piece(file, read(f"pieces/{file}"), f"{place}pieces/{file}", assets) for file in files}
    parts = tuple(Part(part.name, found[part.piece], part.pose) for part in index.parts)
    size = 0
    for part in parts:
        size += len(part.piece.text) + len(part.name) * part.piece.text.count(PREFIX)
        if size > _MOST_CHARACTERS:
            raise StateError(f"{source} has pieces of {size:,} characters; at most {_MOST_CHARACTERS:,} are read")
        if part.piece.owners - {owner_of(PREFIX), part.owner}:
            raise StateError(f"{source} is damaged: {part.name} has bodies of other parts")
    return Pieces(found[index.own], parts)


def _piece(file: str, content: bytes, source: str, assets: Mapping[str, bytes]) -> Piece:
    """The piece in a file."""
    _check_hash(file, content, source)
    text = _decode(content, source)
    contents_of(text, source)
    piece = _whole(Piece(text, {}), source)
    files = [ET.fromstring(line).get("file", "") for line in piece.assets]
    return replace(piece, files={file: assets[file] for file in files if file in assets})


def _whole(piece: Piece, source: str) -> Piece:
    """A piece of which every block is well formed by itself.

    Raises:
        StateError: it is not.
    """
    try:
        piece.assets  # noqa: B018
        piece.without({""})
    except (ValueError, ET.ParseError) as error:
        raise StateError(f"{source} is damaged: {error}") from None
    return piece


def _decode(content: bytes, source: str) -> str:
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        raise StateError(f"{source} is damaged: it is not UTF-8: {error}") from None


def _read_parameters(text: bytes, source: str) -> Parameters:
    try:
        if (version := format_of(text)) not in (FORMER, FORMAT):
            raise StateError(f"{source} has format {literal(version)}; this version reads {FORMER} and {FORMAT}")
        return parameters_of(text)
    except ValidationError as error:
        raise StateError(f"{source} is damaged: {fault_text(error)}") from None
    except ValueError as error:
        raise StateError(f"{source} is damaged: {error}") from None


def _check_hash(name: str, content: bytes, source: str) -> None:
    digits = _HASH.search(name)
    if digits is None or not hashlib.sha256(content).hexdigest().startswith(digits[1]):
        raise StateError(f"{source} is damaged: the content of '{name}' does not match the hash in its name")


def _assets(files: Mapping[str, None], asset: Callable[[str], bytes], source: str) -> dict[str, bytes]:
    """The files that an MJCF names, each of the content that its name is made of."""
    if len(files) > _MOST_ASSETS:
        raise StateError(f"{source} names {len(files):,} files; at most {_MOST_ASSETS:,} are read")
    found: dict[str, bytes] = {}
    size = 0
    for name in sorted(files):
        content = found[name] = asset(name)
        size += len(content)
        if size > _LARGEST_ASSETS:
            raise StateError(f"{source} names files of {size:,} bytes up to '{name}': too many")
        _check_hash(name, content, source)
        if name.endswith(".stl") and not is_binary_stl(content):
            raise StateError(f"{source} is damaged: mesh {name} has more or fewer triangles than its header says")
        triangles = sum(max(len(corners.split()) - 2, 1) for corners in _CORNERS.findall(content))  # as MuJoCo's
        if name.endswith(".obj") and triangles > _MOST_TRIANGLES:  # MuJoCo has that limit for STL alone
            raise StateError(f"{source} is damaged: mesh {name} has more than {_MOST_TRIANGLES:,} triangles")
    return found


def _unlike(world: Parameters, contents: Contents) -> Iterator[str]:
    """Places where the tables do not fit the MJCF."""
    if world.timestep != contents.timestep:
        yield f"timestep: {world.timestep:g} s, and {contents.timestep:g} s in the MJCF"
    free = {body for body, joints in contents.joints.items() if [kind for kind, _ in joints] == ["free"]}
    yield from _boats(world, contents, free)
    for number, row in enumerate(world.floats):
        if row.body not in free:
            yield f"floats[{number}].body: '{row.body}' is not a free body"
    yield from _links(world, contents)
    for number, block in enumerate(world.blocks):
        if block.parent < 0:
            right = block.body in free
        else:
            hinges = [kind for kind, _ in contents.joints.get(block.body, ())]
            right = hinges == ["hinge"] and contents.parents[block.body] == world.blocks[block.parent].body
        if not right:
            yield f"blocks[{number}].body: '{block.body}' is neither a free body nor on a hinge of the one it hangs on"
    for kind, place, name in _names_in_mjcf(world):
        if name not in (contents.joints if kind == "body" else contents.geoms):
            yield f"{place}: the MJCF has no {kind} '{name}'"
    rivals = [f"{_TOUCH}/{rival}" for rival in (world.task.rivals if world.task else ())]
    if rivals != contents.touches:
        yield "task.rivals: they are not those of the contact sensors in the MJCF"


def _boats(world: Parameters, contents: Contents, free: set[str]) -> Iterator[str]:
    for number, (boat, hull) in enumerate(zip(world.boats, world.hulls, strict=True)):
        if hull.body not in free or not hull.body.startswith(f"{boat.name}/"):
            yield f"hulls[{number}].body: '{hull.body}' is not a free body of {boat.name}"
    for number, thruster in enumerate(world.thrusters):
        if not _turns(thruster.body, thruster.joint, world.hulls[thruster.hull].body, contents):
            yield f"thrusters[{number}].body: '{thruster.body}' is not the hull or a body on its own hinge"
    links = {boat.name: hull.body for boat, hull in zip(world.boats, world.hulls, strict=True)}
    for number, sensor in enumerate(world.sensors):
        if sensor.body != links[sensor.boat]:
            yield f"sensors[{number}].body: '{sensor.body}' is not the hull of {sensor.boat}"


def _turns(body: str, joint: str | None, hull: str, contents: Contents) -> bool:
    """Whether an engine is its hull, or hangs on it by a hinge."""
    if joint is None:
        return body == hull
    return contents.parents.get(body) == hull and contents.joints[body] == (("hinge", joint),)


def _links(world: Parameters, contents: Contents) -> Iterator[str]:
    """Links of objects hang on others of the same one; all but the outermost have a joint."""
    for number, item in enumerate(world.objects):
        known = [item.body]
        for body in item.links:
            if contents.parents.get(body) not in known or not contents.joints[body]:
                yield f"objects[{number}].links: '{body}' does not hang by a joint on a link that comes before"
            known.append(body)
    for number, link in enumerate(world.links):
        if not contents.joints.get(link.body):
            yield f"links[{number}].body: '{link.body}' does not move"


def _names_in_mjcf(world: Parameters) -> Iterator[tuple[str, str, str]]:
    """Bodies and geoms of the MJCF that the tables name: kind, place in the tables, name."""
    for table in ("objects", "lights", "placards"):
        for number, row in enumerate(getattr(world, table)):
            yield "body", f"{table}[{number}].body", row.body
            geoms = chain.from_iterable(row.geoms.values()) if table == "placards" else getattr(row, "geoms", ())
            yield from (("geom", f"{table}[{number}].geoms", geom) for geom in geoms)
    for number, dock in enumerate(world.docks):
        yield from (("body", f"docks[{number}]", body) for body in (*dock.bodies, *dock.placards))


def _signs(world: Parameters) -> Iterator[str]:
    """Colours and symbols that nobody can show."""
    for number, light in enumerate(world.lights):
        for color in light.pattern:
            if color not in {*LIGHT_COLORS, OFF}:
                yield f"lights[{number}].pattern: no colour '{color}'"
    shown = [(f"placards[{number}].symbol", placard.symbol) for number, placard in enumerate(world.placards)]
    shown += [(f"task.bays[{number}].symbol", bay.symbol) for number, bay in enumerate(getattr(world.task, "bays", ()))]
    yield from (f"{place}: no symbol '{symbol}'" for place, symbol in shown if symbol not in SYMBOLS)
    for number, placard in enumerate(world.placards):
        yield from (f"placards[{number}].geoms: no shape '{shape}'" for shape in placard.geoms if shape not in SHAPES)
    for color in getattr(world.task, "color_sequence", ()):
        if color not in LIGHT_COLORS:
            yield f"task.color_sequence: no colour '{color}'"
