"""Recordings as the sandboxed process reads and copies them."""

import os

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import Chunk, LazyChunkStream

from vrx_mj.errors import RecordError
from vrx_mj.foreign import ask

CELLS = list[tuple[str, bool, dict[str, list[object]]]]


@pytest.fixture
def recording(tmp_path):
    """Points and a text without time, and a text at two times."""
    still = [*rr.Points3D.columns(positions=[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]).partition([2]),
             *rr.AnyValues.columns(blob=[b"\0\xff"])]  # fmt: skip
    chunks = [
        Chunk.from_columns("/points", [], still),
        Chunk.from_columns("/lines", [rr.TimeColumn("t", duration=[0.5, 2.0])], rr.TextLog.columns(text=["a", "b"])),
    ]
    path = tmp_path / "run.rrd"
    LazyChunkStream.from_iter(chunks).write_rrd(path, application_id="some", recording_id="1")
    return path


def read(path, entities, columns, whole=False):
    wanted = (path, entities, columns, whole)
    found, footer, views = ask(
        "foreign.rerun_file:chunks", *wanted, returns=tuple[CELLS, bool, bool], about="it", reads=[path], threads=True,
        cached=False,
    )  # fmt: skip
    assert (footer, views) == (True, False)
    return {entity: (static, columns) for entity, static, columns in found}


@pytest.mark.parametrize("whole", [False, True])
def test_the_columns_that_are_asked_for_come_as_numbers_texts_and_bytes(recording, whole):
    found = read(recording, ["/points"], ["Points3D:positions", "blob", "t"], whole)
    ((static, columns),) = found.values()
    assert static
    assert np.array_equal(columns["Points3D:positions"], [np.arange(1.0, 7.0)])
    assert columns["blob"] == [b"\0\xff"]
    static, columns = read(recording, ["/lines", "/none"], ["TextLog:text", "t"], whole)["/lines"]
    assert not static
    assert columns["TextLog:text"] == ["a", "b"]
    assert np.array_equal(columns["t"], [[500_000_000], [2_000_000_000]])


@pytest.mark.skipif(os.name == "nt", reason="a copy is written to its path there")
def test_a_copy_has_the_same_chunks(recording, tmp_path):
    copy = tmp_path / "copy.rrd"
    names = (copy, "other", "2")
    options = {"returns": bytes, "about": "it", "reads": [recording], "threads": True, "cached": False}
    copy.write_bytes(ask("foreign.rerun_file:copy", recording, *names, **options))
    asked = (["/points", "/lines"], ["Points3D:positions", "TextLog:text", "blob"])
    first, second = (read(path, *asked) for path in (recording, copy))
    assert str(first) == str(second)
    assert b"other" in copy.read_bytes()


def test_what_cannot_be_parsed_is_an_error(recording):
    recording.write_bytes(recording.read_bytes()[:60])
    with pytest.raises(RecordError):
        read(recording, ["/points"], [])
