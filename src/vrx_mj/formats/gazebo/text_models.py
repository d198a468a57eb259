"""Models of Gazebo whose SDF comes as a text over a network: no file is read but those of the catalogue and the path.

The path of models is that of the environment's variables; nothing is looked for beside the text or in the current
folder.
"""

from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

from vrx_mj.config.search import SCHEME, catalogue
from vrx_mj.errors import first_lines
from vrx_mj.formats.gazebo.document import Element, Report, markup, read_document
from vrx_mj.formats.gazebo.models import PATHS, has_model, is_template, model_element, model_file, model_name
from vrx_mj.formats.gazebo.sdf_boats import boat_pose, is_boat
from vrx_mj.formats.gazebo.sdf_models import pose_of, safe_name
from vrx_mj.formats.gazebo.sdf_objects import model_section
from vrx_mj.frames import Pose

_MOST_NOTES = 3
"""Parts of a model that is not taken over as it is, which a message names."""


class TextModel(NamedTuple):
    """A model whose SDF came as a text."""

    model: str | Path
    """Name in the catalogue, or path of the file of a model."""
    pose: Pose
    """Pose that the text itself gives [m, rad]."""
    title: str
    """Description of the model."""
    is_boat: bool = False
    """Whether it has thrusters."""
    notes: tuple[str, ...] = ()
    """Parts that differ here or are ignored."""


def model_of_text(text: str, folder: Path) -> TextModel:
    """The model that an SDF text brings: of several models or includes the first, as in Gazebo.

    A model of a name that the catalogue knows is the catalogue's. One that is on the path of models as it is in the
    text is that, with its meshes. Any other is the text alone, which is written to `folder`.

    Raises:
        ConfigError: it is no SDF with a model, or the model is not known.
    """
    file = folder / "text" / "model.sdf"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8", errors="replace")
    root = read_document(file)
    found = next((one for one in root.walk() if one.tag in {"model", "include"}), None)
    if found is None or root.tag not in {"sdf", "gazebo", "model", "world"}:
        raise root.fault("expected <sdf> with a <model> or an <include>")
    included = found.tag == "include"
    name = model_name(found) if included else found.attributes.get("name", "")
    x, y, z, roll, pitch, yaw = pose_of(found).value
    pose = x, y, z, roll, pitch, yaw
    if name in catalogue("objects"):
        return TextModel(name, pose, f"the catalogue's {name}")
    there = model_file(SCHEME + name, file.parent) if has_model(name, file.parent) else None
    if included and there is None:
        raise found.fault(f"no model '{name}' in `vrx-mj list objects`, nor on {PATHS[0]} or {PATHS[1]}", "uri")
    if there is not None and (included or _is_text_of(there, found)):
        own, title, notes = there.absolute(), f"{SCHEME}{name}", False
    else:
        own, title, notes = folder / "own" / safe_name(name) / "model.sdf", f"the SDF's own {safe_name(name)}", True
        own.parent.mkdir(parents=True, exist_ok=True)
        file.replace(own)
    if not is_template(own) and is_boat(model_element(own).model):
        return TextModel(own, boat_pose(pose, own), title, is_boat=True)
    return TextModel(own, pose, title, notes=_notes(own) if notes else ())


def _is_text_of(file: Path, model: Element) -> bool:
    """Whether the model in a file is another one, but for comments and blanks."""
    if is_template(file):
        return False
    ours, theirs = (ET.tostring(markup(one, str)) for one in (model_element(file).model, model))
    return ours == theirs


def _notes(file: Path) -> tuple[str, ...]:
    """Parts of an object that differ here or are ignored."""
    report = Report()
    model_section(file, report)
    notes = dict.fromkeys(f"{note.what} {note.fate}: {note.ours}" for note in report.notes if note.fate != "taken over")
    return tuple(first_lines(notes, _MOST_NOTES))
