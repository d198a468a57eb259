"""Models of Gazebo (SDF): where their folders and files are, and the models in them.

The layouts in VRX's dock templates (`model.sdf.erb`) are Ruby: they are read, and nothing is run.
"""

import contextlib
import os
import re
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from vrx_mj.config.search import (
    MODEL_SUFFIXES,
    SCHEME,
    TEMPLATE,
    allowed_folders,
    contained_file,
    display,
    is_inside,
    leaves_folder,
    listed_in,
    package_paths,
    workspace_packages,
)
from vrx_mj.config.tree import File, Place, literal
from vrx_mj.errors import ConfigError, UnknownNameError, VrxError
from vrx_mj.formats.gazebo.document import NEEDED, Element, Note, Report, faults_at, is_file, parse_ahead, read_document
from vrx_mj.formats.series.pieces import Content
from vrx_mj.formats.urdf.xml_document import read_bytes

_CONFIG = "model.config"
"""Name of the file beside the SDF in the folder of a model."""
_MOST_AHEAD = 500
"""Models that are parsed ahead."""
ROBOT = "robot.yaml"
"""Name of the file that makes a folder a robot."""
PATHS = ("GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "SDF_PATH")
"""Environment variables with folders in which models are."""
NO_MODEL = "is its folder on GAZEBO_MODEL_PATH?"
"""Advice where a model is not found."""
_ENDING = ".sdf.erb"
_MOST_ROWS = 200
_MAX_LAYOUT = 40_000
"""Longest layout [characters]."""
_LAYOUT = re.compile(r"^[^#\n]*?\blayout\s{0,80}=\s{0,80}\[", re.MULTILINE)
"""A layout that is no comment."""
_END = re.compile(r"[ \t]{0,80}(?:%>|#|\r?\n|\Z)")
"""End of a layout: another operation would make another list of it."""
_ITEM = re.compile(r"(?:'([^'\n]*)'|\"([^\"\n]*)\"|(true|false)|(#[^\n]*))\s*(,|\Z|(?=\n))", re.DOTALL)
_NAME = re.compile(r"<model\s+name\s*=\s*[\"']([^\"'<>]{1,100})[\"']")


class Source(NamedTuple):
    """A model of Gazebo as a file has it."""

    model: Element
    version: tuple[int, ...]
    """Version of SDF that it is in; empty: the newest."""
    file: Path
    """The file that the model is written in."""


def is_gazebo_model(text: str) -> bool:
    """Whether what a file names as a model is one of Gazebo: `model://NAME`, a `.sdf`, or `FILE#NAME` in a world."""
    return text.startswith(SCHEME) or text.partition("#")[0].lower().endswith(MODEL_SUFFIXES)


def model_name(include: Element) -> str:
    """The name in the `<uri>` of an `<include>`: that of a folder of models, or of one on Gazebo's server."""
    uri = include.value_of("uri", "text", NEEDED)
    with faults_at(include, "uri"):
        return uri_name(uri)


def uri_name(uri: str) -> str:
    """The name of the model that a URI means. Raises VrxError."""
    scheme, mark, rest = uri.partition("://")
    name = PurePosixPath(rest if mark else uri).name
    if scheme.lower() == "file" or ".." in PurePosixPath(uri).parts or uri.startswith("/") or not name:
        raise VrxError(f"expected a model name, as model://NAME, got {literal(uri)}")
    return name


def has_model(name: str, near: Path) -> bool:
    """Whether a folder of this name is on the path of models."""
    return _model_folder(name, near) is not None


def model_file(text: str, near: Path | None) -> Path:
    """The file of a model that another file names, with `#NAME` if that is one in a world.

    Raises:
        VrxError: there is none.
    """
    if text.startswith(SCHEME):
        name = text.removeprefix(SCHEME)
        folder = _model_folder(name, near or Path.cwd())
        if folder is None:
            raise VrxError(f"no model '{name}' beside the file, nor on {PATHS[0]} or {PATHS[1]}")
        return folder / _main_file(folder)
    path, mark, name = text.partition("#")
    return Path(f"{contained_file(path, near)}{mark}{name}")


def file_in_folder(text: object, near: Path | None = None) -> Path | None:
    """The file of the robot or model in a folder that a path leads to; None: it leads to no folder of one.

    In a file the folder must be inside that of the file, `near`, or allowed; on the command line it may be anywhere.

    Raises:
        VrxError: it is elsewhere.
    """
    if not isinstance(text, str | Path) or "/" not in str(text):
        return None
    folder = (near or Path.cwd()) / text
    if os.path.isfile(folder / ROBOT):  # noqa: PTH113 - too long a name raises
        main = _within(folder, ROBOT)
    elif os.path.isdir(folder) and _is_model(folder):  # noqa: PTH112
        main = _main_file(folder)
    else:
        return None
    if near is not None and not is_inside(folder, near, *allowed_folders()):
        raise leaves_folder(str(text))
    return folder / main


def model_element(file: Path) -> Source:
    """The model of a file, or `FILE#NAME`: that of this name in a world.

    Raises:
        ConfigError: it cannot be read, or is no model.
    """
    path, mark, name = str(file).partition("#")
    if mark:
        return _named_model(Path(path), name)
    root = read_document(Path(path))
    return Source(_only(root), version_of(root), Path(path))


def _only(root: Element) -> Element:
    """The model of a file; of several the first."""
    found = next((one for one in root.walk() if one.tag == "model"), None)
    if found is None:
        if any(one.tag == "world" for one in root.walk()):
            raise root.fault("this is a world without a <model>: pass it as WORLD")
        inside = ", ".join(dict.fromkeys(f"<{one.tag}>" for one in root.children)) or "nothing"
        raise root.fault(f"expected <sdf> with a <model>, got {inside}")
    return found


_held: dict[Path, tuple[int, int, dict[str, Element], tuple[int, ...]]] = {}
"""Models of the world that was read last, by its file, with the time, size and version of SDF that the file had."""


def hold_models(file: Path, root: Element) -> None:
    """Hold the models of a world for those who name them, and have those that it includes parsed by two questions."""
    _held.clear()
    found = [(one.attributes.get("name", ""), one) for one in root.walk() if one.tag == "model"]
    found += [(included_name(one), one) for one in root.walk() if one.tag == "include"]
    status = file.stat()
    _held[file.absolute()] = (status.st_mtime_ns, status.st_size, dict(reversed(found)), version_of(root))
    uris = dict.fromkeys(one.text("uri").rstrip("/") for one in root.walk() if one.tag == "include")
    near_by = (folder_in_reach(uri.rpartition("/")[2], file.parent) for uri in list(uris)[:_MOST_AHEAD])
    folders, files = [*filter(None, near_by)], []
    parse_ahead(folder / _CONFIG for folder in folders if is_file(folder / _CONFIG))
    for folder in folders:
        with contextlib.suppress(VrxError):
            files.append(folder / _main_file(folder))
    parse_ahead(files)


def included_name(include: Element) -> str:
    """The name that an `<include>` gives a model, or that of its URI."""
    return include.text("name") or include.text("uri").rstrip("/").rpartition("/")[2]


def _named_model(file: Path, name: str) -> Source:
    """The model of a name in the file of a world."""
    status = file.stat() if is_file(file) else None
    held = _held.get(file.absolute())
    if held is None or status is None or held[:2] != (status.st_mtime_ns, status.st_size):
        hold_models(file, read_document(file))
        held = _held[file.absolute()]
    if name not in held[2]:
        known = [name for name in held[2] if name]
        raise ConfigError.of(display(file), str(UnknownNameError("model", name, known)), line=1)
    found = held[2][name]
    return _included_model(found, file.parent) if found.tag == "include" else Source(found, held[3], file)


def _included_model(include: Element, folder: Path) -> Source:
    """The model of an `<include>`, with what this says instead of the model's own file."""
    found = model_element(model_file(f"{SCHEME}{model_name(include)}", folder))
    instead = include.all("static")
    kept = [one for one in found.model.children if not (instead and one.tag == "static")]
    return found._replace(model=replace(found.model, children=(*instead, *kept)))


def _model_folder(name: str, near: Path) -> Path | None:
    """The folder of a model: beside the file, in `models` there or one above, or along the path; None without one.

    Raises:
        VrxError: it is a link that leads elsewhere.
    """
    if not re.fullmatch(r"\w[\w.-]{0,99}", name):
        return None
    near = near.absolute()
    around = workspace_packages(near).values()
    packages = [below for path in (*package_paths(), *around) for below in (path, path / "models")]
    beside = [near, near / "models", near.parent / "models", near.parent]
    found = next((place / name for place in (*beside, *model_paths(), *packages) if _is_model(place / name)), None)
    if found is not None and found.parent in beside and not is_inside(found, near.parent, *allowed_folders()):
        raise VrxError(f"model '{name}' is a symbolic link out of {display(near.parent)}")
    return found


def folder_in_reach(name: str, near: Path) -> Path | None:
    """The folder of a model, unless it is a link that leads elsewhere."""
    with contextlib.suppress(VrxError):
        return _model_folder(name, near)
    return None


def model_paths() -> list[Path]:
    """Folders of the environment's variables in which models are."""
    return [folder for key in PATHS for folder in listed_in(key)]


def _is_model(folder: Path) -> bool:
    return any(is_file(folder / name) for name in ("model.sdf", _CONFIG, TEMPLATE))


def _main_file(folder: Path) -> str:
    """The SDF of a folder, as its `model.config` says; of several the one of the newest version."""
    config = folder / _CONFIG
    if is_file(folder / TEMPLATE) and not is_file(folder / "model.sdf"):
        return _within(folder, TEMPLATE)
    if not is_file(config):
        return _within(folder, "model.sdf")
    _within(folder, config.name)
    named = [one for one in read_document(config).all("sdf") if one.own_text]
    found = max(named, key=version_of, default=None)
    text = found.own_text if found else "model.sdf"
    if found and PurePosixPath(text).name != text:
        raise found.fault(f"expected a file name in this folder, got {literal(text)}")
    if found and not is_file(folder / text):
        raise found.fault(f"no file {literal(text)} in this folder")
    return _within(folder, text)


def _within(folder: Path, name: str) -> str:
    """The name of a file in the folder of a model, which may not be a link to elsewhere."""
    if not is_inside(folder / name, folder, *allowed_folders()) and not is_installed(folder / name):
        raise VrxError(f"'{name}' of model '{folder.name}' is a symbolic link out of its folder")
    return name


def is_installed(file: Path) -> bool:
    """Whether a link is one of `colcon build --symlink-install`: to a folder of the same name."""
    return file.resolve().parent.name == file.parent.name


def version_of(element: Element) -> tuple[int, ...]:
    """The version of SDF that an element says; empty without one."""
    return tuple(int(part) for part in re.findall(r"\d{1,9}", element.attributes.get("version", ""), re.ASCII))


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
    end = text.find("]", found.end(), found.end() + _MAX_LAYOUT) if found else -1
    if found is None or end < 0 or not _END.match(text, end + 1):
        message = "expected `layout = ['X  X', ...]`: only this list of a Ruby template is read"
        raise ConfigError([place.problem("layout", message)])
    rows, static = _rows(text[found.end() : end], place)
    name = _NAME.search(text)
    kind = "fixed" if static else "floating"
    report.notes.append(Note(place, "layout", "imported", f"`docks`: {len(rows)} rows, {kind}"))
    dock = {"name": "base", "layout": rows, **({} if static else {"dynamic": True})}
    return {"description": f"{name[1] if name else file.parent.name}, a dock of Gazebo", "docks": [dock]}, place


def _rows(text: str, place: Place) -> tuple[list[str], bool]:
    items, rest = _ITEM.findall(text), _ITEM.sub("", text).strip(" \t\r\n,")
    if rest or len(items) > _MOST_ROWS:
        message = f"expected quoted rows, then true or false, got {literal(rest or text)}"
        raise ConfigError([place.problem("layout", message)])
    rows = [single + double for single, double, switch, comment, _ in items if not (switch or comment)]
    static = [item[2] for item in items if item[2]][-1:] != ["false"]
    if not any("X" in row for row in rows):
        raise ConfigError([place.problem("layout", "expected at least one block, a capital X")])
    return ["".join(letter if letter == "X" else " " for letter in row) for row in rows], static
