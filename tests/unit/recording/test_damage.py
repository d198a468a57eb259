"""Recordings that are damaged, or made to do harm: an error of one line, and no more."""

import io
import json
import math
import random
import struct
import subprocess
import sys
import zlib
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import recorded_run
from fuzz import recordings
from vrx_mj import Simulation, compile_world
from vrx_mj.config.sensors import BallShooterConfig, ImuConfig, LidarConfig
from vrx_mj.errors import RecordError, VrxError
from vrx_mj.foreign import ask, asking
from vrx_mj.foreign.plain import pack
from vrx_mj.recording import parts as rrd
from vrx_mj.recording import reader
from vrx_mj.recording.boat_sets import BoatSet, BoatSetHead, SentMessages, head_of, parsed_json
from vrx_mj.recording.checks import compare, rescore
from vrx_mj.recording.packing import pack_rows, unpack_rows
from vrx_mj.recording.parts import Part, pack_files, parsed_file, unpack_files
from vrx_mj.recording.reader import RecordedReadings, decode_jpeg, read_readings, read_record
from vrx_mj.recording.record_scene import RecordedSensor
from vrx_mj.recording.session import viewable
from vrx_mj.recording.simulation_scene import check_columns, scene_of

MOST = 1 << 20


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return recorded_run.record_run(tmp_path_factory.mktemp("damage") / "run.rrd", 1.0)


def refusal(function, *arguments):
    with pytest.raises(RecordError) as refused:
        function(*arguments)
    return str(refused.value)


def trouble(use):
    """What is wrong, in one line."""
    try:
        use()
    except VrxError as error:
        return str(error)
    return "none"


# The parser


@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of Unix")
def test_a_parser_that_does_not_end_well_is_damage_of_the_file(recording, monkeypatch):
    """As a panic of rerun's is, at some flipped bytes."""
    monkeypatch.setattr(asking, "PACKAGE", "foreign_jobs")
    monkeypatch.setattr(rrd, "PARSER", "tricks")
    monkeypatch.setattr(rrd, "ask", lambda *given, **named: ask(*given, **{**named, "threads": False}))
    assert refusal(read_record, recording) == f"'{recording}' is damaged: its reader was killed by SIGABRT"


def test_a_recording_that_names_another_file_cannot_read_it(recording, tmp_path):
    """Its parser reads the recording alone, whatever else is beside it."""
    secret = tmp_path / "secret.rrd"
    secret.write_bytes(recording.read_bytes())
    with pytest.raises(RecordError):
        ask("foreign.rerun_file:chunks", secret, [], [], False, returns=tuple[object, bool, bool], about="it",
            reads=[recording], threads=True, cached=False)  # fmt: skip


@pytest.mark.parametrize("columns", [{"head": [3]}, {"head": "a text"}, {"head": [["a text"]]}, [], None])
def test_what_the_parser_says_is_checked(columns, recording, monkeypatch):
    said = {"value": [[["/record/run", True, columns]], True, True], "warnings": []}
    monkeypatch.setattr(rrd, "ask", lambda *_arguments, returns, **_options: asking._outcome(said, returns, "it"))
    assert refusal(read_record, recording).startswith(f"'{recording}' is damaged: ")


def test_a_file_that_grew_a_bad_message_keeps_what_was_whole(recording, tmp_path):
    """Which rerun's reader takes for an end."""
    cut = tmp_path / "cut.rrd"
    cut.write_bytes(recording.read_bytes()[:-500])
    record = read_record(cut)
    assert not record.complete
    assert not record.has_views
    assert len(record.rows) == len(read_record(recording).rows)


def test_a_folder_is_no_recording(tmp_path):
    assert refusal(read_record, tmp_path) == f"'{tmp_path}' is a folder, not a recording: name a file in it"


# The files


def test_files_come_back():
    files = {"scene.xml": b"<mujoco/>", "assets/a.obj": b"", "../x": b"a name, and no path"}
    assert unpack_files(pack_files(files), MOST) == files


@pytest.mark.parametrize("files", [{"bomb": bytes(64 << 20)}, {str(k): bytes(400_000) for k in range(3)}])
def test_no_more_is_unpacked_than_may_be(files):
    assert refusal(unpack_files, pack_files(files), MOST) == "files: more than 1 MiB, or too many names"


@pytest.mark.slow
def test_too_many_files_are_refused_before_they_are_listed():
    many = pack_files({str(k): b"" for k in range(1 << 18)})
    assert refusal(unpack_files, many, 1 << 30) == "files: more than 1024 MiB, or too many names"


@pytest.mark.parametrize("cells", [3.5, [b"two", b"of one name"], None])
def test_files_that_are_not_bytes_are_refused(cells):
    assert refusal(unpack_files, zlib.compress(pack({"a": cells})), MOST).startswith("files: damaged: ")


def test_bytes_that_no_file_names_are_refused():
    blob = zlib.compress(struct.pack("<Q", 2) + b"{}" + bytes(8 * 1000))
    assert refusal(unpack_files, blob, MOST) == "files: damaged: bytes that are nowhere"


def test_files_with_other_bytes_are_refused_or_read():
    chance, whole = random.Random(1), pack_files({"scene.json": b"{}" * 50, "scene.xml": b"<mujoco/>"})
    for _ in range(1000):
        data = bytearray(whole)
        for _ in range(chance.randint(1, 3)):
            data[chance.randrange(len(data))] = chance.randrange(256)
        assert trouble(lambda data=data: unpack_files(bytes(data), MOST)).startswith(("files: ", "none"))


# The texts

HEAD = {
    "format": 7,
    "properties": {"world": "bay"},
    "timestep": 0.01,
    "wind_direction": [1.0, 0.0],
    "layout": {
        "nq": 7,
        "nv": 6,
        "thrusters": [["a", "left"]],
        "bodies": [{"name": "a", "kind": "boat", "qpos": 0, "dof": 0}],
    },
}
SENSOR = {
    "boat": "a", "name": "gps", "type": "gps", "frame": "a/gps", "rate": 15.0, "position": [0.0, 0.0, 0.0],
    "rotation": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    "config": {"type": "gps", "name": "gps", "link": "l"},
}  # fmt: skip


def body(**other):
    return {"name": "a", "kind": "boat", "qpos": 0, "dof": 0} | other


def layout(**other):
    return {"layout": HEAD["layout"] | other}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"format": "new"}, "format: expected a whole number, got 'new'"),
        ({"format": 9}, "format 9; this version reads 7"),
        ({"timestep": -1.0}, "timestep: must be above 0, got -1"),
        ({"timestep": None}, "timestep: expected a number, got nothing"),
        ({"wind_direction": [1.0]}, "wind_direction[1]: required, but missing"),
        ({"properties": []}, "properties: expected keys and values, got []"),
        (layout(nq=1 << 40), "layout.nq: must be at most 1000000, got 1099511627776"),
        (layout(nq=-1), "layout.nq: must be at least 0, got -1"),
        (layout(nv=True), "layout.nv: expected a whole number, got true"),
        (layout(thrusters=[["a", "left"]] * 2), "layout.thrusters: duplicate name"),
        (layout(bodies=[body(), body()]), "layout.bodies: duplicate name"),
        (layout(bodies=[body(qpos=1)]), "layout.bodies: their places in qpos and qvel are not those of free joints"),
        (layout(nv=5), "layout.bodies: their places in qpos and qvel are not those of free joints"),
        (layout(bodies=[body(qpos=7)]), "layout.bodies: their places in qpos and qvel are not those of free joints"),
        ({"sensors": [SENSOR, SENSOR]}, "sensors: duplicate name"),
        ({"sensors": [SENSOR | {"type": "imu"}]}, "sensors: a gps: of type imu, configured as gps"),
        ({"sensors": [SENSOR | {"config": {}}]}, "sensors[0].config.type: required, but missing"),
        ({"sensors": [SENSOR | {"rate": float("nan")}]}, "sensors[0].rate: must be finite, got nan"),
    ],
)
def test_a_wrong_kind_in_the_head_is_named(change, reason):
    assert refusal(head_of, json.dumps(HEAD | change)) == f"head: {reason}"


def test_a_head_is_read():
    head = head_of(json.dumps(HEAD | {"sensors": [SENSOR]}))
    assert (head.timestep, head.wind_direction, head.layout.width, head.sensors[0].name) == (
        0.01,
        (1.0, 0.0),
        17,
        "gps",
    )


@pytest.mark.parametrize(
    "read", [head_of, partial(parsed_json, BoatSetHead, "companies"), partial(parsed_json, SentMessages, "sent")]
)
@pytest.mark.parametrize("text", ["", "[" * 100_000, '{"a":' * 100_000, "NaN", "1" * 5000, "\ud800"])
def test_a_text_that_is_no_json_is_refused(read, text):
    assert "\n" not in refusal(read, text)


# Rows, and what is beside them


@pytest.mark.parametrize(
    "block",
    [
        b"",
        b"\0" * 7,
        struct.pack("<II", 1, 0),
        struct.pack("<II", 2**32 - 1, 2**32 - 1),
        pack_rows(np.ones((2, 3)))[:-1],
        struct.pack("<I", 0) + pack_rows(np.eye(3))[4:],
    ],
)
def test_rows_of_another_size_than_they_say_are_refused(block):
    assert refusal(unpack_rows, block).startswith(f"block: {len(block)} bytes are not ")


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ({}, "time: missing"),
        ({"time": ["1"]}, "time: expected a number"),
        ({"time": [np.array([1.0, 2.0])]}, "time: expected one number"),
        ({"time": [np.array([1])]}, "time: expected one number"),
        ({"time": [np.array([np.nan])]}, "time: expected one number"),
        ({"time": [np.array([-1.0])]}, "time: a time from 0 to 1e+09 s is needed"),
        ({"time": [None]}, "time: expected a number"),
    ],
)
def test_a_column_of_another_kind_is_named(columns, reason):
    part = Part("/record/states", static=False, columns=columns)
    assert refusal(part.times, "time") == f"/record/states: {reason}"


def recorded(config, numbers):
    sensor = RecordedSensor(**SENSOR | {"type": config.type, "config": config})
    stamps = {"time": [np.array([1.0])], "sequence": [np.array([0])]}
    return RecordedReadings.of(sensor, [Part("/x", static=False, columns={**stamps, "numbers": [numbers.tobytes()]})])


def shooter(numbers):
    return recorded(BallShooterConfig(name="shooter", link="l"), numbers)


def planar_scan(ranges):
    config = LidarConfig(name="planar", link="l", output="scan", rings=1, samples=len(ranges))
    return recorded(config, np.array([*ranges, -1.0, 1.0, 0.1, 0.1, 100.0]))


def test_readings_of_another_size_or_range_are_refused():
    assert shooter(np.array([3.0]))[0].data.shots_left == 3
    assert refusal(shooter, np.array([3.0, 1.0])) == "/record/readings/a/gps: numbers: 16 bytes instead of 8"
    for wild in (np.nan, -1.0, 1e300):
        assert refusal(shooter, np.array([wild])) == f"/record/readings/a/gps: numbers: {wild:g} shots"
    imu = ImuConfig(name="imu", link="l")
    assert len(recorded(imu, np.full(10, 3e38))) == 1
    assert refusal(recorded, imu, np.full(10, -4e38)) == "/record/readings/a/gps: numbers: beyond single precision"
    assert planar_scan([0.5, np.inf, 30.0])[0].data.ranges.tolist() == [0.5, np.inf, 30.0]
    for wild in (np.nan, np.uint64(0x7FF0000000000001).view(float), -1.0, -np.inf, 1e300):
        assert refusal(planar_scan, [0.5, wild]) == f"/record/readings/a/gps: numbers: a range of {wild:g} m"


def test_a_picture_of_another_size_is_refused_before_its_pixels_are_made():
    from PIL import Image

    buffer = io.BytesIO()
    Image.new("RGB", (8, 4)).save(buffer, "JPEG")
    blob = np.frombuffer(buffer.getvalue(), np.uint8)
    assert decode_jpeg(blob, (8, 4)).shape == (4, 8, 3)
    assert refusal(decode_jpeg, blob, (8, 5)) == "a picture of 8x4 instead of 8x5"
    assert refusal(decode_jpeg, blob[:60], (8, 4)).startswith("a picture is damaged: ")


# All of it


def used(file):
    """Use a recording as the commands do but for sailing on; whether it was read."""
    try:
        record = read_record(file)
    except RecordError:
        return False
    for use in (
        lambda: [list(readings) for readings in read_readings(file, record.sensors)],
        lambda: str(compare(record, record)),
        lambda: rescore(record),
        lambda: [boat_set.world for boat_set in record.companies],
    ):
        assert "\n" not in trouble(use)
    return True


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    return recordings.taken_apart(recordings.sample(tmp_path_factory.mktemp("sample") / "run.rrd"))


@pytest.mark.slow
def test_a_recording_that_is_taken_apart_and_put_together_is_the_same(sample, tmp_path):
    file = tmp_path / "again.rrd"
    file.write_bytes(recordings.put_together(sample))
    assert used(file)
    assert len(read_record(file).companies) == 3
    file.write_bytes(recordings.as_killed_run(sample))
    assert used(file)
    assert len(read_record(file).companies) == 3


@pytest.mark.slow
def test_killed_runs_in_which_something_is_wrong_are_shown_or_refused(sample, tmp_path):
    shown = 0
    for seed in range(12):
        file, folder = tmp_path / f"{seed}.rrd", tmp_path / str(seed)
        folder.mkdir()
        changed = recordings.changed(sample, random.Random(seed)) if seed else sample
        file.write_bytes(recordings.as_killed_run(changed))
        problem = trouble(lambda file=file, folder=folder: viewable(read_record(file), None, folder))
        assert "\n" not in problem
        shown += problem == "none"
    assert 0 < shown < 12


@pytest.mark.slow
def test_recordings_in_which_something_is_wrong_are_refused_or_read(sample, tmp_path):
    read = 0
    for seed in range(20):
        file = tmp_path / f"{seed}.rrd"
        file.write_bytes(recordings.mutated(sample, random.Random(seed)))
        read += used(file)
        file.unlink()
    assert 0 < read < 20  # some are read, some are refused


@pytest.mark.slow
def test_recordings_with_other_bytes_are_refused_or_read(recording, tmp_path):
    """With panics of rerun's among them: 1 of 75 flipped bytes ended the reading process."""
    whole, file = recording.read_bytes(), tmp_path / "flipped.rrd"
    for seed in range(20):
        chance, data = random.Random(seed), bytearray(whole)
        for _ in range(chance.choice([1, 1, 4, 16])):
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        file.write_bytes(data)
        used(file)


def test_a_few_recordings_in_which_something_is_wrong(recording, tmp_path):
    parts = recordings.taken_apart(recording)
    for seed in range(3):
        file = tmp_path / f"{seed}.rrd"
        file.write_bytes(recordings.mutated(parts, random.Random(seed)))
        used(file)


def test_a_damaged_recording_ends_a_command_with_one_line(recording, tmp_path):
    file = tmp_path / "flipped.rrd"
    file.write_bytes(recording.read_bytes()[:200] + b"\xff" * 50 + recording.read_bytes()[250:])
    done = subprocess.run([sys.executable, "-m", "vrx_mj", "replay", str(file)], capture_output=True, check=False)
    assert done.returncode == 2
    assert len(done.stderr.decode().strip().splitlines()) == 1


def test_what_is_asked_for_is_all_that_is_handed_back(recording):
    found = parsed_file(recording, ["head"], ["/record/run"], whole=True)
    assert [(part.entity, list(part.columns)) for part in found.parts] == [("/record/run", ["head"])]
    assert found.footer
    assert found.views


def readings(kind, **columns):
    """The readings of a sensor of a kind, in such columns of two rows."""
    config = LidarConfig(name="lidar", link="l") if kind == "lidar" else BallShooterConfig(name="gun", link="l")
    sensor = RecordedSensor(**SENSOR | {"type": config.type, "config": config})
    stamps = {"time": [np.array([1.0]), np.array([2.0])], "sequence": [np.array([0]), np.array([1])]}
    return RecordedReadings.of(sensor, [Part("/x", static=False, columns={**stamps, **columns})])


def cloud(points, intensities, rings):
    """Two rows of clouds with so many of each."""
    cells = {"Points3D:positions": np.zeros(3 * points, np.float32)}
    cells |= {"intensity": bytes(4 * intensities), "ring": bytes(2 * rings)}
    return readings("lidar", **{name: [cell] * 2 for name, cell in cells.items()})


def test_columns_of_readings_are_as_long_as_each_other_and_of_whole_points():
    assert len(cloud(2, 2, 2)) == 2
    for counts in ((2, 3, 2), (2, 2, 1), (1, 2, 2)):
        reason = f"{3 * counts[0]} coordinates, {4 * counts[1]} bytes of intensities"
        assert refusal(cloud, *counts).endswith(f": {reason}")
    shots = np.array([3.0]).tobytes()
    assert len(readings("gun", numbers=[shots, shots])) == 2
    assert refusal(lambda: readings("gun", numbers=[shots])) == "/x: columns of unequal length"
    for number in (-1, 1 << 32):
        wrong = {"sequence": [np.array([0]), np.array([number])], "numbers": [shots, shots]}
        assert refusal(lambda wrong=wrong: readings("gun", **wrong)).endswith(
            ": sequence: a whole number from 0 is needed"
        )
    last = {"sequence": [np.array([0]), np.array([(1 << 32) - 1])], "numbers": [shots, shots]}
    assert readings("gun", **last).sequence.tolist() == [0, (1 << 32) - 1]


@pytest.mark.parametrize(
    ("cells", "reason"),
    [
        ([np.zeros(2, np.float64)], "expected numbers of type float32"),
        (["text"], "expected numbers of type float32"),
        ([b"12"], "expected numbers of type float32"),
    ],
)
def test_arrays_of_another_kind_are_refused(cells, reason):
    part = Part("/x", static=False, columns={"points": cells})
    assert refusal(part.arrays, "points", "<f4") == f"/x: points: {reason}"
    whole = Part("/x", static=False, columns={"points": [np.zeros((2, 3), np.float32), b"", np.zeros(0, np.int64)]})
    assert [one.shape for one in whole.arrays("points", "<f4")] == [(6,), (0,), (0,)]


def test_a_file_of_something_else_or_without_a_run_is_refused(recording, monkeypatch):
    parsed = parsed_file(recording, reader.READ_COLUMNS, reader.READ_ENTITIES, whole=False)

    def refused(**columns):
        parts = [replace(part, columns=dict(part.columns) | columns) if part.entity == reader.RUN else part
                 for part in parsed.parts]  # fmt: skip
        monkeypatch.setattr(reader, "parsed_file", lambda *_, **__: replace(parsed, parts=tuple(parts)))
        return refusal(read_record, recording)

    assert refused(head=[]) == refused(files=[]) == f"'{recording}' is damaged: /record/run: empty"
    other = tuple(part for part in parsed.parts if part.entity != reader.RUN)
    monkeypatch.setattr(reader, "parsed_file", lambda *_, **__: replace(parsed, parts=other))
    assert refusal(read_record, recording).endswith(
        "is not a recording of vrx_mj: it is a rerun file of something else"
    )


def test_a_moment_is_a_number_and_states_are_those_until_it(recording):
    record = read_record(recording)
    first, last = record.states[0], record.states[-1]
    assert record.state_at(last.time) == record.state_at(math.inf) == last
    assert record.state_at(first.time) == first
    with pytest.raises(RecordError) as refused:
        record.state_at(math.nan)
    assert str(refused.value) == "invalid time nan: a number of seconds is needed"
    with pytest.raises(RecordError, match=r"has no state at or before -1 s; the first is at 0 s$"):
        record.state_at(-1.0)
    with pytest.raises(RecordError, match=r"has no state at or before -1 s$"):
        replace(record, states=()).state_at(-1.0)


def test_rows_of_a_state_that_had_diverged_are_left_out(recording):
    record = read_record(recording)
    assert record.without_divergence() is record
    rows = record.rows.copy()
    rows[-1, 20] = np.inf
    found = replace(record, rows=rows).without_divergence()
    assert np.array_equal(found.rows, record.rows[:-1])
    assert np.array_equal(found.row_companies, record.row_companies[:-1])


def test_timesteps_that_differ_are_told(recording):
    record = read_record(recording)
    assert "timestep: 0.01 s and 0.02 s" in compare(record, replace(record, timestep=0.02)).differences
    assert not compare(record, record).differences


def test_a_world_with_other_columns_than_its_rows_is_refused():
    world = compile_world("ocean", nudge=False)
    model = Simulation(world).model
    rows = scene_of(Simulation(world)).layout()
    check_columns(BoatSet(rows, "", world.files()), model)
    wrong = BoatSet(replace(rows, nv=rows.nv + 1), "", world.files())
    assert refusal(check_columns, wrong, model) == (
        "the recording is damaged: the columns of its rows are not those of its world"
    )


def test_a_parser_may_take_memory_and_time_for_the_size_of_a_recording(recording, monkeypatch):
    given = {}

    def noted(job, *arguments, **options):
        given.update(options, job=job)
        return ask(job, *arguments, **options)

    monkeypatch.setattr(rrd, "ask", noted)
    read_record(recording)
    size = recording.stat().st_size
    assert (given["memory"], given["answer"]) == (2 * ((64 << 20) + 16 * size), (64 << 20) + 16 * size)
    assert given["seconds"] == 5 + (size >> 20)
    assert given["reads"] == [recording.absolute()]


def test_a_viewer_that_is_not_installed_and_a_file_that_cannot_be_read_are_told(recording, monkeypatch, tmp_path):
    monkeypatch.setattr("rerun.__file__", str(tmp_path / "rerun_sdk" / "rerun" / "__init__.py"))
    path = tmp_path / "rerun_sdk" / "rerun_cli" / ("rerun.exe" if sys.platform == "win32" else "rerun")
    assert refusal(rrd.viewer_binary) == f"no rerun viewer at '{path}': install rerun-sdk for this platform"
    path.parent.mkdir(parents=True)
    path.touch()
    assert rrd.viewer_binary() == path
    monkeypatch.setenv("SOME", "thing")
    assert {"SOME": "thing", "CI": "true"}.items() <= rrd.viewer_environment().items()

    def fail(_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(rrd, "_whole_file", fail)
    assert refusal(read_record, recording) == f"cannot read the recording '{recording}': Permission denied"
