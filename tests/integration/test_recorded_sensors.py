"""Readings in recordings: what is read back is what was sensed, and the motion is what it is without them."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import vrx_mj
from fingerprints import check
from integration.sailing import AHEAD, boats
from integration.sensing import COMPASS, GPS, GUN, IMU, P3D, PINGER, SONAR, SYDNEY, WIND, sailing
from integration.test_fingerprints_recordings import by_root, colors_of, numbers_of
from vrx_mj.config.sensors import CameraConfig, LidarConfig
from vrx_mj.config.world import Georeference
from vrx_mj.errors import CommandError, RecordError, SensorError, UnknownNameError
from vrx_mj.frames import rotation_matrix

LIDAR = LidarConfig(name="lidar", link="lidar_link", pose=(0.7, 0.0, 1.8, 0.0, 0.0, 0.0))
PLANAR = LidarConfig(
    name="planar", link="planar_link", output="scan", rings=1, samples=640, elevation=(0.0, 0.0), azimuth=(-1.6, 1.6),
    pose=(0.9, 0.0, 0.8, 0.0, 0.0, 0.0), range=(0.1, 30.0),
)  # fmt: skip
CAMERA = CameraConfig(name="camera", link="camera_link", pose=(0.75, 0, 1.5, 0, 0, 0), width=64, height=36)
TOTEM = {"name": "totem", "model": "red_totem", "pose": [9.0, 1.0, 0.0, 0.0, 0.0, 0.0]}
HERE = boats((0.0, 0.0, 0.0))
SUITE = (GPS, IMU, P3D, PINGER, GUN, LIDAR, PLANAR, WIND, COMPASS, SONAR)
NAMES = [config.name for config in SUITE]
SECONDS = 3.0


def sail(sim):
    for second in range(int(SECONDS)):
        sim.step({"a": AHEAD}, duration=0.5)
        if second == 1:
            sim.fire("a")
        sim.step({"a": AHEAD}, duration=0.5)


@pytest.fixture(scope="module")
def sim():
    return sailing(SUITE, fleet=HERE, objects=[TOTEM], seed=3)


@pytest.fixture(scope="module")
def recorded(sim, tmp_path_factory):
    """A record, and what was sensed meanwhile by somebody else."""
    path = tmp_path_factory.mktemp("sensors") / "run.rrd"
    sim.reset(3)
    sensed = {name: [] for name in NAMES}
    others = [sim.subscribe("a", name, sensed[name].append) for name in NAMES]
    with vrx_mj.record(sim, path, sensors="a"):
        sail(sim)
    for other in others:
        sim.unsubscribe(other)
    return vrx_mj.read_record(path), sensed


def same(one, other):
    """Whether two readings are equal to the last bit, types of arrays included."""
    plain = [(r.name, r.type, r.time, r.sequence, r.frame) for r in (one, other)]
    pairs = zip(vars(one.data).values(), vars(other.data).values(), strict=True)
    alike = all(
        type(a) is type(b) and np.asarray(a).dtype == np.asarray(b).dtype and np.array_equal(a, b) for a, b in pairs
    )
    return plain[0] == plain[1] and type(one.data) is type(other.data) and alike


def test_what_is_shown_of_readings_is_what_it_was(recorded):
    """First here, so that a map of lines has what the run of the module's recording passes through."""
    columns = numbers_of(recorded[0].path)
    check("recordings", "sensors", **by_root(columns), colors=colors_of(columns))


@pytest.mark.parametrize("name", NAMES)
def test_readings_come_back_to_the_last_bit(recorded, name):
    record, sensed = recorded
    found = record.readings("a", name)
    assert len(found) == len(sensed[name]) == int(SECONDS * found.sensor.rate) + 1
    assert all(same(one, other) for one, other in zip(found, sensed[name], strict=True))
    assert found.time.tolist() == [reading.time for reading in sensed[name]]
    assert same(found[-1], sensed[name][-1])
    assert [one.sequence for one in found[1:3]] == [1, 2]


def test_points_are_those_of_sense(sim, recorded):
    """Of another run, that only looks when it is over."""
    sim.reset(3)
    sim.sense("a")["lidar"]
    sail(sim)
    points = recorded[0].readings("a", "lidar")[-1].data.points
    assert points.tobytes() == sim.sense("a")["lidar"].data.points.tobytes()


def test_the_motion_is_the_same_with_and_without(sim, recorded, tmp_path):
    sim.reset(3)
    with vrx_mj.record(sim, tmp_path / "plain.rrd"):
        sail(sim)
    plain = vrx_mj.read_record(tmp_path / "plain.rrd")
    assert plain.rows.tobytes() == recorded[0].rows.tobytes()
    found = vrx_mj.compare(recorded[0], plain)
    assert found.equal
    assert str(found) == (
        f"equal bit for bit: {len(plain.rows)} rows\n"
        "readings of sensors are not compared: 10 sensors in the first recording, 0 in the second"
    )


def displayed(record, entity, component):
    """Times and values of one component of one entity."""
    from rerun.chunk import RrdReader

    stream = RrdReader(record.path).stream().filter(content=entity, components=component, is_static=False)
    batches = [chunk.to_record_batch() for chunk in stream]
    times = [time.total_seconds() for batch in batches for time in batch.column("sim_time").to_pylist()]
    return times, [value for batch in batches for value in batch.column(component).to_pylist()]


def test_fixes_are_shown_along_the_boats_way(recorded):
    record, _ = recorded
    times, places = displayed(record, "/world/tracks/a/gps", "Points3D:positions")
    assert len(times) == 46
    rows = np.searchsorted(record.time, np.array(times)[::3] - 1e-6)
    boat = record.boats["a"]
    arms = [rotation_matrix(boat.quaternion[row]) @ GPS.pose[:3] for row in rows]
    way = (boat.position[rows] + arms) * (1.0, 1.0, 0.0)  # at the mean water
    np.testing.assert_allclose(np.squeeze(places)[::3], way, atol=1e-5)
    _, angles = displayed(record, "/earth/a/gps", "GeoPoints:positions")
    x, y, _ = Georeference(**SYDNEY).to_enu(*angles[-1][0], 0.0)
    assert (x, y) == pytest.approx(places[-1][0][:2], abs=1e-3)


def test_a_scan_is_shown_where_the_totem_is(recorded):
    record, _ = recorded
    _, clouds = displayed(record, "/world/boats/a/sensors/planar", "Points3D:positions")
    scan = record.readings("a", "planar")[0].data
    assert len(clouds[0]) == np.isfinite(scan.ranges).sum() > 5
    ahead = np.array([point for point in clouds[0] if point[0] > 5.0])
    x, y, _ = ahead.mean(axis=0) + PLANAR.pose[:3]
    assert (x, y) == pytest.approx((9.0, 1.0), abs=0.6)


def test_a_ball_is_shown_from_its_shot_on_and_a_shot_is_an_event(recorded):
    record, _ = recorded
    assert set(record.objects) == {"totem"}
    assert list(record.balls) == ["a/gun"]
    times, places = displayed(record, "/world/balls/a/gun", "Points3D:positions")
    assert times[0] == pytest.approx(1.5)
    assert min(place[0][2] for place in places) > -2.0
    assert [(event.time, event.text) for event in record.events][1:] == [(1.6, "a gun: a shot, 3 left")]
    for entity in ("/world/objects/a/gun/shape", "/world/balls/a/gun/shape"):
        assert displayed(record, entity, "Mesh3D:vertex_positions") == ([], [])


def test_a_recording_with_sensors_opens_with_its_views(recorded):
    assert recorded[0].has_views


def test_what_was_not_recorded_cannot_be_read(recorded):
    with pytest.raises(UnknownNameError) as caught:
        recorded[0].readings("a", "sonar")
    known = ", ".join(f"a:{name}" for name in NAMES)
    assert str(caught.value) == f"no recorded sensor named 'a:sonar'; known: {known}"


@pytest.mark.parametrize(
    ("sensors", "kind", "text"),
    [
        (["b:gps"], UnknownNameError, "no boat named 'b'; known: a"),
        ("sonar", UnknownNameError, f"no sensor of a named 'sonar'; known: {', '.join(NAMES)}"),
        ("imu@30", CommandError, "imu of a measures at 15 Hz: it cannot be recorded at 30 Hz"),
    ],
)
def test_wrong_sensors_are_refused_before_there_is_a_file(sim, tmp_path, sensors, kind, text):
    with pytest.raises(kind) as caught, vrx_mj.record(sim, tmp_path / "run.rrd", sensors=sensors):
        pass
    assert str(caught.value) == text
    assert not (tmp_path / "run.rrd").exists()


def test_a_sensor_that_cannot_measure_ends_the_recording_properly(tmp_path):
    sim = sailing((GPS,), georeference=None)
    with pytest.raises(SensorError, match="has no georeference"), vrx_mj.record(sim, tmp_path / "run.rrd", sensors="a"):
        sim.step(duration=1.0)
    assert len(vrx_mj.read_record(tmp_path / "run.rrd").readings("a", "gps")) == 0
    sim.step(duration=1.0)  # nobody listens any more


@pytest.mark.slow
def test_two_recordings_at_once_take_each_its_own_rate(sim, tmp_path):
    sim.reset(3)
    one, two = tmp_path / "one.rrd", tmp_path / "two.rrd"
    with vrx_mj.record(sim, one, sensors="imu@5"), vrx_mj.record(sim, two, sensors=["a:imu", "p3d@1"]):
        sim.step(duration=2.0)
    assert len(vrx_mj.read_record(one).readings("a", "imu")) == 11
    assert len(vrx_mj.read_record(two).readings("a", "imu")) == 31
    assert len(vrx_mj.read_record(two).readings("a", "p3d")) == 3


def test_scans_that_meet_nothing_come_back_empty(tmp_path):
    sim = sailing((LIDAR,), fleet=HERE)
    with vrx_mj.record(sim, tmp_path / "run.rrd", sensors="a"):
        sim.step(duration=0.5)
    record = vrx_mj.read_record(tmp_path / "run.rrd")
    clouds = [scan.data for scan in record.readings("a", "lidar")]
    assert [(cloud.points.shape, cloud.intensity.shape, cloud.ring.dtype) for cloud in clouds] == [
        ((0, 3), (0,), np.uint16)
    ] * 6


@pytest.mark.slow
@pytest.mark.nightly
def test_the_recording_of_a_killed_run_has_its_readings(tmp_path):
    path = tmp_path / "killed.rrd"
    run = subprocess.Popen(
        [sys.executable, "-m", "integration.test_recorded_sensors", str(path)],
        cwd=Path(__file__).resolve().parents[1],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert run.stdout is not None
    begun = time.monotonic()
    while time.monotonic() < begun + 60.0 and scans_in(path) < 30:  # slow machines take a while to begin
        run.stdout.readline()
    run.kill()
    run.communicate()
    record = vrx_mj.read_record(path)
    assert not record.complete
    for name in ("gps", "lidar"):
        found = record.readings("a", name)
        assert len(found) >= 30
        assert found.sequence.tolist() == list(range(len(found)))
    assert len(found[-1].data.points) > 10


def scans_in(path):
    """How many scans the file of a run holds that still goes on."""
    try:
        return len(vrx_mj.read_record(path).readings("a", "lidar"))
    except RecordError:
        return 0


@pytest.mark.render
def test_pictures_come_back_as_they_were_seen(tmp_path):
    """JPEG is not exact: half a grey level in the mean, and a few at the edges."""
    sim = sailing((CAMERA.model_copy(update={"noise": 0.0}),), fleet=HERE, objects=[TOTEM], seed=3)
    seen = []
    sim.subscribe("a", "camera", seen.append, rate=5.0)
    with vrx_mj.record(sim, tmp_path / "run.rrd", sensors="camera@5"):
        sim.step({"a": AHEAD}, duration=1.0)
    found = vrx_mj.read_record(tmp_path / "run.rrd").readings("a", "camera")
    assert [image.time for image in found] == [image.time for image in seen]
    assert len(found) == 6
    for image, other in zip(found, seen, strict=True):
        assert image.data.info == other.data.info
        assert image.data.rgb.shape == (36, 64, 3)
        off = image.data.rgb.astype(float) - other.data.rgb
        assert abs(off).mean() < 6.0
        assert abs(off.mean()) < 1.0


@pytest.mark.render
def test_boxes_of_labels_are_over_recorded_pictures(tmp_path):
    from rerun.chunk import RrdReader

    sim = sailing((CAMERA.model_copy(update={"labels": True}),), fleet=HERE, objects=[TOTEM], seed=3)
    seen = []
    sim.subscribe("a", "camera", seen.append, rate=5.0)
    with vrx_mj.record(sim, tmp_path / "run.rrd", sensors="camera@5"):
        sim.step({"a": AHEAD}, duration=1.0)
    rows = [
        row
        for chunk in RrdReader(tmp_path / "run.rrd").stream().filter(content="/world/boats/a/sensors/camera")
        for row in chunk.to_record_batch().to_pylist()
        if row.get("Boxes2D:centers") is not None
    ]
    assert len(rows) == len(seen) == 6
    for row, reading in zip(rows, seen, strict=True):
        objects = reading.data.labels.objects
        assert row["Boxes2D:labels"] == [one.category for one in objects]
        corners = np.subtract(row["Boxes2D:centers"], row["Boxes2D:half_sizes"])
        assert corners.tolist() == [list(one.box[:2]) for one in objects]
        assert (2 * np.array(row["Boxes2D:half_sizes"])).tolist() == [list(one.box[2:]) for one in objects]
    assert "red_totem" in rows[0]["Boxes2D:labels"]
    assert len(vrx_mj.read_record(tmp_path / "run.rrd").readings("a", "camera")) == 6


@pytest.mark.render
def test_a_cameras_pinhole_and_place_are_in_the_recording(tmp_path):
    """A point straight ahead of the camera, 2 m away, is projected to the middle of the picture."""
    sim = sailing((CAMERA,), fleet=HERE)
    with vrx_mj.record(sim, tmp_path / "run.rrd", sensors="all@1"):
        sim.step(duration=0.1)
    fixed = static_parts(tmp_path / "run.rrd", "/world/boats/a/sensors/camera")
    camera = np.array(fixed["Pinhole:image_from_camera"]).reshape(3, 3).T  # columns one after another
    turn = np.array(fixed["Transform3D:mat3x3"]).reshape(3, 3).T
    ahead = turn.T @ (np.array([2.75, 0.0, 1.5]) - np.ravel(fixed["Transform3D:translation"]))
    assert ahead == pytest.approx([0.0, 0.0, 2.0], abs=1e-6)
    assert (camera @ ahead / ahead[2])[:2] == pytest.approx([32.0, 18.0])
    assert np.ravel(fixed["Pinhole:resolution"]) == pytest.approx([64.0, 36.0])
    assert np.ravel(fixed["EncodedImage:media_type"]) == ["image/jpeg"]
    up = turn.T @ np.array([0.0, 0.0, 1.0])
    assert up == pytest.approx([0.0, -1.0, 0.0], abs=1e-6)  # up is toward the first row


def static_parts(path, entity):
    """Static components of an entity."""
    from rerun.chunk import RrdReader

    parts = {}
    for chunk in RrdReader(path).stream().filter(content=entity, is_static=True):
        for name, values in chunk.to_record_batch().to_pydict().items():
            if values and values[0] is not None:
                parts[name] = values[0]
    return parts


def sail_until_killed(path):
    sim = sailing((GPS, LIDAR), fleet=HERE, objects=[TOTEM])
    with vrx_mj.record(sim, path, sea=False, sensors="a"):
        while True:
            sim.step(duration=0.5)
            sys.stdout.write(f"{sim.time}\n")
            sys.stdout.flush()
            time.sleep(0.3)


if __name__ == "__main__":
    sail_until_killed(sys.argv[1])
