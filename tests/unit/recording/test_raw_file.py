"""The file of a run that goes on, cut, damaged, or without room: read as far as it goes, or one line."""

import random
import shutil
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import recorded_run
from vrx_mj.errors import RecordError
from vrx_mj.recording import parts
from vrx_mj.recording.parts import Part, RawFile, raw_parts
from vrx_mj.recording.reader import read_record
from vrx_mj.recording.session import RecordWriter
from vrx_mj.unix import resource

SECONDS = 3.0
ROWS = np.concatenate(list(recorded_run.blocks(SECONDS)))


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """What a run left that was killed after its last flush."""
    folder = tmp_path_factory.mktemp("raw")
    writer = RecordWriter(folder / "run.rrd", recorded_run.scene())
    for block in recorded_run.blocks(SECONDS):
        writer.state(block[0, 0], block[0].tobytes())
        writer.rows(block)
        writer.event(block[0, 0], "another block")
    writer._file._stream.flush()
    shutil.copy(folder / "run.rrd", folder / "killed.rrd")
    writer.close()
    return folder / "killed.rrd"


def cells(part):
    """The cells of a part that can be compared."""
    return {
        name: [c.tolist() if isinstance(c, np.ndarray) else c for c in column] for name, column in part.columns.items()
    }


def read(data, folder):
    """The record in a file of these bytes, or the one line about it."""
    file = folder / "changed.rrd"
    file.write_bytes(data)
    try:
        return read_record(file)
    except RecordError as error:
        trouble = str(error)
    assert "\n" not in trouble
    assert str(file) in trouble
    return None


def test_the_file_of_a_killed_run_reads_as_it_was(killed):
    record = read_record(killed)
    assert (record.complete, record.has_views) == (False, False)
    assert record.rows.tobytes() == ROWS.tobytes()
    assert record.properties == recorded_run.scene().properties
    assert len(record.states) == len(record.events) == 4


def test_the_file_of_a_killed_run_and_the_closed_recording_hold_the_same(killed):
    closed, record = read_record(killed.with_name("run.rrd")), read_record(killed)
    assert closed.complete
    assert closed.rows.tobytes() == record.rows.tobytes()
    assert (closed.events, closed.states, closed.files) == (record.events, record.states, record.files)


@given(columns=st.dictionaries(st.text(), st.lists(st.text() | st.binary() | st.floats().map(lambda x: np.array([x])))))
def test_parts_come_back(columns, tmp_path_factory):
    path = tmp_path_factory.mktemp("parts") / "file"
    file = RawFile(path)
    file.append("/some/where", columns)
    file.close()
    (found,) = raw_parts(path)
    assert repr(cells(found)) == repr(cells(Part("/some/where", static=False, columns=columns)))


def test_a_file_that_was_cut_at_any_byte_reads_as_far_as_it_goes(killed, tmp_path):
    whole = killed.read_bytes()
    chance, counts = random.Random(1), []
    for size in sorted([*range(40), *(chance.randrange(len(whole)) for _ in range(60)), len(whole)]):
        record = read(whole[:size], tmp_path)
        if record is not None:
            counts.append(len(record.rows))
            assert record.rows.tobytes() == ROWS[: len(record.rows)].tobytes()
            assert not record.complete
    assert counts == sorted(counts)
    assert counts[-1] == len(ROWS)


def test_a_file_with_other_bytes_reads_up_to_them_or_is_refused(killed, tmp_path):
    whole = killed.read_bytes()
    for seed in range(60):
        chance, data = random.Random(seed), bytearray(whole)
        for _ in range(chance.choice([1, 1, 4, 16])):
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        record = read(bytes(data), tmp_path)
        if record is not None:
            assert record.rows.tobytes() == ROWS[: len(record.rows)].tobytes()


@given(block=st.binary() | st.text().map(str.encode))
def test_a_block_with_a_right_checksum_of_anything_is_one_line(block, killed, tmp_path_factory):
    frame = parts.FRAME.pack(len(block), parts.zlib.crc32(block))
    read(parts.HEAD.pack(parts.MAGIC, parts.VERSION) + frame + block, tmp_path_factory.mktemp("block"))


def test_a_length_beyond_the_file_takes_no_memory(killed, tmp_path):
    record = read(killed.read_bytes() + parts.FRAME.pack(1 << 62, 0) + b"and more", tmp_path)
    assert len(record.rows) == len(ROWS)


def test_another_version_is_named(killed, tmp_path):
    file = tmp_path / "later.rrd"
    file.write_bytes(parts.HEAD.pack(parts.MAGIC, 7) + killed.read_bytes()[parts.HEAD.size :])
    with pytest.raises(RecordError) as refused:
        read_record(file)
    assert str(refused.value) == (
        f"'{file}' is the recording of a run that was not closed, version 7; this version reads 2"
    )


def test_a_file_in_which_nothing_is_whole_says_so(killed, tmp_path):
    file = tmp_path / "begun.rrd"
    file.write_bytes(killed.read_bytes()[:100])
    with pytest.raises(RecordError) as refused:
        read_record(file)
    assert str(refused.value) == f"'{file}' is damaged: it contains nothing of the run"


# A full disk


FULL = """
import signal, sys
import recorded_run
from vrx_mj.recording.session import RecordWriter
from vrx_mj.unix import resource

limit, path = int(sys.argv[1]), sys.argv[2]
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
writer = RecordWriter(path, recorded_run.scene())
for block in recorded_run.blocks(20.0):
    if limit > 0:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    writer.rows(block)
if limit < 0:
    resource.setrlimit(resource.RLIMIT_FSIZE, (-limit, -limit))
writer.close()
"""
needs_limits = pytest.mark.skipif(resource is None, reason="limits are those of Unix")


def full(limit, path):
    """Record with no room for files of more bytes: from the beginning, or if negative at the close."""
    command = [sys.executable, "-W", "error::DeprecationWarning", "-c", FULL, str(limit), str(path)]
    return subprocess.run(
        command, cwd=recorded_run.__file__.rpartition("/")[0], capture_output=True, text=True, check=False
    )


@pytest.mark.slow
@needs_limits
def test_a_disk_that_is_full_during_the_run_is_one_error_and_what_is_there_reads(tmp_path):
    done = full(100_000, tmp_path / "run.rrd")
    assert done.stderr.splitlines()[-1].endswith(
        f"RecordError: cannot write the recording '{tmp_path}/run.rrd': File too large"
    )
    record = read_record(tmp_path / "run.rrd")
    assert 0 < len(record.rows) < 401
    assert record.rows.tobytes() == np.concatenate(list(recorded_run.blocks(20.0)))[: len(record.rows)].tobytes()


@pytest.mark.slow
@needs_limits
def test_a_disk_that_is_full_at_the_close_is_a_warning_and_all_reads(tmp_path):
    done = full(-350_000, tmp_path / "run.rrd")
    assert done.returncode == 0
    assert "what was written is intact, and vrx-mj replay opens it" in done.stderr
    assert len(read_record(tmp_path / "run.rrd").rows) == 401
    assert [file.name for file in tmp_path.iterdir()] == ["run.rrd"]


# Killed at any time


@pytest.mark.slow
@pytest.mark.parametrize("wait", [0.0, 0.1, 0.3, 0.6, 1.0])
def test_a_process_that_is_killed_while_it_closes_leaves_a_recording(wait, tmp_path):
    code = (
        "import sys, recorded_run; from vrx_mj.recording.session import RecordWriter;"
        "writer = RecordWriter(sys.argv[1], recorded_run.scene());"
        "[writer.rows(block) for block in recorded_run.blocks(60.0)];"
        "print('closing', flush=True); writer.close()"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "run.rrd")]
    run = subprocess.Popen(command, cwd=recorded_run.__file__.rpartition("/")[0], stdout=subprocess.PIPE, text=True)
    assert run.stdout is not None
    assert run.stdout.readline() == "closing\n"
    time.sleep(wait)
    run.kill()
    run.communicate()
    rows = np.concatenate(list(recorded_run.blocks(60.0)))
    found = read_record(tmp_path / "run.rrd").rows
    assert found.tobytes() == rows[: len(found)].tobytes()
    assert len(found) > 1100


def test_states_and_frames_are_joined_until_a_flush_or_something_else(tmp_path, monkeypatch):
    clock, tick = SimpleNamespace(now=10.0), 2.0**-20  # [s], whose sums are exact
    monkeypatch.setattr(parts, "time", SimpleNamespace(monotonic=lambda: clock.now))
    file, path = parts.RawFile(tmp_path / "run.rrd"), tmp_path / "run.rrd"

    def told():
        """What a reader of the file finds at this moment."""
        try:
            return [(part.entity, part.columns["n"]) for part in parts.raw_parts(path)]
        except RecordError:
            return []

    file.append(parts.STATES, {"n": ["a"]})
    assert told() == [(parts.STATES, ["a"])]
    clock.now += parts.FLUSH - tick
    for name in "bc":
        file.append(parts.STATES, {"n": [name]})
    assert told() == [(parts.STATES, ["a"])]
    clock.now += tick
    file.append(parts.STATES, {"n": ["d"]})
    assert told() == [(parts.STATES, ["a"]), (parts.STATES, ["b", "c", "d"])]
    file.append(parts.FRAMES, {"n": ["e"]})
    file.append(parts.ROWS, {"n": ["f"]})
    file.append(parts.ROWS, {"n": ["g"]})
    file.append(parts.STATES, {"n": ["h"]})
    assert len(told()) == 2
    clock.now += parts.FLUSH
    file.append(parts.EVENTS, {"n": ["i"]})
    kinds = (parts.FRAMES, parts.ROWS, parts.ROWS, parts.STATES, parts.EVENTS)
    assert told()[2:] == [(kind, [name]) for kind, name in zip(kinds, "efghi", strict=True)]
    file.append(parts.FRAMES, {"n": ["j"]})
    file.close()
    assert told()[7:] == [(parts.FRAMES, ["j"])]
