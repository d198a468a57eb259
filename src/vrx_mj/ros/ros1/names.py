"""Names of ROS 1's graph: which are legal, and what a relative one means."""

import re

__all__ = ["LONGEST", "is_legal", "is_type", "joined", "resolve"]

LONGEST = 1024
"""Characters of a name, at most."""
_LEGAL = re.compile(r"[~/A-Za-z][A-Za-z0-9_/]*\Z")
_TYPE = re.compile(r"(\*|[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*)\Z")


def is_legal(name: object) -> bool:
    """Whether something can name a topic, a service or a node."""
    return isinstance(name, str) and 0 < len(name) <= LONGEST and _LEGAL.match(name) is not None


def is_type(name: object) -> bool:
    """Whether something can name a type; `*` stands for any."""
    return isinstance(name, str) and len(name) <= LONGEST and _TYPE.match(name) is not None


def joined(*parts: str) -> str:
    """An absolute name without doubled or trailing slashes."""
    return "/" + "/".join(part for name in parts for part in name.split("/") if part)


def namespace(node: str) -> str:
    """That in which a node's relative names are."""
    return joined(node.rpartition("/")[0])


def resolve(name: str, node: str) -> str:
    """The absolute name that a node means by a name."""
    if name.startswith("/"):
        return joined(name)
    if name.startswith("~"):
        return joined(node, name[1:])
    return joined(namespace(node), name)
