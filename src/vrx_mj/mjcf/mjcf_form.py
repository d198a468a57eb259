"""The MJCF that we write: whether a text has its form, and what is in it.

A saved world may come from somebody else, and MJCF can name files anywhere, plugins, and tables of any size. What the
templates write needs few elements and attributes: a text is accepted if it has no others. Its lexical form is as
narrow, so that nothing hides in a comment or an entity from one reader and is seen by another.
"""

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from vrx_mj.constants import LONGEST_STEP, SHORTEST_STEP
from vrx_mj.errors import StateError

__all__ = ["ATTRIBUTES", "Contents", "contents_of"]

MOST_CHARACTERS = 100_000_000
"""Longest text that is read."""
DEEPEST = 500
"""Elements inside each other."""
LONGEST = 500
"""Most characters of a name."""
LARGEST = 1e12
"""Largest magnitude of a number."""
MOST_PIXELS = 8192
"""Largest edge of a picture."""
SHOWN = 60

_TOKEN = re.compile(r'\s+|<!--[^<>]*-->|</[a-z]+>|<[a-z]+(?:\s+[a-z][a-z0-9_]*="[^"<>]*")*\s*/?>')
_NUMBER = re.compile(r"[-+]?\d{1,40}(?:\.\d{0,40})?(?:[eE][-+]?\d{1,4})?")

Check = Callable[[str], bool]


def _name(value: str) -> bool:
    return len(value) <= LONGEST


def _text(value: str) -> bool:
    return len(value) <= 100_000


def _numbers(value: str) -> bool:
    return all(_NUMBER.fullmatch(part) and abs(float(part)) <= LARGEST for part in value.split())


def _pixels(value: str) -> bool:
    return all(re.fullmatch(r"[0-9]{1,5}", part) and int(part) <= MOST_PIXELS for part in value.split())


def _step(value: str) -> bool:
    return _numbers(value) and len(value.split()) == 1 and SHORTEST_STEP <= float(value) <= LONGEST_STEP


def _file(value: str) -> bool:
    return bool(re.fullmatch(r"[A-Za-z0-9_]{1,100}\.(obj|stl)", value))


def _one_of(*words: str) -> Check:
    return frozenset(words).__contains__


_SWITCH = _one_of("enable", "disable")
_TRUTH = _one_of("true", "false")

ATTRIBUTES: Mapping[str, Mapping[str, Check]] = {
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
        "type": _one_of("hinge", "slide"),
        **dict.fromkeys(("pos", "axis", "range", "damping"), _numbers),
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
    if len(mjcf) > MOST_CHARACTERS:
        raise StateError(f"{source} has {len(mjcf):,} characters; at most {MOST_CHARACTERS:,} are read")
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
        raise ValueError(f"line {line}: a tag is needed, got '{mjcf[end : end + SHOWN].splitlines()[0]}'")


def _elements(root: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    """All elements in their order, each with the name of the body that it is in."""
    if root.tag != "mujoco":
        raise ValueError(f"<mujoco> is needed, got <{root.tag}>")
    stack = [(root, "", 0)]
    while stack:
        element, body, depth = stack.pop()
        if depth > DEEPEST:
            raise ValueError(f"elements are nested too deeply; at most {DEEPEST}")
        yield element, body
        inside = element.get("name", "") if element.tag == "body" else body
        stack += [(child, inside, depth + 1) for child in reversed(element)]


def _check_element(element: ET.Element) -> None:
    checks = ATTRIBUTES.get(element.tag)
    if checks is None:
        raise ValueError(f"invalid element <{element.tag[:SHOWN]}>: no world has one")
    for key, value in element.attrib.items():
        if key not in checks:
            raise ValueError(f"invalid attribute {key[:SHOWN]} of <{element.tag}>: no world has one")
        if not checks[key](value):
            shown = value if len(value) <= SHOWN else value[:SHOWN] + "..."
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
