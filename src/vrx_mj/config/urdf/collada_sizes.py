"""How large a `.dae` file makes a mesh, from its elements: looked at before any library reads it."""

import re
from collections.abc import Iterator
from typing import Any

from vrx_mj.config.urdf.mesh_sizes import check_counts, refuse

__all__ = ["sized_dae"]

MAX_TAGS = 200_000
"""Most tags and, apart from them, attributes of a file; each takes some 200 bytes."""
MAX_NODES = 20_000
"""Most nodes, and things in them, each place of one that is repeated counted."""
DEEPEST = 60
"""Levels of nodes in nodes, those that they refer to included."""

_ENCODING = re.compile(rb"^\s*<\?xml[^>]*?encoding\s*=\s*[\"']([^\"']*)[\"']")
_KNOWN_ENCODINGS = {"utf-8", "us-ascii", "ascii", "iso-8859-1", "latin1", "windows-1252"}
_USED = {"asset", "library_effects", "library_images", "library_materials", "library_geometries", "library_nodes",
         "library_visual_scenes", "scene"}  # fmt: skip
"""What is handed on: the shape and its colours; no animations, controllers or cameras. Pictures are never opened."""
_NEEDED_OF_ASSET = {"unit", "up_axis"}
_FACES = {"triangles", "tristrips", "trifans", "polylist", "polygons"}


class _OddError(Exception):
    """What is wrong with a file."""


def sized_dae(name: str, content: bytes) -> bytes:
    """A Collada file whose shapes are few enough, each place of one counted, without what is no shape."""
    from lxml import etree

    try:
        _check_text(content)
        root = etree.fromstring(content, etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True))
        _strip(root)
        shapes = _shapes(root)
        places = [place for scene in root.iterfind(".//{*}visual_scene") for place in _placed(root, scene)]
    except _OddError as error:
        refuse(name, str(error))
    except (etree.XMLSyntaxError, ValueError, LookupError):
        refuse(name, "cannot be read: it is not a DAE file, or is damaged")
    for counts in (list(shapes.values()), [shapes[place] for place in places if place in shapes]):
        check_counts(name, *map(sum, zip(*counts, strict=True)))
    plain: bytes = etree.tostring(root, encoding="utf-8", xml_declaration=True)
    return plain


def _check_text(content: bytes) -> None:
    """Collada is XML, in which a short text can stand for a huge one."""
    encoding = _ENCODING.match(content)
    known = encoding is None or encoding[1].decode("ascii", "replace").lower() in _KNOWN_ENCODINGS
    if not known or not content.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"<"):
        raise ValueError
    if re.search(rb"<!(DOCTYPE|ENTITY)", content, re.IGNORECASE):
        raise _OddError("has a document type or entities, which are not allowed")
    for mark, words in ((b"<", "tags"), (b"=", "attributes")):
        if content.count(mark) > MAX_TAGS:
            raise _OddError(f"has {content.count(mark):,} {words}; at most {MAX_TAGS:,} are read")


def _strip(root: Any) -> None:
    """Remove what is no shape and no colour of one."""
    for part in list(root):
        if _tag(part) not in _USED:
            root.remove(part)
    for part in list(root.iterfind("{*}asset/*")):
        if _tag(part) not in _NEEDED_OF_ASSET:
            part.getparent().remove(part)


def _tag(element: Any) -> str:
    """An element's name without its namespace; empty for comments and the like."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def _shapes(root: Any) -> dict[str, tuple[int, int, int]]:
    """Points, triangles and parts of each geometry, of several of one id those of the largest."""
    found: dict[str, tuple[int, int, int]] = {}
    for shape in root.iterfind(".//{*}geometry"):
        name = shape.get("id", "")
        found[name] = max(found.get(name, (0, 0, 0)), _counts(shape))
    return found


def _counts(shape: Any) -> tuple[int, int, int]:
    """Points, triangles and parts of a geometry, from the lengths of its texts: numbers in them have blanks between."""
    parts = [part for part in shape.iter() if _tag(part) in _FACES]
    points = triangles = 0
    for part in parts:
        offsets = [int(one.get("offset", "0")) for one in part if _tag(one) == "input"]
        each = max(offsets, default=0) + 1
        corners = sum(len((index.text or "").split()) for index in part if _tag(index) == "p") // max(each, 1)
        points += corners
        triangles += corners // 3 if _tag(part) == "triangles" else corners
    return points, triangles, len(parts)


def _placed(root: Any, scene: Any) -> Iterator[str]:
    """The ids of the geometries in a scene, each as often as it is drawn."""
    nodes: dict[str, list[Any]] = {}
    for node in root.iterfind(".//{*}node"):
        nodes.setdefault(node.get("id", ""), []).append(node)
    waiting = [(child, 1) for child in scene]
    seen = 0
    while waiting:
        element, depth = waiting.pop()
        seen += 1
        if depth > DEEPEST:
            raise _OddError(f"has nodes nested deeper than {DEEPEST} levels, or inside themselves")
        if seen > MAX_NODES:
            raise _OddError(f"has more than {MAX_NODES:,} nodes, those that are repeated counted each time")
        if _tag(element) == "instance_geometry":
            yield element.get("url", "").removeprefix("#")
        elif _tag(element) == "instance_node":
            waiting += [(other, depth + 1) for other in nodes.get(element.get("url", "").removeprefix("#"), ())]
        elif _tag(element) == "node":
            waiting += [(child, depth + 1) for child in element]
