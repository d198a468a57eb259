"""Files that rerun wrote, with their chunks packed smaller: the same to every reader."""

import subprocess

import numpy as np
import pyarrow as pa
import pytest
import rerun as rr
from hypothesis import given
from hypothesis import strategies as st
from rerun.chunk import Chunk, LazyChunkStream, RrdReader

from vrx_mj.recording import repacking
from vrx_mj.recording.repacking import CHUNK, END, MANIFEST, TABLE, TABLE_CONTENT, TABLE_SIZE, fields_of, messages
from vrx_mj.recording.timeline import times
from vrx_mj.recording.viewer import viewer_binary, viewer_environment


@given(st.dictionaries(st.integers(1, 900), st.one_of(st.integers(0, 2**64 - 1), st.binary(max_size=300))))
def test_fields_of_a_message_come_back(fields):
    assert fields_of(repacking._message(fields)) == fields


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A mesh that changes little, noise, and a static chunk, as rerun writes them, and the same repacked."""
    folder = tmp_path_factory.mktemp("repacking")
    random, points = np.random.default_rng(0), np.zeros((60, 2000, 3), np.float32)
    points[..., :2] = random.random((2000, 2))
    for frame in range(1, 60):  # a sea of which a part has changed
        changed = random.random(2000) < 0.15
        points[frame, :, 2] = np.where(changed, random.integers(0, 6, 2000) / 64, points[frame - 1, :, 2])
    mesh = rr.Mesh3D.columns(vertex_positions=points.reshape(-1, 3)).partition([2000] * 60)
    noise = rr.Scalars.columns(scalars=random.random(200))
    chunks = [
        Chunk.from_columns("/mesh", [times(np.arange(60))], mesh),
        Chunk.from_columns("/noise", [times(np.arange(200))], noise),
        Chunk.from_columns("/world", [], rr.ViewCoordinates.columns(xyz=[rr.components.ViewCoordinates.RDF])),
    ]
    LazyChunkStream.from_iter(iter(chunks)).write_rrd(folder / "by_rerun.rrd", application_id="a", recording_id="b")
    return folder / "by_rerun.rrd", repacking.repacked(folder / "by_rerun.rrd", folder / "smaller.rrd")


def batches(file):
    """The content of a file, by entity."""
    return {chunk.entity_path: chunk.to_record_batch() for chunk in RrdReader(file).stream()}


def test_a_repacked_file_is_smaller_and_reads_the_same(files, tmp_path):
    one, other = files
    assert other.stat().st_size < 0.7 * one.stat().st_size
    joined = tmp_path / "joined.rrd"
    command = [str(viewer_binary()), "rrd", "route", str(other), "-o", str(joined)]
    subprocess.run(command, check=True, capture_output=True, env=viewer_environment())
    verify = [str(viewer_binary()), "rrd", "verify", str(joined)]
    subprocess.run(verify, check=True, capture_output=True, env=viewer_environment())
    found, expected = batches(joined), batches(one)
    assert found.keys() == expected.keys()
    for path, batch in expected.items():
        assert found[path].equals(batch), path


def test_the_table_of_a_repacked_file_has_the_places_of_its_chunks(files):
    found = list(messages(files[1]))
    table = fields_of(fields_of(fields_of(found[-1][2])[MANIFEST])[TABLE])
    batch = pa.ipc.open_stream(repacking.unpacked(table[TABLE_CONTENT], table[TABLE_SIZE])).read_next_batch()
    assert found[-1][0] == END
    assert list(zip(*(batch[f"chunk_byte_{name}"].to_pylist() for name in ("offset", "size")), strict=True)) == [
        (begin, len(content)) for kind, begin, content in found if kind == CHUNK
    ]


def test_what_is_not_as_rerun_writes_it_is_left_as_it_is(files, tmp_path):
    strange = tmp_path / "strange.rrd"
    strange.write_bytes(files[0].read_bytes()[:-200])
    assert repacking.repacked(strange, tmp_path / "other.rrd") == strange
