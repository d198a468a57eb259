"""The table of all elements and attributes of SDF and URDF, walked: what is read counts, what is lost is told."""

import re
import warnings
from pathlib import Path
from shutil import copytree
from xml.etree import ElementTree as ET

import pytest

from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.formats.gazebo.document import Report
from vrx_mj.formats.gazebo.sdf_boats import read_boat
from vrx_mj.formats.gazebo.sdf_objects import model_section
from vrx_mj.formats.gazebo.worlds import gazebo_world
from vrx_mj.formats.urdf.elements import section_below, sections
from vrx_mj.formats.urdf.reader import read_urdf

FOLDER = Path(__file__).parents[3] / "tags"
"""Files in which everything is that is read, by what they are and a number; and a model that they include."""
SIDES = ("object", "boat", "world", "robot")
BASES = {side: [file.read_text(encoding="utf-8") for file in sorted(FOLDER.glob(f"{side}_*"))] for side in SIDES}
CORNERS = ("0 0 0", "1 0 0", "0 1 0", "0 0 1")
FACETS = "".join(
    f"facet normal 0 0 0\nouter loop\n{''.join(f'vertex {CORNERS[c]}{chr(10)}' for c in face)}endloop\nendfacet\n"
    for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
)
STL = f"solid\n{FACETS}endsolid\n".encode()


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    copytree(FOLDER / "part", "part")
    Path("a.stl").write_bytes(STL)


def outcome(side, root):
    """What a document says here, without places, and what is told of it."""
    text = ET.tostring(root, encoding="unicode")
    Path("m.sdf").write_text(text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        if side == "object":
            report = Report()
            found, notes = model_section(Path("m.sdf"), report), report.notes
        elif side == "world":
            world = gazebo_world(Path("m.sdf"))
            found, notes = (
                (world.name, world.section, world.fleet, [n.ours for n in world.notes if n.fate != "ignored"]),
                world.notes,
            )
        else:
            robot = read_boat(Path("m.sdf")) if side == "boat" else read_urdf(text, Path("m.urdf"))
            found = robot.name, robot.links, robot.joints, robot.places, robot.gazebo.sensors, robot.gazebo.thrusters
            return re.sub(r"Place\(.*?\)", "", repr(found)), {remark[1:] for remark in robot.remarks}
    return re.sub(r"Place\(.*?\)", "", repr(found)), {(one.what, one.ours) for one in notes if one.fate == "ignored"}


def kept(notes):
    return [note.ours for note in notes if note.fate != "ignored"]


def occurrences(element, section, base=""):
    """Each element and attribute in a document: its section and path, its element, and the attribute or child."""
    for name in element.attrib:
        yield (section, f"{base}@{name}"), element, name
    for child in element if section != "plugin" else ():
        yield (section, f"{base}{child.tag}"), element, child
        yield from occurrences(child, *section_below(section, f"{base}{child.tag}"))


def start(side):
    return "robot" if side == "robot" else "sdf"


def all_in(side):
    """All elements and attributes in the documents of a side, with the number of the document and their own."""
    found = {}
    for number, text in enumerate(BASES[side]):
        for index, (key, *_) in enumerate(occurrences(ET.fromstring(text), start(side))):
            found.setdefault(key, []).append((number, index))
    return found


def without(side, number, index):
    """A document without one of its elements or attributes."""
    root = ET.fromstring(BASES[side][number])
    _, element, part = list(occurrences(root, start(side)))[index]
    if isinstance(part, str):
        del element.attrib[part]
    else:
        element.remove(part)
    return root


WORLD_SECTIONS = {"sdf", "world", "gui", "physics", "scene", "spherical_coordinates", "include"}
ROBOT_SECTIONS = {"robot"}
SENSORS = {"sensor", "camera", "ray", "lidar", "gps", "navsat", "imu", "noise"}


def rows(side, fate):
    """Sections and paths of a side whose fate is this, with words."""
    for section, paths in sections().items():
        for path, entries in paths.items() if is_of(side, section) else ():
            entry = entries.get("boat" if side == "robot" else side)
            if entry and entry.fate == fate and entry.words:
                yield section, path


def is_of(side, section):
    """Whether a section is met in documents of a side."""
    if side in {"world", "robot"}:
        return section in (WORLD_SECTIONS if side == "world" else ROBOT_SECTIONS)
    others = WORLD_SECTIONS - {"include"} | ROBOT_SECTIONS
    return section not in (others | SENSORS if side == "object" else others)


@pytest.mark.slow
@pytest.mark.parametrize("side", BASES)
def test_what_is_read_changes_what_comes_out(side):
    found, whole = all_in(side), [outcome(side, ET.fromstring(text))[0] for text in BASES[side]]
    missing, idle = [], []
    for key in rows(side, "read"):
        if key not in found:
            missing.append(key)
        elif not any(changes(side, number, index, whole[number]) for number, index in found[key]):
            idle.append(key)
    assert (missing, idle) == ([], [])


def changes(side, number, index, whole):
    try:
        return outcome(side, without(side, number, index))[0] != whole
    except ConfigError:
        return True


def host(root, side, section):
    """The first element of a document whose children are in a section; it is put there if there is none."""
    if section == start(side):
        return root
    for key, _, part in occurrences(root, start(side)):
        if not isinstance(part, str) and section_below(*key) == (section, ""):
            return part
    above, path = next(
        (home, path) for home, paths in sections().items() for path in paths
        if "@" not in path and home != section and section_below(home, path) == (section, "")
    )  # fmt: skip
    return at(host(root, side, above), path)


def at(element, path):
    """The element down a path, put there where it is not."""
    for tag in path.split("/"):
        found = element.find(tag)
        element = ET.SubElement(element, tag) if found is None else found
    return element


def put(element, path, value):
    """Write an element or attribute; the path has its tags, and after '@' the name of the attribute."""
    above, _, name = path.rpartition("/")
    holder = at(element, above) if above else element
    if name.startswith("@"):
        holder.set(name[1:], value)
        return
    found = ET.SubElement(holder, name)
    found.text = value


def other(usual):
    """A value that is not the usual one."""
    if usual in {"true", "false"}:
        return "false" if usual == "true" else "true"
    try:
        return (
            " ".join(str(float(word) + 0.5 if abs(float(word)) < 1e9 else 0.5) for word in (usual or "").split()) or "x"
        )
    except ValueError:
        return "x"


def name_of(path):
    """What is said to be lost."""
    *above, last = path.split("/")
    return f"{last[1:]} of <{above[-1] if above else ''}" if last.startswith("@") else f"<{last}>"


def told(side, root, route):
    """What is told of a document: a file, or a model in a world or included by one."""
    if route == "file":
        return outcome(side, root)[1]
    model = root.find("model")
    if route == "include":
        Path("m").mkdir(exist_ok=True)
        Path("m/model.sdf").write_bytes(ET.tostring(root))
        model = ET.fromstring("<include><uri>model://m</uri></include>")
    world = ET.fromstring(f'<sdf version="{root.get("version")}"><world name="bay"/></sdf>')
    world[0].append(model)
    return outcome("world", world)[1]


ROUTES = [(side, "file") for side in BASES] + [("object", "inline"), ("object", "include")]


@pytest.mark.slow
@pytest.mark.parametrize(("side", "route"), ROUTES)
def test_what_is_lost_is_told(side, route):
    untold = []
    for section in {section: None for section, _ in rows(side, "lost")}:
        root = ET.fromstring(BASES[side][0])
        element = host(root, side, section)
        wanted = {path: sections()[section][path]["boat" if side == "robot" else side]
                  for home, path in rows(side, "lost") if home == section}  # fmt: skip
        for path, entry in wanted.items():
            put(element, path, other(entry.usual) if entry.usual is not None else "")
        found = told(side, root, route)
        untold += [
            (section, path) for path, entry in wanted.items()
            if not any(what.startswith(name_of(path)) and why == entry.words for what, why in found)
        ]  # fmt: skip
    assert untold == []


@pytest.mark.parametrize(("side", "route"), ROUTES)
def test_what_is_harmless_changes_nothing_and_is_not_told(side, route):
    base = ET.fromstring(BASES[side][0])
    for section, path in rows(side, "harmless"):
        put(host(base, side, section), path, "1")
    plain = ET.fromstring(BASES[side][0])
    assert told(side, base, route) == told(side, plain, route)
    if route == "file":
        assert outcome(side, base)[0] == outcome(side, plain)[0]


@pytest.mark.parametrize(("side", "route"), ROUTES)
def test_what_is_in_no_table_is_told(side, route):
    root = ET.fromstring(BASES[side][0])
    element = host(root, side, "link" if side in {"boat", "object"} else start(side))
    element = element.find("world") if side == "world" else element
    put(element, "@colour", "1")
    put(element, "weather", "1")
    found = {(what, why.partition(";")[0]) for what, why in told(side, root, route)}
    assert {(f"colour of <{element.tag}>", "not recognized"), ("<weather>", "not recognized")} <= found
