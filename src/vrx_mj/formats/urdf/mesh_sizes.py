"""How much a mesh file (OBJ, STL, COLLADA, glTF) would come to, counted before it is loaded."""

import json
import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NoReturn

from vrx_mj.errors import VrxError

MAX_TRIANGLES = 200_000
"""Most triangles of a mesh; MuJoCo's own limit for STL files."""
MAX_POINTS = 600_000
"""Most points of a mesh: three for each triangle."""
MAX_PARTS = 1000
"""Most parts of a mesh, each place of one that is repeated counted."""

_STL_HEAD, _STL_TRIANGLE = 84, 50
_CORNERS = re.compile(r"^[ \t]*f([^\n]*)", re.MULTILINE)
_MATERIAL = re.compile(r"^[ \t]*usemtl\b([^\n]*)", re.MULTILINE)
_PLY_HEAD = 20_000
_PLY_END = re.compile(rb"end_header[ \t]*\r?\n")
_PLY_SIZES = {"char": 1, "uchar": 1, "int8": 1, "uint8": 1, "short": 2, "ushort": 2, "int16": 2, "uint16": 2,
              "float16": 2, "int": 4, "uint": 4, "int32": 4, "uint32": 4, "float": 4, "float32": 4, "int64": 8,
              "uint64": 8, "double": 8, "float64": 8}  # fmt: skip
_LINE_ENDS = tuple(end.encode() for end in ("\n", "\r", "\v", "\f", "\x1c", "\x1d", "\x1e", "\x85", "\u2028", "\u2029"))


def refuse(name: str, reason: str) -> NoReturn:
    """Raise the error about a mesh."""
    raise VrxError(f"mesh {name} {reason}")


def check_counts(name: str, points: int = 0, triangles: int = 0, parts: int = 0) -> None:
    """Refuse a mesh of more than is allowed of anything."""
    if triangles > MAX_TRIANGLES:
        refuse(name, f"has {triangles:,} triangles; at most {MAX_TRIANGLES:,} are allowed: "
                     "simplify it, for example with Blender's Decimate")  # fmt: skip
    if points > MAX_POINTS:
        refuse(name, f"has {points:,} points; at most {MAX_POINTS:,} are allowed: simplify it")
    if parts > MAX_PARTS:
        refuse(name, f"has {parts:,} parts, those that are repeated counted each time; at most {MAX_PARTS:,} are "
                     "allowed: export it as one mesh")  # fmt: skip


def checked_text(name: str, content: bytes, kind: str) -> str:
    """The text of a file that has no other encoding than UTF-8: guessing one takes long."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        refuse(name, f"cannot be read: byte 0x{content[error.start]:02X} of its {kind} text is not UTF-8")


def is_binary_stl(content: bytes) -> bool:
    """Whether an STL file is a binary one, and whole: the other kind is text."""
    return len(content) >= _STL_HEAD and len(content) == _STL_HEAD + _STL_TRIANGLE * _stl_count(content)


def _stl_count(content: bytes) -> int:
    """Triangles of a binary STL, by its header."""
    count: int = struct.unpack_from("<I", content, _STL_HEAD - 4)[0] if len(content) >= _STL_HEAD else 0
    return count


def sized_stl(name: str, content: bytes) -> bytes:
    """An STL file whose triangles are few enough and all there."""
    count = _stl_count(content)
    if is_binary_stl(content):
        check_counts(name, triangles=count)
        return content
    if content[:_STL_HEAD].lstrip()[:5].lower() != b"solid" or b"\0" in content[:_STL_HEAD]:
        if len(content) < _STL_HEAD:
            refuse(name, "is empty: it has no triangles")
        refuse(name, f"cannot be read: its header says {count:,} triangles, which take "
                     f"{_STL_HEAD + _STL_TRIANGLE * count:,} bytes; the file has {len(content):,}")  # fmt: skip
    text = checked_text(name, content, "STL").lower()
    check_counts(name, triangles=text.count("vertex") // 3, parts=text.count("endsolid"))
    return text.encode()


def sized_obj(name: str, content: bytes) -> bytes:
    """A Wavefront OBJ whose points and corners are few enough."""
    text = checked_text(name, content, "OBJ").replace("\r\n", "\n").replace("\r", "\n").replace("\\\n", "")
    triangles = sum(max(len(found[1].split()) - 2, 1) for found in _CORNERS.finditer(text))
    points = max(text.count(f"\n{mark} ") for mark in ("v", "vn", "vt"))
    check_counts(name, points, triangles, parts=len({found[1] for found in _MATERIAL.finditer(text)}))
    return text.encode()


def sized_ply(name: str, content: bytes) -> bytes:
    """A PLY file whose points and faces are few enough and all there; edges become an element that is ignored."""
    end = _PLY_END.search(content, 0, _PLY_HEAD)
    head = content[: end.start()].decode("ascii", "replace").split("\n") if end else []
    if end is None or head[0].strip().lower() != "ply" or len(head) < 2:
        refuse(name, "cannot be read: it is not a PLY file, or is damaged")
    counts, sizes = _ply_elements(name, head)
    check_counts(name, points=counts.get("vertex", 0), triangles=counts.get("face", 0))
    left = len(content) - end.end()
    if "ascii" in head[1]:
        lines = sum(content.count(mark, end.end()) for mark in _LINE_ENDS)
        needed, has = sum(counts.values()), f"{lines:,} lines"
        fits = needed - 1 <= lines <= needed + MAX_PARTS
    else:
        needed = sum(count * sizes[element] for element, count in counts.items())
        fits, has = needed <= left, f"{left:,} bytes"
    if not fits:
        refuse(name, f"cannot be read: its header says {needed:,} {has.split()[1]} of data; the file has {has}")
    return content[: end.end()].replace(b"element edge ", b"element unread ") + content[end.end() :]


def _ply_elements(name: str, head: list[str]) -> tuple[Mapping[str, int], Mapping[str, int]]:
    """How many there are of each element, and how many bytes one has at least."""
    counts: dict[str, int] = {}
    sizes: dict[str, int] = {}
    for line in head:
        words = line.split()
        if words[:1] == ["element"]:
            if len(words) != 3 or not re.fullmatch("[0-9]{1,9}", words[2]) or words[1] in counts:
                refuse(name, f"cannot be read: '{line.strip()[:60]}' in its header is not an element with a count")
            element = words[1]
            counts[element], sizes[element] = int(words[2]), 0
        elif words[:1] == ["property"] and counts:
            kind = words[2] if words[1:2] == ["list"] and len(words) == 5 else words[1] if len(words) == 3 else ""
            if kind not in _PLY_SIZES:
                refuse(name, f"cannot be read: '{line.strip()[:60]}' in its header is not a property")
            sizes[element] += _PLY_SIZES[kind]
    for element, count in counts.items():
        if count and not sizes[element]:
            refuse(name, f"cannot be read: its element '{element[:60]}' has no properties")
    return counts, sizes


MAX_TAGS = 200_000
"""Most tags and, apart from them, attributes of a file; each takes some 200 bytes."""
MAX_NODES = 20_000
"""Most nodes, and things in them, each place of one that is repeated counted."""
DEEPEST = 60
"""Levels of nodes in nodes, those that they refer to included."""

_ENCODING = re.compile(rb"^\s*<\?xml[^>]*?encoding\s*=\s*[\"']([^\"']*)[\"']")
_KNOWN_ENCODINGS = {"utf-8", "us-ascii", "ascii", "iso-8859-1", "latin1", "windows-1252"}
_COLLADA_USED = {"asset", "library_effects", "library_images", "library_materials", "library_geometries",
                 "library_nodes", "library_visual_scenes", "scene"}  # fmt: skip
"""What is handed on: the shape and its colours; no animations, controllers or cameras. Pictures are never opened."""
_NEEDED_OF_ASSET = {"unit", "up_axis"}
_FACES = {"triangles", "tristrips", "trifans", "polylist", "polygons"}


class _OddError(Exception):
    """What is wrong with a file."""


def sized_dae(name: str, content: bytes) -> bytes:
    """A Collada file whose shapes are few enough, each place of one counted, without what is not a shape."""
    from lxml import etree

    try:
        _check_text(content)
        root = etree.fromstring(content, etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True))
        _strip(root)
        shapes = _shapes(root)
        places = [place for scene in root.iterfind(".//{*}visual_scene") for place in _collada_placed(root, scene)]
    except _OddError as error:
        refuse(name, str(error))
    except (etree.XMLSyntaxError, ValueError, LookupError):
        refuse(name, "cannot be read: it is not a DAE file, or is damaged")
    for counts in (list(shapes.values()), [shapes[place] for place in places if place in shapes]):
        check_counts(name, *map(sum, zip(*counts, strict=True)))
    plain: bytes = etree.tostring(root, encoding="utf-8", xml_declaration=True)
    return plain


def _check_text(content: bytes) -> None:
    """Collada is XML, in which a short text can expand to a huge one."""
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
    """Remove what is neither a shape nor a colour of one."""
    for part in list(root):
        if _tag(part) not in _COLLADA_USED:
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
        found[name] = max(found.get(name, (0, 0, 0)), _collada_counts(shape))
    return found


def _collada_counts(shape: Any) -> tuple[int, int, int]:
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


def _collada_placed(root: Any, scene: Any) -> Iterator[str]:
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


MAX_JSON = 8_000_000
"""Bytes of the JSON in a file."""
MAX_ITEMS = 20_000
"""Most accessors, and most of anything else that is listed in it."""

_HEAD, _CHUNK = struct.Struct("<4sII"), struct.Struct("<II")
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
_SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
"""Bytes of a number, by glTF's `componentType`."""
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_HARMLESS = re.compile(r"KHR_(materials|texture|lights)_\w+|KHR_mesh_quantization|EXT_texture_\w+")
"""Extensions without which a mesh has the same shape, or that the reader knows."""
_GLTF_USED = {
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


def sized_glb(name: str, content: bytes) -> bytes:
    """A glTF file whose sizes are those of its data and few enough, without what is not a mesh."""
    try:
        text, binary = _chunks(content)
        tree = _plain(json.loads(text))
        _check_accessors(tree, len(binary))
        shapes = [_gltf_counts(tree, mesh) for mesh in tree["meshes"]]
        used = [shapes[node["mesh"]] for node in _gltf_placed(tree) if "mesh" in node]
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
    for part, keys in _GLTF_USED.items():
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


def _plain_primitive(primitive: Tree) -> dict[str, object]:
    kept = {key: primitive[key] for key in ("indices", "material", "mode") if key in primitive}
    attributes = primitive["attributes"]
    return kept | {"attributes": {key: attributes[key] for key in ("POSITION", "COLOR_0") if key in attributes}}


def _index(value: object, items: Sequence[object]) -> int:
    """A reference to an item, which must be there."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < len(items):
        raise ValueError
    return value


def _whole(value: object) -> int:
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


def _gltf_counts(tree: Tree, mesh: Tree) -> tuple[int, int, int]:
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


def _gltf_placed(tree: Tree) -> list[Tree]:
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
