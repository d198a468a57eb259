import errno
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

import recorded_run
from fingerprints import check
from integration.test_fingerprints_recordings import by_root, numbers_of
from vrx_mj.errors import RecordError, VrxWarning
from vrx_mj.recording import encoding
from vrx_mj.recording.motion_chunks import POSE_STEP
from vrx_mj.recording.packing import plain_rows
from vrx_mj.recording.parts import FILE_HEADER, MESSAGE_HEADER, Part, whole_bytes
from vrx_mj.recording.reader import Event, read_record
from vrx_mj.recording.sea_meshes import bands, grid_around, swell_of
from vrx_mj.recording.session import RecordWriter
from vrx_mj.recording.water_chunks import LEAD, TRAIL_RATE

SECONDS = 6.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("测试 boats")
    return recorded_run.record_run(folder / "run.rrd", SECONDS)


@pytest.fixture(scope="module")
def record(recording):
    return read_record(recording)


def all_rows(seconds=SECONDS):
    return np.concatenate(list(recorded_run.blocks(seconds)))


def displayed(path, entity, component):
    """Values and times of one component of one entity, sorted by time."""
    from rerun.chunk import RrdReader

    stream = RrdReader(path).stream().filter(content=entity, components=component, is_static=False)
    batches = [chunk.to_record_batch() for chunk in stream]
    time = np.concatenate([batch.column("sim_time").to_numpy() for batch in batches])
    values = [value for batch in batches for value in batch.column(component).to_pylist()]
    return time.astype(np.float64) / 1e9, values


def test_rows_come_back_to_the_last_bit(record):
    assert record.complete
    assert record.rows.tobytes() == all_rows().tobytes()


def test_tracks_are_columns_of_the_rows(record):
    rows, boat = all_rows(), record.boats["wamv2"]
    assert list(record.boats) == ["wamv1", "wamv2", "wamv3"]
    assert list(record.objects) == list(recorded_run.BUOYS)
    np.testing.assert_array_equal(record.time, rows[:, 0])
    np.testing.assert_array_equal(record.wind, rows[:, 1])
    np.testing.assert_array_equal(boat.thrust["right"], rows[:, 2 + 3])
    np.testing.assert_array_equal(boat.angle["left"], rows[:, 2 + 6 + 2])
    np.testing.assert_array_equal(boat.position, rows[:, 14 + 7 : 14 + 10])
    np.testing.assert_array_equal(boat.quaternion, rows[:, 14 + 10 : 14 + 14])


def test_velocity_is_in_the_body_axes(record):
    """Rotating it back with MuJoCo's own function gives the row's world velocity."""
    import mujoco

    boat = record.boats["wamv1"]
    start = record.layout.qvel.start
    for i in (0, 37, -1):
        world = np.empty(3)
        mujoco.mju_rotVecQuat(world, boat.velocity[i], boat.quaternion[i])
        np.testing.assert_allclose(world, record.rows[i, start : start + 3], atol=1e-9)


def test_properties_files_events_and_states_come_back(record):
    assert record.properties == recorded_run.scene().properties
    assert record.files == recorded_run.scene().files
    assert record.timestep == 0.01
    assert record.wind_direction == (0.0, 1.0)
    assert record.events == (
        Event(0.0, "the run starts", "INFO"),
        Event(SECONDS, "wamv1 reached the goal", "WARN"),
    )
    assert [state.time for state in record.states] == [float(k) for k in range(7)]
    assert record.states[2].blob == np.array(recorded_run.row_at(2.0)).tobytes()
    assert record.state_at(2.9) == record.states[2]


def test_state_before_the_first_is_an_error(record):
    with pytest.raises(RecordError) as caught:
        record.state_at(-1.0)
    assert str(caught.value) == f"'{record.path}' has no state at or before -1 s; the first is at 0 s"


def test_in_a_fast_sea_poses_are_shown_at_20_hz_and_plots_at_10_hz(recording):
    time, moved = displayed(recording, "/world/boats/wamv1", "Transform3D:translation")
    np.testing.assert_array_equal(time, np.arange(121) / 20)
    np.testing.assert_allclose(np.squeeze(moved), all_rows()[:, 14:17], atol=POSE_STEP[0] / 2 + 1e-5)
    time, speed = displayed(recording, "/plots/speed", "Scalars:scalars")
    np.testing.assert_array_equal(time, np.arange(61) / 10)
    velocity = all_rows()[::2, 14 + 42 : 14 + 44]
    steps = 1024.0 * np.array(speed)[:, 0]  # plots are in whole steps, the nearest: within half a one of what was
    np.testing.assert_array_equal(steps, np.floor(steps))
    np.testing.assert_allclose(steps, 1024.0 * np.hypot(*velocity.T), rtol=1e-12, atol=0.5)


def test_trail_is_one_line_without_gaps_across_flushes(tmp_path, monkeypatch):
    monkeypatch.setattr("vrx_mj.recording.encoding.MOST_ROWS", 1)
    path = recorded_run.record_run(tmp_path / "run.rrd", SECONDS)
    time, strips = displayed(path, "/world/trails/wamv1", "LineStrips3D:strips")
    pieces = np.squeeze(strips)
    np.testing.assert_array_equal(time, np.arange(SECONDS * TRAIL_RATE + 1) / TRAIL_RATE)
    np.testing.assert_array_equal(pieces[1:, 0], pieces[:-1, 1])
    np.testing.assert_allclose(pieces[:, 1, :2], all_rows()[:: round(20 / TRAIL_RATE), 14:16], atol=1e-5)


def test_headings_are_wrapped(tmp_path, monkeypatch):
    """A boat that turns round and round, to port: a compass counts backwards, from 0 to 360; yaw from -180 to 180."""
    monkeypatch.setattr("vrx_mj.recording.encoding.MOST_ROWS", 1)
    path = recorded_run.record_run(tmp_path / "run.rrd", 46.0)  # once round in 44 s
    rate = np.degrees(2.0 / 14.0) / 10
    for name, low, turn, slack in (
        ("heading", 0.0, -rate, 0.2),
        ("course", 0.0, -rate, 0.6),
        ("yaw", -180.0, rate, 0.2),
    ):
        _, angle = displayed(path, f"/plots/{name}", "Scalars:scalars")
        change = (np.diff(angle, axis=0) + 180.0) % 360.0 - 180.0
        np.testing.assert_allclose(change, turn, atol=slack)  # boats drift, too, which bends the course
        assert low <= np.min(angle) < low + 5.0
        assert low + 355.0 < np.max(angle) <= low + 360.0


def test_sea_is_where_the_sea_is(recording):
    """In the middle between the boats, where it is neither faded nor lowered under hulls."""
    grid = grid_around(all_rows()[0, 14:35].reshape(3, 7)[:, :2])
    path = f"/world/sea/{len(grid.y)}x{len(grid.x)}"
    meshes = [displayed(recording, f"{path}/{band.start}", "Mesh3D:vertex_positions") for band in bands(len(grid.y))]
    time = meshes[0][0]
    rate = swell_of(recorded_run.sea_height).rate
    np.testing.assert_array_equal(time, np.arange(np.ceil(all_rows()[-1, 0] * rate + 1e-6)) / rate)
    vertices = np.concatenate([frames[10] for _, frames in meshes])
    middle = vertices[np.hypot(*vertices[:, :2].T) < 3.0]
    assert len(middle) > 1
    expected = recorded_run.sea_height(middle[:, 0], middle[:, 1], time[10] + LEAD / rate)
    np.testing.assert_allclose(middle[:, 2], expected, atol=1 / 128 + 1e-3)  # rounded to 1/64 m; lines lean by 1 mm


def kinds_of_messages(path):
    data, place, kinds = path.read_bytes(), FILE_HEADER, []
    while not kinds or kinds[-1] != 0:
        kind, length = MESSAGE_HEADER.unpack_from(data, place)
        kinds.append(kind)
        place += MESSAGE_HEADER.size + length
    return kinds


def test_blueprint_is_in_the_file(recording):
    assert read_record(recording).has_views
    assert 3 in kinds_of_messages(recording)  # which has a viewer open with it


def test_writer_leaves_no_threads(tmp_path):
    tasks = Path("/proc/self/task")
    if not tasks.is_dir():
        pytest.skip("counts the threads of the whole process where Linux lists them")
    recorded_run.record_run(tmp_path / "first.rrd", 1.0)
    before = len(list(tasks.iterdir())), threading.active_count()
    for k in range(4):
        recorded_run.record_run(tmp_path / f"{k}.rrd", 1.0)
    assert (len(list(tasks.iterdir())), threading.active_count()) == before


@pytest.mark.slow
@pytest.mark.nightly
def test_recording_of_a_killed_run_reads_up_to_its_last_second(tmp_path):
    path = tmp_path / "killed.rrd"
    tests = Path(recorded_run.__file__)
    run = subprocess.Popen([sys.executable, str(tests), str(path)], stdout=subprocess.PIPE, text=True)
    assert run.stdout is not None
    said = [float(run.stdout.readline().split()[0]) for _ in range(16)]
    run.kill()
    run.communicate()
    record = read_record(path)
    assert not record.complete
    assert record.time[-1] >= said[-1] - 10.0  # a second of wall time is 5 s of this run; twice that, for slow machines
    rows = all_rows(record.time[-1])
    assert record.rows.tobytes() == rows.tobytes()


def test_recording_cut_anywhere_reads_or_says_so(recording, tmp_path):
    """As a full disk leaves it: what is whole is read."""
    whole, cut = recording.read_bytes(), tmp_path / "cut.rrd"
    counts = []
    for share in (0.999, 0.9, 0.7):
        cut.write_bytes(whole[: int(len(whole) * share)])
        assert whole_bytes(cut) <= cut.stat().st_size
        record = read_record(cut)
        assert not record.complete
        counts.append(len(record.rows))
        assert record.rows.tobytes() == all_rows()[: len(record.rows)].tobytes()
    assert counts[0] == 121
    cut.write_bytes(whole[:12])
    with pytest.raises(RecordError) as caught:
        read_record(cut)
    assert str(caught.value) == f"'{cut}' is not a recording of vrx_mj: it is damaged, or rerun has not finished it"


def test_file_that_is_no_recording_is_an_error(tmp_path):
    missing, text = tmp_path / "missing.rrd", tmp_path / "text.rrd"
    text.write_text("a text, not a recording", encoding="utf-8")
    with pytest.raises(RecordError) as caught:
        read_record(missing)
    assert str(caught.value) == f"no recording '{missing}'"
    with pytest.raises(RecordError) as caught:
        read_record(text)
    assert str(caught.value) == f"'{text}' is not a recording of vrx_mj: it does not begin as rerun's files do"
    robot = tmp_path / "boat.urdf"
    robot.write_text("<robot/>", encoding="utf-8")
    with pytest.raises(RecordError) as caught:
        read_record(robot)
    assert str(caught.value) == (
        f"'{robot}' is a robot description (URDF), not a recording: vrx-mj run example_course --fleet boat.urdf "
        "sails it"
    )


def test_rerun_file_of_something_else_is_an_error(tmp_path):
    import rerun as rr
    from rerun.chunk import Chunk, LazyChunkStream

    other = tmp_path / "other.rrd"
    chunk = Chunk.from_columns("/points", [], rr.Points3D.columns(positions=[[1.0, 2.0, 3.0]]))
    LazyChunkStream.from_iter([chunk]).write_rrd(other, application_id="other", recording_id="1")
    with pytest.raises(RecordError) as caught:
        read_record(other)
    assert str(caught.value) == f"'{other}' is not a recording of vrx_mj: it is a rerun file of something else"


def test_a_run_that_cannot_be_encoded_stays_as_it_was_written(tmp_path, monkeypatch):
    def full(*_):
        raise OSError("no room")

    path, rows = tmp_path / "run.rrd", np.array([recorded_run.row_at(0.0)])
    monkeypatch.setattr("vrx_mj.recording.encoding.encode", full)
    with RecordWriter(path, recorded_run.scene()) as writer:
        writer.rows(rows)
        with pytest.warns(VrxWarning, match=r"^no room; what was written is intact, and vrx-mj replay opens it$"):
            writer.close()
    assert np.array_equal(read_record(path).rows, rows)


def test_folder_that_does_not_exist_is_an_error(tmp_path):
    path = tmp_path / "no folder" / "run.rrd"
    with pytest.raises(RecordError) as caught:
        RecordWriter(path, recorded_run.scene())
    assert str(caught.value) == f"cannot write the recording '{path}': No such file or directory"


def test_rows_of_the_wrong_width_are_an_error(tmp_path):
    path = tmp_path / "run.rrd"
    with RecordWriter(path, recorded_run.scene()) as writer, pytest.raises(RecordError) as caught:
        writer.rows(np.zeros((2, 5)))
    assert str(caught.value) == f"rows of 5 columns for '{path}', which has 92"


def test_closed_writer_takes_nothing_more(tmp_path):
    path = tmp_path / "run.rrd"
    writer = RecordWriter(path, recorded_run.scene())
    writer.close()
    writer.close()
    with pytest.raises(RecordError) as caught:
        writer.event(0.0, "too late")
    assert str(caught.value) == f"the recording '{path}' is closed"


def test_a_full_disk_is_named_whatever_comes_after(tmp_path, monkeypatch):
    def full(*_):
        writer._file.close()  # as it does
        raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / "run.rrd"
    writer = RecordWriter(path, recorded_run.scene())
    monkeypatch.setattr(writer._file, "append", full)
    for _ in range(2):  # as the end of a run writes what is left
        with pytest.raises(RecordError) as caught:
            writer.event(0.0, "too much")
        assert str(caught.value) == f"cannot write the recording '{path}': No space left on device"


def test_an_error_at_the_close_reaches_the_caller(tmp_path):
    def broken(x, y, t):
        raise ValueError("no sea today")

    path = tmp_path / "run.rrd"
    writer = RecordWriter(path, replace(recorded_run.scene(), sea_height=broken))
    writer.rows(all_rows())
    with pytest.raises(RecordError) as caught:
        writer.close()
    assert str(caught.value) == f"cannot write the recording '{path}': no sea today"
    assert len(read_record(path).rows) == len(all_rows())


def test_scene_withouts_sea_or_thrusters_records(tmp_path):
    """A world of objects only, on calm water."""
    full = recorded_run.scene()
    buoy = replace(full.bodies[3], free=replace(full.bodies[3].free, qpos=0, dof=0))
    scene = replace(full, nq=7, nv=6, bodies=(buoy,), thrusters=(), sea_height=None)
    rows = np.arange(60.0).reshape(4, 15)
    with RecordWriter(tmp_path / "run.rrd", scene) as writer:
        writer.rows(rows)
    record = read_record(tmp_path / "run.rrd")
    assert record.rows.tobytes() == rows.tobytes()
    assert (list(record.boats), list(record.objects)) == ([], ["red_0"])


def test_recording_without_rows_reads(tmp_path):
    with RecordWriter(tmp_path / "run.rrd", recorded_run.scene()):
        pass
    record = read_record(tmp_path / "run.rrd")
    assert record.rows.shape == (0, 92)
    assert record.boats["wamv1"].position.shape == (0, 3)


def test_nan_is_recorded_as_it_is(tmp_path):
    """A run that diverged is the one to look at."""
    rows = all_rows(1.0)
    rows[-1, 20:30] = np.nan, np.inf, -np.inf, -0.0, 1e-310, -np.nan, 1e300, 0.0, -1e300, 5e-324
    with RecordWriter(tmp_path / "run.rrd", recorded_run.scene()) as writer:
        writer.rows(rows)
    assert read_record(tmp_path / "run.rrd").rows.tobytes() == rows.tobytes()


def test_parts_become_chunks_together_up_to_so_many_rows_or_bytes(monkeypatch):
    def rows(count):
        return Part(encoding.ROWS, False, {"block": [plain_rows(np.zeros((count, 2)))]})

    def blob(size):
        return Part("/blob", False, {"blob": [bytes(size)]})

    monkeypatch.setattr(encoding, "MOST_ROWS", 10)
    monkeypatch.setattr(encoding, "_MOST_BYTES", 1000)
    came = Part(encoding.COMPANIES, False, {})
    for parts, sizes in (
        ([rows(9), rows(1), rows(3)], [2, 1]),
        ([blob(5), rows(9), rows(9), rows(9)], [3, 1]),
        ([rows(10)], [1, 0]),
        ([blob(999), blob(1), blob(7)], [2, 1]),
        ([blob(1000), blob(999)], [1, 1]),
        ([rows(1), came, rows(1)], [2, 1]),
        ([], [0]),
    ):
        batches = list(encoding._batches(parts))
        assert [sum(map(len, batch.values())) for batch in batches] == sizes
        assert [part for batch in batches for own in batch.values() for part in own] == parts


@pytest.mark.parametrize(("said", "told"), [(b"one\ntwo: wrong\n", "two: wrong"), (b" \n", "3")])
def test_rerun_that_cannot_finish_a_file_is_heard(said, told, tmp_path, monkeypatch):
    calls = []

    def run(command, **options):
        calls.append((command[1:], options["timeout"], options["env"]["CI"]))
        return SimpleNamespace(returncode=3, stderr=said)

    monkeypatch.setattr(encoding.subprocess, "run", run)
    with pytest.raises(OSError, match=rf"^rerun cannot finish it: {told}$"):
        encoding.join_views(tmp_path / "a", tmp_path / "b", tmp_path / "c")
    wanted = ["rrd", "route", str(tmp_path / "b"), str(tmp_path / "a"), "-o", str(tmp_path / "c")]
    assert calls == [(wanted, 600.0, "true")]


ROBOT = """<mujoco><worldbody><body name="base" pos="0 0 1"><geom size="0.2"/>
<body name="arm/upper" pos="0.1 0 0.3" quat="0.8 0 0.6 0"><joint name="a" axis="0 1 0" pos="0 0 -0.1" range="-1 2"/>
<geom type="capsule" size="0.05 0.2"/><body name="hand" pos="0 0 0.4"><joint name="b" type="slide" axis="1 0 0"/>
<geom type="box" size="0.1 0.05 0.02"/></body></body></body></worldbody><actuator>
<position joint="a" ctrlrange="-1 2"/><position joint="b" ctrlrange="-0.1 0.3"/></actuator></mujoco>"""


def test_the_joints_of_a_robot_sweep_their_ranges_as_they_did(tmp_path):
    encoding.save_joints(mujoco.MjModel.from_xml_string(ROBOT), "robot", tmp_path / "robot.rrd")
    found = by_root(numbers_of(tmp_path / "robot.rrd"))
    assert {"robot", "robot/base"} < set(found)
    check("recordings", "joints of a robot", **found)
