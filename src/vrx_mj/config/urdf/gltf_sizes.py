"""How large a `.glb` file makes a mesh, from its JSON and its chunks: looked at before any library reads it."""

import json
import re
import struct
from collections.abc import Mapping, Sequence
from typing import Any

from vrx_mj.config.urdf.mesh_sizes import check_counts, refuse

__all__ = ["sized_glb"]

MAX_JSON = 8_000_000
"""Bytes of the JSON in a file."""
MAX_ITEMS = 20_000
"""Most accessors, and most of anything else that is listed in it."""
DEEPEST = 60
"""Levels of nodes in nodes."""

_HEAD, _CHUNK = struct.Struct("<4sII"), struct.Struct("<II")
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
_SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
"""Bytes of a number, by glTF's `componentType`."""
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_HARMLESS = re.compile(r"KHR_(materials|texture|lights)_\w+|KHR_mesh_quantization|EXT_texture_\w+")
"""Extensions without which a mesh has the same shape, or that the reader knows."""
_USED = {
    "accessors": ("bufferView", "byteOffset", "componentType", "count", "type", "normalized"),
    "buffers": ("byteLength",),
    "bufferViews": ("buffer", "byteOffset", "byteLength", "byteStride"),
    "materials": ("name", "pbrMetallicRoughness"),
    "meshes": ("name", "primitives"),
    "nodes": ("name", "children", "mesh", "matrix", "translation", "rotation", "scale"),
    "scenes": ("nodes",),
}
"""What is handed on: the shape and its colours; no pictures, cameras, animations, skins or extensions."""

Tree = Mapping[str, Any]


class _OddError(Exception):
    """What is wrong with a file."""


def sized_glb(name: str, content: bytes) -> bytes:
    """A glTF file whose sizes are those of its data and few enough, without what is no mesh."""
    try:
        text, binary = _chunks(content)
        tree = _plain(json.loads(text))
        _check_accessors(tree, len(binary))
        shapes = [_counts(tree, mesh) for mesh in tree["meshes"]]
        used = [shapes[node["mesh"]] for node in _placed(tree) if "mesh" in node]
    except _OddError as error:
        refuse(name, f"cannot be read: {error}")
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError, struct.error):
        refuse(name, "cannot be read: it is not a GLB file, or is damaged")
    for counts in (shapes, used):
        check_counts(name, *map(sum, zip(*counts, strict=True)))
    return _packed(tree, binary)


def _chunks(content: bytes) -> tuple[bytes, bytes]:
    """The JSON and the binary data of a file."""
    mark, version, _ = _HEAD.unpack_from(content)
    found = dict[int, bytes]()
    start = _HEAD.size
    while start + _CHUNK.size <= len(content):
        length, kind = _CHUNK.unpack_from(content, start)
        start += _CHUNK.size
        if length > len(content) - start:
            raise _OddError(f"a chunk of {length:,} bytes begins where {len(content) - start:,} are left")
        found.setdefault(kind, content[start : start + length])
        start += length
    if mark != b"glTF" or _JSON not in found:
        raise ValueError
    if version != 2:
        raise _OddError(f"it is glTF {version}; only glTF 2 is read")
    if len(found[_JSON]) > MAX_JSON:
        raise _OddError(f"its JSON has {len(found[_JSON]):,} bytes; at most {MAX_JSON:,} are read")
    return found[_JSON], found.get(_BINARY, b"")


def _plain(tree: Tree) -> dict[str, Any]:
    """The parts of a file's JSON that are handed on."""
    for extension in tree.get("extensionsRequired", ()):
        if not _HARMLESS.fullmatch(extension):
            raise _OddError(f"it needs the extension '{extension[:60]}'; export it without compression")
    for buffer in tree.get("buffers", ()):
        if "uri" in buffer:
            raise _OddError("it refers to another file, or holds one as text; export it with its data inside")
    plain: dict[str, Any] = {"asset": {"version": "2.0"}}
    for part, keys in _USED.items():
        items = tree.get(part, ())
        if len(items) > MAX_ITEMS:
            raise _OddError(f"it has {len(items):,} {part}; at most {MAX_ITEMS:,} are allowed")
        plain[part] = [{key: item[key] for key in keys if key in item} for item in items]
    for material in plain["materials"]:
        shading = material.pop("pbrMetallicRoughness", {})
        color = {"baseColorFactor": shading["baseColorFactor"]} if "baseColorFactor" in shading else {}
        material["pbrMetallicRoughness"] = color
    for mesh in plain["meshes"]:
        mesh["primitives"] = [_plain_primitive(each) for each in mesh["primitives"]]
    plain["buffers"] = plain["buffers"][:1]
    plain["accessors"] = _used_accessors(tree, plain)
    scene = plain["scenes"][_index(tree.get("scene", 0), plain["scenes"])] if plain["scenes"] else {"nodes": []}
    return plain | {"scenes": [scene], "scene": 0}


def _used_accessors(tree: Tree, plain: Tree) -> list[Tree]:
    """The accessors of shapes and colours, named by their numbers; the primitives refer to those in this list."""
    numbers: dict[int, int] = {}
    for primitive in (each for mesh in plain["meshes"] for each in mesh["primitives"]):
        for owner in (primitive, primitive["attributes"]):
            for key in [key for key in ("POSITION", "COLOR_0", "indices") if key in owner]:
                number = _index(owner[key], plain["accessors"])
                owner[key] = numbers.setdefault(number, len(numbers))
    if any("sparse" in tree["accessors"][number] for number in numbers):
        raise _OddError("it has sparse accessors, which are not read")
    return [plain["accessors"][number] | {"name": str(number)} for number in numbers]


def _plain_primitive(primitive: Tree) -> dict[str, Any]:
    kept = {key: primitive[key] for key in ("indices", "material", "mode") if key in primitive}
    attributes = primitive["attributes"]
    return kept | {"attributes": {key: attributes[key] for key in ("POSITION", "COLOR_0") if key in attributes}}


def _index(value: Any, items: Sequence[Any]) -> int:
    """A reference to an item, which must be there."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < len(items):
        raise ValueError
    return value


def _whole(value: Any) -> int:
    """A number of bytes or of things."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError
    return value


def _check_accessors(tree: Tree, size: int) -> None:
    """Refuse arrays that reach beyond the data, and such that would take much more memory than it."""
    views, total = tree["bufferViews"], 0
    for view in views:
        _index(view["buffer"], tree["buffers"])
        end = _whole(view.get("byteOffset", 0)) + _whole(view["byteLength"])
        if end > size:
            raise _OddError(f"a part of its data ends at byte {end:,}; it has {size:,}")
    for accessor in tree["accessors"]:
        number, item = accessor["name"], _SIZES[accessor["componentType"]] * _WIDTHS[accessor["type"]]
        count = _whole(accessor["count"])
        total += count * item
        if count == 0 or "bufferView" not in accessor:
            raise _OddError(f"its accessor {number} says {count:,} items and has no data")
        view = views[_index(accessor["bufferView"], views)]
        stride = _whole(view.get("byteStride", item))
        needed = _whole(accessor.get("byteOffset", 0)) + stride * (count - 1) + item
        if stride < item or needed > view["byteLength"]:
            raise _OddError(f"its accessor {number} says {count:,} items of {item} bytes, which take {needed:,} bytes; "
                            f"there are {view['byteLength']:,}")  # fmt: skip
    if total > 4 * size:
        raise _OddError(f"its accessors say {total:,} bytes altogether; it has {size:,}")


def _counts(tree: Tree, mesh: Tree) -> tuple[int, int, int]:
    """Points, triangles and parts of one mesh."""
    points = triangles = 0
    for primitive in mesh["primitives"]:
        at = primitive["attributes"].get("POSITION")
        mode = _whole(primitive.get("mode", 4))
        if at is None or mode < 4:
            continue
        here = tree["accessors"][_index(at, tree["accessors"])]["count"]
        corners = here
        if "indices" in primitive:
            corners = tree["accessors"][_index(primitive["indices"], tree["accessors"])]["count"]
        points += here
        triangles += corners // 3 if mode == 4 else corners
    return points, triangles, len(mesh["primitives"])


def _placed(tree: Tree) -> list[Tree]:
    """The nodes of the scene, each once: what has two parents, or is inside itself, is refused."""
    nodes = tree["nodes"]
    found: dict[int, Tree] = {}
    waiting = [(root, 1) for root in tree["scenes"][0].get("nodes", [])]
    while waiting:
        number, depth = waiting.pop()
        node = nodes[_index(number, nodes)]
        if number in found:
            raise _OddError(f"its node {number} is in two places, or inside itself")
        if depth > DEEPEST:
            raise _OddError(f"its nodes are nested deeper than {DEEPEST} levels")
        if "mesh" in node:
            _index(node["mesh"], tree["meshes"])
        found[number] = node
        waiting += [(child, depth + 1) for child in node.get("children", ())]
    return list(found.values())


def _packed(tree: Tree, binary: bytes) -> bytes:
    """A file of these parts."""
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    body = _CHUNK.pack(len(text), _JSON) + text + _CHUNK.pack(len(binary), _BINARY) + binary
    return _HEAD.pack(b"glTF", 2, _HEAD.size + len(body)) + body
