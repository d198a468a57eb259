"""Writes the gallery, docs/gallery.md and its pictures: every object, dock, robot and world of the catalogue.

Run by hand after the catalogue has changed: `python tools/gallery.py` (3 minutes; it needs EGL or OSMesa, see
`vrx-mj doctor`). `python tools/gallery.py --text` writes the page alone.
"""

import argparse
import functools
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from vrx_mj.config.objects import ObjectConfig
from vrx_mj.config.objects import load_object as load
from vrx_mj.config.robots import load_robot
from vrx_mj.config.search import catalogue
from vrx_mj.config.world import load_world

DOCS = Path(__file__).resolve().parents[1] / "docs"
FOLDER = "gallery"
"""Of the pictures, in docs."""
HEAD = """# Gallery

Everything in the catalogue, drawn by vrx_mj's own camera and map. The names are those used in YAML files: `model:` of
an object, `layout:` of a dock, `robot:` of a boat, `extends:` of a world. `vrx-mj list KIND --verbose` prints the same
lists, including your own files.

`tools/gallery.py` writes this page.
"""
RECORDINGS = """## Recordings

Recordings in rerun's viewer, with the dark and the light theme: the README's run, a storm of 1.2 m, one boat in open
water, 20 boats, wayfinding, docking and a collision. Below them are camera images of the storm from heights of 0.5, 2,
12, 60 and 200 m, and the example course in RViz and in Lichtblick. `python tools/look.py FOLDER --gallery` makes this
picture.

[![Recordings in rerun's viewer](gallery/recordings.webp)](gallery/recordings.webp)
"""
load_object = functools.cache(load)
LIGHTS = "robotx_light_buoy"
LIGHT_TEXT = "The last three letters are the colours that the panels show in turn. The pictures show the first colour."


@dataclass(frozen=True)
class Sheet:
    """Things of the catalogue that share a picture."""

    title: str
    names: tuple[str, ...]
    text: str = ""

    @property
    def file(self) -> str:
        """The picture, in docs."""
        return f"{FOLDER}/{re.sub('[^a-z0-9]+', '_', self.title.lower())}.webp"


def _starts(*stems: str) -> Callable[[str], bool]:
    return lambda name: name.startswith(stems)


OBJECTS: tuple[tuple[str, str, Callable[[str], bool]], ...] = (
    ("Marker buoys", "", _starts("mb_marker", "surmark")),
    ("Round buoys and totems", "", lambda name: _starts("mb_round", "polyform")(name) or name.endswith("_totem")),
    ("Light buoys", LIGHT_TEXT, _starts(LIGHTS)),
    ("Animals", "In the worlds they swim along paths.", _starts("crocodile", "platypus", "turtle", "moving_pinger")),
    ("Dock blocks and placards", "", _starts("dock_block", "placard", "post")),
    ("Symbols", "Symbols on placards.", _starts("symbol")),
    ("Docks of VRX", "A `_base` dock has no placards. A `_dynamic` dock floats.", _starts("dock_20")),
    ("Ashore", "", _starts("antenna", "chair", "ground_station", "table", "tent")),
)
"""Objects that are no courses, in the order of the page; the rest is in `OTHERS`."""
OTHERS = "Other objects"
COURSES = "Courses"


def object_sheets() -> Iterator[Sheet]:
    """The objects in groups, courses last."""
    left = [name for name in catalogue("objects") if not _is_course(load_object(name))]
    for title, text, belongs in OBJECTS:
        yield Sheet(title, tuple(name for name in left if belongs(name)), text)
        left = [name for name in left if not belongs(name)]
    yield Sheet(OTHERS, tuple(left))
    courses = tuple(name for name in catalogue("objects") if _is_course(load_object(name)))
    yield Sheet(COURSES, courses, "Objects that consist of other objects, seen from above: x points right, y up.")


def _is_course(thing: ObjectConfig) -> bool:
    return bool(thing.objects) and not thing.docks and "ground" not in thing.description


def stock_worlds() -> tuple[str, ...]:
    """The worlds that are in no group."""
    return tuple(name for name in catalogue("worlds") if "/" not in name)


def competition_worlds() -> dict[str, dict[str, list[str]]]:
    """Year and phase -> task -> the worlds of it, in order."""
    grouped: dict[str, dict[str, list[str]]] = {}
    for name in catalogue("worlds"):
        group, _, short = name.rpartition("/")
        if group and group != "base":
            task = re.sub(r"\d+[a-z]?$", "", short)
            grouped.setdefault(group, {}).setdefault(task, []).append(name)
    return grouped


def competition_sheets() -> Iterator[Sheet]:
    """A sheet for each year, with the first world of each task."""
    for year, groups in groupby(competition_worlds().items(), key=lambda item: item[0].split("/")[0]):
        names = [worlds[0] for _, tasks in groups for worlds in tasks.values()]
        yield Sheet(f"Worlds of {year.removeprefix('vrx')}", tuple(names))


ROBOTS = Sheet("Robots", tuple(catalogue("robots")))
DOCKS = Sheet("Dock drawings", tuple(catalogue("docks")))
VIEWS = Sheet("Worlds", stock_worlds())


# The page


def page() -> str:
    """The text of docs/gallery.md."""
    parts = [HEAD, RECORDINGS, "## Worlds\n", *_world_parts(), "## Competition worlds\n", *_competition_parts()]
    parts += ["## Robots\n", _section(ROBOTS, {name: load_robot(name).description for name in ROBOTS.names})]
    parts += ["## Dock drawings\n", "Drawings in `assets/docks`. A dock is fixed unless it has `dynamic: true`.\n"]
    parts += [_section(DOCKS, dict.fromkeys(DOCKS.names, "")), "## Objects\n"]
    for sheet in object_sheets():
        parts += [f"### {sheet.title}\n", *([f"{sheet.text}\n"] if sheet.text else [])]
        parts.append(_section(sheet, {name: load_object(name).description for name in sheet.names}))
    return "\n".join(parts)


def _section(sheet: Sheet, descriptions: Mapping[str, str]) -> str:
    lines = [f"- `{name}`" + (f": {text}" if text else "") for name, text in descriptions.items()]
    return f"![{sheet.title}]({sheet.file})\n\n" + "\n".join(lines) + "\n"


def _world_parts() -> Iterator[str]:
    yield "Views from behind the boat, 5 s after the start. A world without a sea is drawn without water.\n"
    yield f"![{VIEWS.title}]({VIEWS.file})\n"
    for name in VIEWS.names:
        yield f"### {name}\n"
        yield f"{_sentence(load_world(name).description)}\n"
        yield f"[![Map of {name}]({_map_file(name)})]({_map_file(name)})\n"  # a small screen can open it


def _competition_parts() -> Iterator[str]:
    yield (
        "VRX's published practice and competition worlds. Worlds with the same task differ in sea, wind, fog and the\n"
        "positions of objects. The maps show the first world of each task. Rules: [Tasks and scores](tasks.md).\n"
    )
    worlds = competition_worlds()
    for sheet in competition_sheets():
        yield f"### {sheet.title}\n"
        yield f"![{sheet.title}]({sheet.file})\n"
        groups = [group for group in worlds if group.split("/")[0] == sheet.names[0].split("/")[0]]
        for group in groups:
            shown = ", ".join(_numbered(task, names) for task, names in worlds[group].items())
            yield f"- `{group}/`: {shown}"
        yield ""


def _numbered(task: str, names: list[str]) -> str:
    """The worlds of a task in short: `dock0` to `dock5`."""
    shorts = [f"`{name.rpartition('/')[2]}`" for name in names]
    return shorts[0] if len(shorts) == 1 else f"{shorts[0]} to {shorts[-1]} ({len(shorts)})"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:].rstrip(".") + "."


def _map_file(name: str) -> str:
    return f"{FOLDER}/map_{name}.webp"


# The pictures


def draw() -> None:
    """Write all pictures."""
    import gallery_pictures as pictures

    import vrx_mj

    _draw_things(pictures)
    worlds = {name: vrx_mj.compile_world(name) for name in VIEWS.names}
    pictures.draw_sheet({name: pictures.view_tile(world) for name, world in worlds.items()}, DOCS / VIEWS.file)
    for name, world in worlds.items():
        pictures.large_map(world, DOCS / _map_file(name))
    for sheet in competition_sheets():
        maps = {name.partition("/")[2]: pictures.map_tile(vrx_mj.compile_world(name)) for name in sheet.names}
        pictures.draw_sheet(maps, DOCS / sheet.file)


def _draw_things(pictures: Any) -> None:
    sheets = list(object_sheets())
    courses = sheets.pop()
    things = {name: "object" for sheet in sheets for name in sheet.names}
    azimuth = {name: 25.0 if name.startswith("dock_20") else -60.0 for name in things}
    elevation = {name: 28.0 if name.startswith("dock_20") else 16.0 for name in things}
    tiles = pictures.stage_tiles(things, azimuth, elevation)
    for sheet in sheets:
        pictures.draw_sheet({name: tiles[name] for name in sheet.names}, DOCS / sheet.file)
    pictures.draw_sheet({name: pictures.course_tile(name) for name in courses.names}, DOCS / courses.file)
    docks = dict.fromkeys(DOCKS.names, "dock")
    pictures.draw_sheet(
        pictures.stage_tiles(docks, dict.fromkeys(docks, 25.0), dict.fromkeys(docks, 28.0)), DOCS / DOCKS.file
    )
    robots = dict.fromkeys(ROBOTS.names, "robot")
    tiles = pictures.stage_tiles(robots, dict.fromkeys(robots, -40.0), dict.fromkeys(robots, 14.0), pictures.WIDE)
    pictures.draw_sheet(tiles, DOCS / ROBOTS.file, columns=2)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--text", action="store_true", help="write the page alone")
    options = parser.parse_args()
    (DOCS / "gallery.md").write_text(page(), encoding="utf-8", newline="\n")
    if not options.text:
        draw()
