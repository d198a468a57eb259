"""URDF text as a `Urdf`, with its meshes; what is wrong with it, and what is suspicious, is said at once."""

import re
import warnings
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from vrx_mj.config.search import display
from vrx_mj.errors import VrxError, VrxWarning, first_names
from vrx_mj.foreign import ask
from vrx_mj.formats.urdf.elements import Findings
from vrx_mj.formats.urdf.expand import ExpandedText
from vrx_mj.formats.urdf.meshes import MeshFiles, with_shapes
from vrx_mj.formats.urdf.model import LinkRow, Urdf
from vrx_mj.formats.urdf.xml_document import WORDING

ODD = WORDING["suspicious"]
"""What is legal but suspicious, each said once for all that have it."""


def read_urdf(text: str, file: Path, files: MeshFiles | None = None, *, label: str = "") -> Urdf:
    """The robot that a URDF's text describes; xacro is expanded before.

    Args:
        text: The URDF; messages name the files and lines that expanded text comes from.
        file: Where it is from; messages name it, and relative paths of meshes start in its folder.
        files: Where its meshes may be; by default in the folder of `file` and in packages around it.
        label: What messages call the text, where its lines are not those of the file.

    Raises:
        ConfigError: With everything that is wrong, each with its line and element.

    Warns:
        VrxWarning: Once for each kind of thing that is legal but suspicious.
    """
    label = label or display(file)
    source = (
        (list(map(display, map(Path, text.made.files))), text.made.places) if isinstance(text, ExpandedText) else ()
    )
    robot, rows, findings = ask(
        "formats.urdf.kinematics:reading", text, file, label, *source,
        returns=tuple[Urdf, tuple[LinkRow, ...], Findings], about=label,
    )  # fmt: skip
    files = files or MeshFiles(file.absolute().parent)
    links = {row.link.name: with_shapes(row, files, findings) for row in rows}
    findings.settle()
    warn(findings)
    return replace(robot, links=links)


def read_joints(text: str) -> Urdf:
    """The tree of a URDF alone: the names of its links, and its joints.

    Raises:
        ConfigError: The text is no URDF, or its joints are wrong.
    """
    return ask("formats.urdf.kinematics:tree", text, "robot_description", returns=Urdf, about="robot_description")


@lru_cache(maxsize=64)
def in_namespace(text: str, namespace: str) -> str:
    """A URDF's text with its names in another namespace, as VRX's argument `namespace` has it.

    Links, joints, frames and topics begin with the namespace; so does what refers to them. Text whose root link has no
    namespace, and text that is no robot, stays as it is.
    """
    own = namespace_of(text)
    if own in {"", namespace}:
        return text
    name = re.escape(own)
    beginning = re.compile(rf"""(filename\s*=\s*(?:"[^"]*"|'[^']*'))|(=\s*["']\s*/?|>\s*/?){name}/""")
    alone = re.compile(rf"(<(robotNamespace|namespace)>\s*/?){name}(/?\s*</\2>)")
    text = beginning.sub(lambda found: found[1] or f"{found[2]}{namespace}/", text)
    return alone.sub(lambda found: f"{found[1]}{namespace}{found[3]}", text)


def namespace_of(text: str) -> str:
    """The namespace of a URDF's root link; empty if it has none, and for text that is not a robot."""
    try:
        return read_joints(text).namespace
    except VrxError:
        return ""


def warn(findings: Findings) -> None:
    """Warn of what is suspicious, once for each kind of it."""
    for kind, things in findings.odd.items():
        warnings.warn(f"{findings.file}: {ODD[kind]}: {first_names(things, 8)}", VrxWarning, stacklevel=4)
