"""Joints of a URDF, and the tree that they make of its links."""

import math
from collections.abc import Collection, Mapping, Sequence

from vrx_mj.config.poses import Pose, compose, facing, inverse
from vrx_mj.config.urdf.elements import Findings, Node
from vrx_mj.config.urdf.links import read_pose
from vrx_mj.config.urdf.model import Joint, Limits, Link
from vrx_mj.config.wording import choice
from vrx_mj.errors import Problem, UnknownNameError

__all__ = ["read_joint", "root_of"]

TYPES = ("fixed", "revolute", "continuous", "prismatic", "floating", "planar")
BOUNDED = ("revolute", "prismatic")


def read_joint(node: Node, links: Collection[str]) -> Joint:
    """A `<joint>` between two of these links. Problems and oddities are noted, not raised."""
    name, kind = node.name(), node.attribute("type") or ""
    if kind not in TYPES:
        node.fault(choice(kind, TYPES) if kind else f"required, but missing; one of {', '.join(TYPES)}", "type")
    parent, child = (_end(node, tag, links) for tag in ("parent", "child"))
    if parent and parent == child:
        node.fault(f"joins the link '{parent}' to itself")
    if node.child("mimic"):
        node.findings.note("mimic", name)
    axis, limits = _axis(node, kind), _limits(node, kind)
    rest = min(max(0.0, limits.lower), limits.upper) if limits and kind in BOUNDED else 0.0
    return Joint(
        name=name,
        type=kind,
        parent=parent,
        child=child,
        pose=_at_rest(read_pose(node), kind, axis, rest),
        axis=axis,
        limits=limits,
        line=node.line,
        rest=rest,
    )


def _at_rest(pose: Pose, kind: str, axis: Sequence[float], rest: float) -> Pose:
    """The pose of the child in the parent with the joint at `rest` [rad or m]."""
    if rest == 0.0:
        return pose
    if kind == "prismatic":
        x, y, z = (rest * value for value in axis)
        return compose(pose, (x, y, z, 0.0, 0.0, 0.0))
    turn = facing(axis)
    return compose(pose, compose(compose(turn, (0.0, 0.0, 0.0, 0.0, 0.0, rest)), inverse(turn)))


def root_of(links: Mapping[str, Link] | Mapping[str, Node], joints: Mapping[str, Joint], findings: Findings) -> str:
    """The one link that is no joint's child, if the links hang together as a tree under it."""
    above: dict[str, Joint] = {}
    for joint in joints.values():
        if joint.child in above:
            other = above[joint.child].name
            message = f"the link '{joint.child}' is already the child of the joint '{other}'; it has one parent"
            findings.problems.append(Problem(findings.file, joint.line, None, f"joint '{joint.name}'", message))
        above.setdefault(joint.child, joint)
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        names = ", ".join(f"'{name}'" for name in roots[:8]) + (f" and {len(roots) - 8} more" if len(roots) > 8 else "")
        message = f"{len(roots)} links are not a joint's child: {names}; there must be one, the root"
        findings.problems.append(Problem(findings.file, links[roots[1]].line, None, f"link '{roots[1]}'", message))
    loop = _loop(links, above)
    if loop:
        line = above[loop[0]].line
        message = "the joints form a loop: " + " > ".join(f"'{name}'" for name in (*loop, loop[0]))
        findings.problems.append(Problem(findings.file, line, None, f"joint '{above[loop[0]].name}'", message))
    return roots[0] if roots else ""


def _loop(links: Collection[str], above: Mapping[str, Joint]) -> list[str]:
    """Links, parents first, that are each other's ancestors; empty if there are none."""
    safe: set[str] = set()
    for start in links:
        link, path = start, dict[str, None]()
        while link in above and link not in safe and link not in path:
            path[link] = None
            link = above[link].parent
        if link in path:
            names = list(path)
            return names[names.index(link) :][::-1]
        safe.update(path)
    return []


def _end(node: Node, tag: str, links: Collection[str]) -> str:
    end = node.needed(tag)
    name = end.required("link") if end else ""
    if end and name and name not in links:
        end.fault(str(UnknownNameError("link", name, links)), "link")
    return name


def _axis(node: Node, kind: str) -> tuple[float, float, float]:
    """Direction of the joint's axis, of length 1."""
    axis = node.child("axis")
    x, y, z = axis.numbers("xyz", "x y z", (1.0, 0.0, 0.0)) if axis else (1.0, 0.0, 0.0)
    length = math.hypot(x, y, z)
    if length == 0:
        if axis and kind not in {"fixed", "floating"}:
            axis.fault("must have a length, got '0 0 0'", "xyz")
        return (1.0, 0.0, 0.0)
    return (x / length, y / length, z / length) if abs(length - 1) > 1e-9 else (x, y, z)


def _limits(node: Node, kind: str) -> Limits | None:
    limit = node.child("limit")
    if limit is None:
        if kind in BOUNDED:
            node.fault(f"required, but missing: a {kind} joint has limits", "limit")
        return None
    lower, upper = (limit.number(key, 0.0) for key in ("lower", "upper"))
    effort, velocity = (limit.number(key, 0.0, low=0) for key in ("effort", "velocity"))
    if kind in BOUNDED and lower > upper:
        limit.fault(f"lower {lower:g} is above upper {upper:g}")
    return Limits(lower, upper, effort, velocity)
