"""Whether a saved world is one that we wrote: checked before anything of it runs, as it may come from somebody else.

MJCF can name files anywhere, plugins, and tables of any size. What the templates write needs few elements and
attributes: a text is accepted if it has no others. Its lexical form is as narrow, so that nothing hides in a comment or
an entity from one reader and is seen by another.
"""

import hashlib
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain

from pydantic import ValidationError

from vrx_mj.config.bays import LIGHT_COLORS, OFF, SHAPES, SYMBOLS
from vrx_mj.config.loading import fault_text
from vrx_mj.config.wording import shown
from vrx_mj.constants import LONGEST_STEP, SHORTEST_STEP
from vrx_mj.errors import StateError
from vrx_mj.formats.urdf.meshes import is_binary_stl
from vrx_mj.model.references import broken_references
from vrx_mj.model.world import FORMAT, Parameters, format_of, parameters_of

_MOST_CHARACTERS = 100_000_000
"""Longest text that is read."""
_DEEPEST = 500
"""Elements inside each other."""
_LONGEST = 500
"""Most characters of a name."""
_LARGEST = 1e12
"""Largest magnitude of a number."""
_MOST_PIXELS = 8192
"""Largest edge of a picture."""
_SHOWN = 60

_TOKEN = re.compile(r'\s+|<!--[^<>]*-->|</[a-z]+>|<[a-z]+(?:\s+[a-z][a-z0-9_]*="[^"<>]*")*\s*/?>')
_NUMBER = re.compile(r"[-+]?\d{1,40}(?:\.\d{0,40})?(?:[eE][-+]?\d{1,4})?")

_Check = Callable[[str], bool]


def _name(value: str) -> bool:
    return len(value) <= _LONGEST


def _text(value: str) -> bool:
    return len(value) <= 100_000


def _numbers(value: str) -> bool:
    return all(_NUMBER.fullmatch(part) and abs(float(part)) <= _LARGEST for part in value.split())


def _pixels(value: str) -> bool:
    return all(re.fullmatch(r"[0-9]{1,5}", part) and int(part) <= _MOST_PIXELS for part in value.split())


def _step(value: str) -> bool:
    return _numbers(value) and len(value.split()) == 1 and SHORTEST_STEP <= float(value) <= LONGEST_STEP


def _file(value: str) -> bool:
    return bool(re.fullmatch(r"[A-Za-z0-9_]{1,100}\.(obj|stl)", value))


def _one_of(*words: str) -> _Check:
    return frozenset(words).__contains__


_SWITCH = _one_of("enable", "disable")
_TRUTH = _one_of("true", "false")

_JOINT_FORCES = ("damping", "frictionloss", "stiffness", "springref")
"""Attributes of joints that resist or push."""
ATTRIBUTES: Mapping[str, Mapping[str, _Check]] = {
    "mujoco": {"model": _text},
    "compiler": {"angle": _one_of("radian"), "eulerseq": _one_of("XYZ"), "meshdir": _one_of("assets")},
    "option": {
        "timestep": _step,
        "gravity": _numbers,
        "solver": _one_of("Newton"),
        "jacobian": _one_of("sparse"),
        "sleep_tolerance": _one_of("0"),
    },
    "flag": {"warmstart": _SWITCH, "autoreset": _one_of("disable"), "sleep": _SWITCH},
    "statistic": {"center": _numbers, "extent": _numbers},
    "visual": {},
    "headlight": dict.fromkeys(("ambient", "diffuse", "specular"), _numbers),
    "map": dict.fromkeys(("znear", "zfar", "fogstart", "fogend"), _numbers),
    "rgba": dict.fromkeys(("fog", "haze"), _numbers),
    "quality": {"shadowsize": _pixels},
    "global": {"offwidth": _pixels, "offheight": _pixels},
    "asset": {},
    "texture": {
        "name": _name,
        "type": _one_of("skybox"),
        "builtin": _one_of("gradient"),
        "rgb1": _numbers,
        "rgb2": _numbers,
        "width": _pixels,
        "height": _pixels,
    },
    "material": {"name": _name, **dict.fromkeys(("rgba", "specular", "shininess", "reflectance"), _numbers)},
    "mesh": {"name": _name, "file": _file, "scale": _numbers, "inertia": _one_of("shell"), "vertex": _numbers},
    "worldbody": {},
    "light": {
        "name": _name,
        "type": _one_of("directional"),
        **dict.fromkeys(("pos", "dir", "diffuse", "specular"), _numbers),
        "castshadow": _TRUTH,
    },
    "frame": {"pos": _numbers, "euler": _numbers},
    "body": {"name": _name, **dict.fromkeys(("pos", "euler", "gravcomp"), _numbers), "sleep": _one_of("init")},
    "freejoint": {"name": _name, "align": _one_of("false")},
    "joint": {
        "name": _name,
        "type": _one_of("hinge", "slide", "ball"),
        **dict.fromkeys(("pos", "axis", "range", *_JOINT_FORCES), _numbers),
        "limited": _TRUTH,
    },
    "inertial": dict.fromkeys(("pos", "quat", "mass", "diaginertia", "fullinertia"), _numbers),
    "geom": {
        "name": _name,
        "type": _one_of("plane", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh"),
        "mesh": _name,
        "material": _name,
        **dict.fromkeys(("size", "pos", "euler", "rgba", "mass", "solref"), _numbers),
        **dict.fromkeys(("group", "contype", "conaffinity", "priority"), _pixels),
    },
    "camera": {"name": _name, **dict.fromkeys(("pos", "xyaxes", "fovy"), _numbers), "resolution": _pixels},
    "contact": {
        **dict.fromkeys(("name", "body1", "body2", "subtree2"), _name),
        "data": _one_of("found"),
        "num": _one_of("1"),
    },
    "exclude": dict.fromkeys(("body1", "body2"), _name),
    "equality": {},
    "connect": {**dict.fromkeys(("body1", "body2"), _name), **dict.fromkeys(("anchor", "solref", "solimp"), _numbers)},
    "weld": {**dict.fromkeys(("name", "body1", "body2"), _name), **dict.fromkeys(("solref", "solimp"), _numbers)},
    "sensor": {},
    "custom": {},
    "text": {"name": _name, "data": _text},
}
"""Elements that we write, and what each of their attributes may hold."""


@dataclass
class Contents:
    """What an MJCF has, by name."""

    timestep: float = 0.0
    """Physics step [s]."""
    files: dict[str, None] = field(default_factory=dict)
    """Names of the files, in their order."""
    joints: dict[str, tuple[tuple[str, str], ...]] = field(default_factory=dict)
    """Joints of every body, each as type and name; `free` for a free joint."""
    parents: dict[str, str] = field(default_factory=dict)
    """The body that each body hangs on; empty for one in the world."""
    geoms: set[str] = field(default_factory=set)
    """Names of geoms."""
    touches: list[str] = field(default_factory=list)
    """Names of the contact sensors, in their order."""


def contents_of(mjcf: str, source: object) -> Contents:
    """What is in an MJCF that we wrote; `source` names it in messages.

    Raises:
        StateError: it is not one that we write.
    """
    if len(mjcf) > _MOST_CHARACTERS:
        raise StateError(f"{source} has {len(mjcf):,} characters; at most {_MOST_CHARACTERS:,} are read")
    try:
        _check_tokens(mjcf)
        contents = Contents()
        for element, body in _elements(ET.fromstring(mjcf)):
            _check_element(element)
            _take(contents, element, body)
    except (ValueError, ET.ParseError) as error:
        raise StateError(f"{source} is damaged: {error}") from None
    return contents


def _check_tokens(mjcf: str) -> None:
    """Whether there are only tags with attributes in double quotes, blanks, and comments without tags."""
    end = 0
    while found := _TOKEN.match(mjcf, end):
        end = found.end()
    if end < len(mjcf):
        line = mjcf.count("\n", 0, end) + 1
        raise ValueError(f"line {line}: a tag is needed, got '{mjcf[end : end + _SHOWN].splitlines()[0]}'")


def _elements(root: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    """All elements in their order, each with the name of the body that it is in."""
    if root.tag != "mujoco":
        raise ValueError(f"<mujoco> is needed, got <{root.tag}>")
    stack = [(root, "", 0)]
    while stack:
        element, body, depth = stack.pop()
        if depth > _DEEPEST:
            raise ValueError(f"elements are nested too deeply; at most {_DEEPEST}")
        yield element, body
        inside = element.get("name", "") if element.tag == "body" else body
        stack += [(child, inside, depth + 1) for child in reversed(element)]


def _check_element(element: ET.Element) -> None:
    checks = ATTRIBUTES.get(element.tag)
    if checks is None:
        raise ValueError(f"invalid element <{element.tag[:_SHOWN]}>: no world has one")
    for key, value in element.attrib.items():
        if key not in checks:
            raise ValueError(f"invalid attribute {key[:_SHOWN]} of <{element.tag}>: no world has one")
        if not checks[key](value):
            shown = value if len(value) <= _SHOWN else value[:_SHOWN] + "..."
            raise ValueError(f"invalid {key} '{shown}' of <{element.tag}>")


def _take(contents: Contents, element: ET.Element, body: str) -> None:
    name = element.get("name", "")
    if element.tag == "body":
        if not name or name in contents.joints:
            raise ValueError(f"invalid name '{name}' of <body>: one of its own is needed")
        contents.joints[name], contents.parents[name] = (), body
    elif element.tag in {"joint", "freejoint"}:
        if body not in contents.joints:
            raise ValueError(f"invalid <{element.tag}> '{name}': it is in no body")
        kind = "free" if element.tag == "freejoint" else element.get("type", "hinge")
        contents.joints[body] += ((kind, name),)
    elif element.tag == "geom":
        contents.geoms.add(name)
    elif element.tag == "mesh" and (file := element.get("file")):
        contents.files[file] = None
    elif element.tag == "contact" and name:
        contents.touches.append(name)
    elif element.tag == "option":
        contents.timestep = float(element.get("timestep", 0.0))


_MOST_ASSETS, _MOST_TRIANGLES = 10_000, 200_000
_LARGEST_ASSETS = 500_000_000
"""Bytes of all files together that an MJCF names."""
_CORNERS = re.compile(rb"^[ \t]*f([^\n]*)", re.MULTILINE)
_HASH = re.compile(r"_([0-9a-f]{12,16})\.(?:obj|stl)$")
"""End of an asset's name: the first digits of its content's SHA-256."""
_TOUCH = "touch"
"""Contact sensors are called by this and the name of the rival."""


def checked(
    mjcf: str, parameters: bytes, asset: Callable[[str], bytes], source: object
) -> tuple[Parameters, dict[str, bytes]]:
    """The parameters of a saved world, and its assets by name.

    Args:
        mjcf: the MJCF.
        parameters: the JSON beside it.
        asset: gives a file's content by its name, which has no folders.
        source: what messages call the JSON.

    Raises:
        StateError: a part is damaged or of another version, or the parts do not belong together.
    """
    typed = _read(parameters, source)
    scene = str(source).removesuffix(".json") + ".xml"
    contents = contents_of(mjcf, scene)
    faults = chain(broken_references(typed), _signs(typed), _unlike(typed, contents))
    if fault := next(faults, None):  # what comes later trusts what came before
        raise StateError(f"{source} is damaged: {fault}")
    return typed, _assets(contents.files, asset, scene)


def _read(text: bytes, source: object) -> Parameters:
    try:
        if (version := format_of(text)) != FORMAT:
            raise StateError(f"{source} has format {shown(version)}; this version reads {FORMAT}")
        return parameters_of(text)
    except ValidationError as error:
        raise StateError(f"{source} is damaged: {fault_text(error)}") from None
    except ValueError as error:
        raise StateError(f"{source} is damaged: {error}") from None


def _assets(files: Mapping[str, None], asset: Callable[[str], bytes], source: object) -> dict[str, bytes]:
    """The files that an MJCF names, each of the content that its name is made of."""
    if len(files) > _MOST_ASSETS:
        raise StateError(f"{source} names {len(files):,} files; at most {_MOST_ASSETS:,} are read")
    found: dict[str, bytes] = {}
    size = 0
    for name in sorted(files):
        content = found[name] = asset(name)
        size += len(content)
        if size > _LARGEST_ASSETS:
            raise StateError(f"{source} names files of {size:,} bytes, down to '{name}': too many are read")
        digits = _HASH.search(name)
        if digits is None or not hashlib.sha256(content).hexdigest().startswith(digits[1]):
            raise StateError(f"{source} is damaged: the content of '{name}' does not match the hash in its name")
        if name.endswith(".stl") and not is_binary_stl(content):
            raise StateError(f"{source} is damaged: mesh {name} has more or fewer triangles than its header says")
        if name.endswith(".obj") and _triangles(content) > _MOST_TRIANGLES:  # MuJoCo has that limit for STL alone
            raise StateError(f"{source} is damaged: mesh {name} has more than {_MOST_TRIANGLES:,} triangles")
    return found


def _triangles(content: bytes) -> int:
    """How many triangles MuJoCo makes of an OBJ."""
    return sum(max(len(corners.split()) - 2, 1) for corners in _CORNERS.findall(content))


def _unlike(world: Parameters, contents: Contents) -> Iterator[str]:
    """Where the tables do not fit the MJCF."""
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
    for kind, named, known in (("body", _bodies(world), contents.joints), ("geom", _geoms(world), contents.geoms)):
        yield from (f"{place}: the MJCF has no {kind} '{name}'" for place, name in named if name not in known)
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


def _bodies(world: Parameters) -> Iterator[tuple[str, str]]:
    for table in ("objects", "lights", "placards"):
        for number, row in enumerate(getattr(world, table)):
            yield f"{table}[{number}].body", row.body
    for number, dock in enumerate(world.docks):
        yield from ((f"docks[{number}]", body) for body in (*dock.bodies, *dock.placards))


def _geoms(world: Parameters) -> Iterator[tuple[str, str]]:
    for number, light in enumerate(world.lights):
        yield from ((f"lights[{number}].geoms", geom) for geom in light.geoms)
    for number, placard in enumerate(world.placards):
        yield from ((f"placards[{number}].geoms", geom) for geoms in placard.geoms.values() for geom in geoms)


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
