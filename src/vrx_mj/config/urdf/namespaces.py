"""The namespace of a URDF's names: `wamv` of `wamv/base_link`."""

import re
from functools import lru_cache

from vrx_mj.config.urdf.xml_text import parse_robot
from vrx_mj.errors import ConfigError

__all__ = ["in_namespace", "namespace_of"]


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
    """The namespace of a URDF's root link; empty if it has none, and for text that is no robot."""
    try:
        robot = parse_robot(text, "robot_description")
    except ConfigError:
        return ""
    children = {child.get("link") for child in robot.iterfind("joint/child")}
    roots = (link.get("name") or "" for link in robot.iterfind("link"))
    return next((name.partition("/")[0] for name in roots if "/" in name and name not in children), "")
