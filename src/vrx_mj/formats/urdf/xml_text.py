"""XML text of users: no document types, no entities, nothing fetched, and a limit on its size."""

import re
from typing import Any

from vrx_mj.errors import ConfigError, Problem

MAX_CHARACTERS = 20_000_000
"""Longest text that is read."""
MAX_TAGS = 200_000
"""Most tags and, apart from them, attributes of a text; each takes some 200 bytes."""

_DECLARATION = re.compile(r"\s*<\?xml[^>]*\?>")
_DOCUMENT_TYPE = re.compile(r"<!(DOCTYPE|ENTITY)", re.IGNORECASE)
_REWORDED = (
    (r"Opening and ending tag mismatch: (\S+) line (\d+) and (\S+)", r"the <\1> of line \2 ends with </\3>"),
    (r"Premature end of data in tag (\S+) line (\d+)", r"the <\1> of line \2 does not end"),
    (r"xmlParseEntityRef: no name|EntityRef: expecting ';'", "write '&' as '&amp;'"),
    (r"Attribute (\S+) redefined", r"the attribute '\1' is given twice"),
    (r"(?i)excessive depth.*", "elements are nested too deeply; at most 256"),
    (r"Start tag expected, '<' not found", "expected '<robot>'"),
)
_XACRO = "{http://www.ros.org/wiki/xacro}", "{http://ros.org/wiki/xacro}"


def parse_robot(text: str, file: str) -> Any:
    """The `<robot>` element (lxml) of a URDF's text; `file` is how messages call it."""
    _check(text, file)
    root = _parsed(text, file)
    if root.tag != "robot":
        raise _error(file, f"expected a <robot>, got a <{root.tag}>{_hint(root.tag)}", root.sourceline)
    for element in root.iter("*"):
        if element.tag.startswith(_XACRO):
            name = element.tag.partition("}")[2]
            raise _error(file, f"<xacro:{name}> in a URDF: name the file .xacro, so that it is expanded first",
                         element.sourceline)  # fmt: skip
    return root


def _check(text: str, file: str) -> None:
    """Refuse what is too long, and whatever begins as a document type does."""
    if len(text) > MAX_CHARACTERS:
        raise _error(file, f"the text has {len(text):,} characters; at most {MAX_CHARACTERS:,} are read")
    for mark, words in (("<", "tags"), ("=", "attributes")):
        if text.count(mark) > MAX_TAGS:
            raise _error(file, f"the text has {text.count(mark):,} {words}; at most {MAX_TAGS:,} are read")
    found = _DOCUMENT_TYPE.search(text)
    if found:
        line = text.count("\n", 0, found.start()) + 1
        raise _error(file, "document types and entities are not allowed; remove '<!...'", line)


def _parsed(text: str, file: str) -> Any:
    from lxml import etree

    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, remove_comments=True, remove_pis=True
    )
    plain = text.removeprefix("\ufeff")
    declaration = _DECLARATION.match(plain)
    if declaration:
        plain = "\n" * declaration[0].count("\n") + plain[declaration.end() :]
    if not plain.strip():
        raise _error(file, "the file is empty")
    try:
        return etree.fromstring(plain.encode("utf-8", "surrogatepass"), parser)
    except etree.XMLSyntaxError as error:
        line, column = error.position
        message = f"not XML: {_reworded(error.msg or '')}"
        raise ConfigError([Problem(file, line or None, column or None, "", message)]) from None


def _reworded(text: str) -> str:
    """The message of libxml2 in plain words, without its place."""
    text = re.sub(r", line \d+, column \d+.*", "", text, flags=re.DOTALL)
    for pattern, words in _REWORDED:
        text = re.sub(pattern, words, text)
    return text[:1].lower() + text[1:]


def _hint(tag: str) -> str:
    if tag == "sdf":
        return "; SDF is not read, only URDF"
    return "; MJCF is not read as a robot, only URDF" if tag == "mujoco" else ""


def _error(file: str, message: str, line: int | None = None) -> ConfigError:
    return ConfigError([Problem(file, line, None, "", message)])
