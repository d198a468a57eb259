"""URDF text as a `Urdf`: every element checked, every problem of the file found at once."""

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

from vrx_mj.config.search import display
from vrx_mj.errors import VrxWarning, nearest
from vrx_mj.formats.urdf.elements import Findings, Node
from vrx_mj.formats.urdf.links import SLIGHT, Surroundings, material_colors, read_joint, read_link, root_of
from vrx_mj.formats.urdf.meshes import MeshFiles
from vrx_mj.formats.urdf.model import Joint, Link, Urdf
from vrx_mj.formats.urdf.xml_text import parse_robot

LIGHT = 0.01
"""Share of a robot's mass below which a link's impossible inertia does not matter."""

ODD = {
    "post": "posts of sensors that end below the deck, to which VRX gives a negative length: no mass, no shape",
    "massless": "links with mass 0; they count as links without mass",
    "inertia": "impossible moments of inertia, one more than the sum of the other two; they are used as they are",
    "shapeless": "visuals without a geometry; they are ignored",
    "mesh": "meshes not found in the folders that may be read; they are not drawn",
    "unread": "meshes that cannot be used; they are not drawn",
    "geometry": "shapes that MuJoCo has none like; they are ignored",
    "unit": "links without <inertial>; by SDF each weighs 1 kg, with moments of inertia of 1 kg m2",
    "submesh": "meshes of which a <submesh> is meant; they are used whole",
    "added": "<fluid_added_mass> of links; it is ignored: the Hydrodynamics plugin and the YAML give added mass",
    "mimic": "joints that mimic another; the mimic is ignored",
    "element": "unknown elements; they are ignored",
}
"""What is legal but suspicious, each said once for all that have it."""

KNOWN = {
    "robot": ("link", "joint", "material", "gazebo", "transmission"),
    "link": ("inertial", "visual", "collision"),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "calibration", "safety_controller"),
}
"""Elements that URDF has; others are extensions, unless they look like one of these misspelt."""


def read_urdf(
    text: str,
    file: Path,
    *,
    packages: Mapping[str, Path] | None = None,
    package_paths: Sequence[Path] = (),
    label: str = "",
) -> Urdf:
    """The robot that a URDF's text describes; xacro is expanded before.

    Args:
        text: The URDF.
        file: Where it is from; messages name it, and relative paths of meshes start in its folder.
        packages: Folders of ROS packages by name, for `package://NAME/...`.
        package_paths: Folders that are packages, or that hold them.
        label: What messages call the text, where its lines are not those of the file.

    Raises:
        ConfigError: With everything that is wrong, each with its line and element.

    Warns:
        VrxWarning: Once for each kind of thing that is legal but suspicious.
    """
    findings = Findings(label or display(file))
    root = Node(parse_robot(text, findings.file), "", findings)
    materials, gazebo = material_colors(root)
    files = MeshFiles(file.absolute().parent, dict(packages or {}), tuple(package_paths))
    around = Surroundings(files, findings, materials, gazebo)
    links = {link.name: link for link in (read_link(node, around) for node in named(root, "link"))}
    joints = {joint.name: joint for joint in (read_joint(node, links) for node in named(root, "joint"))}
    _note_misspelt(root)
    top = checked_tree(links, joints, around, root)
    return Urdf(
        file=file,
        name=root.attribute("name") or file.stem,
        root=top,
        links=links,
        joints=joints,
        gazebo=tuple(root.element.iterchildren("gazebo")),
        namespace=top.partition("/")[0] if "/" in top else "",
        label=findings.file,
    )


def checked_tree(links: Mapping[str, Link], joints: Mapping[str, Joint], around: Surroundings, root: Node) -> str:
    """The root link of a robot whose links hang together and can exist; what is suspicious is warned of.

    Raises:
        ConfigError: With everything that is wrong.
    """
    top = _checked_root(links, joints, root)
    _check_masses(links, around, root)
    root.findings.settle()
    _warn(root.findings)
    return top


def named(root: Node, tag: str) -> list[Node]:
    """Elements of this name, with names of their own that none shares."""
    nodes = root.children(tag)
    lines: dict[str, int | None] = {}
    for node in nodes:
        name = node.attribute("name") or ""
        if name in lines and name:
            node.fault(f"duplicate name: line {lines[name]} has a {tag} of this name")
        lines.setdefault(name, node.line)
    return nodes


def _checked_root(links: Mapping[str, Link], joints: Mapping[str, Joint], root: Node) -> str:
    """The root link; a file whose joints name links that are not there has other problems first."""
    if not links:
        root.fault("has no links", root.tag)
    if not links or root.findings.problems:
        return ""
    return root_of(links, joints, root.findings)


def _check_masses(links: Mapping[str, Link], around: Surroundings, root: Node) -> None:
    """A robot has a mass; the inertia of a link that is no small part of it can exist."""
    total = sum(link.inertial.mass for link in links.values() if link.inertial)
    if links and total == 0 and not around.findings.problems:
        root.fault("no link has a mass", root.tag)
    for node, name, excess, words in around.impossible:
        inertial = links[name].inertial
        if excess > SLIGHT and inertial and inertial.mass > LIGHT * total:
            node.fault(f"impossible moments of inertia: about the principal axes they are {words} kg m2, "
                       "and the largest is more than the sum of the other two")  # fmt: skip
        else:
            around.findings.note("inertia", name)


def _note_misspelt(root: Node) -> None:
    """Elements that look like a misspelt one of URDF; whatever else is unknown is an extension."""
    for tag, known in KNOWN.items():
        for node in [root] if tag == "robot" else root.children(tag):
            for child in node.element.iterchildren("*"):
                close = None if child.tag in known else nearest(str(child.tag), known)
                if close:
                    thing = f"<{child.tag}> in line {child.sourceline} (did you mean '{close}'?)"
                    root.findings.note("element", thing)


def _warn(findings: Findings) -> None:
    for kind, things in findings.odd.items():
        names = ", ".join(things[:8]) + (f" and {len(things) - 8} more" if len(things) > 8 else "")
        warnings.warn(f"{findings.file}: {ODD[kind]}: {names}", VrxWarning, stacklevel=4)
