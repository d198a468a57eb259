"""Texts on which a pattern that goes back and forth would not come to an end: each is read, or refused, at once."""

from contextlib import suppress

import pytest

from vrx_mj.config.yaml_text import find_lookalikes
from vrx_mj.errors import VrxError
from vrx_mj.formats.parts.read import has_expression, triple
from vrx_mj.formats.urdf.reader import MeshFiles, read_mesh, with_file_uris
from vrx_mj.formats.urdf.xml_document import parse_robot

MANY = 300_000


@pytest.mark.parametrize(
    "text",
    [
        "<?xml" + " " * 12 * MANY,
        " " * 12 * MANY + "<robot",
        "<robot>" + "<?xml " * (MANY // 2),
        "<mesh " * (MANY // 2),
        "<mesh filename " * (MANY // 9),
        "<mesh " + "filename " * MANY,
    ],
)
def test_xml(text, tmp_path):
    with suppress(VrxError):
        parse_robot(text, "a.urdf")
    assert with_file_uris(text, MeshFiles(tmp_path)) == text


@pytest.mark.parametrize("line", ["'' " * MANY + "#", "{description: '" * MANY, "- " * MANY + "é", ", " * MANY + "é"])
def test_yaml_lines(line):
    assert list(find_lookalikes([line])) == []


@pytest.mark.parametrize("text", ["${" * MANY, "${" + "{" * MANY, "1 " * MANY])
def test_values_of_parts(text):
    assert not has_expression(text)
    with pytest.raises(ValueError, match="expected at most 2000 characters"):
        triple(text)


@pytest.mark.parametrize("part", ["<unit ", "<unit meter=", "<unit meter='1", "<unit meter=" + " " * 50])
def test_units_of_collada(part, tmp_path):
    (tmp_path / "a.dae").write_text(f"<COLLADA>{part * 50_000}</COLLADA>", encoding="utf-8")
    with pytest.raises(VrxError):
        read_mesh(tmp_path / "a.dae")
