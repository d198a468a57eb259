"""The layouts in VRX's dock templates (`model.sdf.erb`), which are Ruby: they are read, and nothing is run."""

import re
from pathlib import Path

from vrx_mj.config.search import display
from vrx_mj.config.tree import File, Place
from vrx_mj.config.wording import literal
from vrx_mj.errors import ConfigError
from vrx_mj.formats.gazebo.document import Note, Report
from vrx_mj.formats.series.pieces import Content
from vrx_mj.formats.urdf.xml_document import read_bytes

_ENDING = ".sdf.erb"
_MOST_ROWS = 200
_LONGEST = 40_000
"""Characters of a layout."""
_LAYOUT = re.compile(r"^[^#\n]*?\blayout\s{0,80}=\s{0,80}\[", re.MULTILINE)
"""A layout that is no comment."""
_END = re.compile(r"[ \t]{0,80}(?:%>|#|\r?\n|\Z)")
"""What may follow a layout: another operation would make another list of it."""
_ITEM = re.compile(r"(?:'([^'\n]*)'|\"([^\"\n]*)\"|(true|false)|(#[^\n]*))\s*(,|\Z|(?=\n))", re.DOTALL)
_NAME = re.compile(r"<model\s+name\s*=\s*[\"']([^\"'<>]{1,100})[\"']")


def is_template(file: Path) -> bool:
    """Whether a file is a template of a dock."""
    return file.name.lower().endswith(_ENDING)


def template_content(file: Path, report: Report) -> tuple[Content, Place]:
    """The dock of a template in the keys of an object's file, and where its layout begins.

    A layout is a list of rows, with `true` for a dock that is fixed, or `false` for one that floats, as its last entry.

    Raises:
        ConfigError: there is no layout in it, or another thing than rows.
    """
    text = read_bytes(file).decode("utf-8", errors="replace")
    source = File(display(file), file.parent, tuple(text.split("\n")))
    found = _LAYOUT.search(text)
    place = Place(source, text.count("\n", 0, found.start()) + 1 if found else 1)
    end = text.find("]", found.end(), found.end() + _LONGEST) if found else -1
    if found is None or end < 0 or not _END.match(text, end + 1):
        message = "expected `layout = ['X  X', ...]`: a template is Ruby, of which only this list is read"
        raise ConfigError([place.problem("layout", message)])
    rows, static = _rows(text[found.end() : end], place)
    name = _NAME.search(text)
    kind = "fixed" if static else "floating"
    report.notes.append(Note(place, "layout", "taken over", f"`docks`: {len(rows)} rows, {kind}"))
    dock = {"name": "base", "layout": rows, **({} if static else {"dynamic": True})}
    return {"description": f"{name[1] if name else file.parent.name}, a dock of Gazebo", "docks": [dock]}, place


def _rows(text: str, place: Place) -> tuple[list[str], bool]:
    items, rest = _ITEM.findall(text), _ITEM.sub("", text).strip(" \t\r\n,")
    if rest or len(items) > _MOST_ROWS:
        message = f"expected rows in quotes, and true or false at last, got {literal(rest or text)}"
        raise ConfigError([place.problem("layout", message)])
    rows = [single + double for single, double, switch, comment, _ in items if not (switch or comment)]
    static = [item[2] for item in items if item[2]][-1:] != ["false"]
    if not any("X" in row for row in rows):
        raise ConfigError([place.problem("layout", "no X in it: a block is a capital X")])
    return ["".join(letter if letter == "X" else " " for letter in row) for row in rows], static
