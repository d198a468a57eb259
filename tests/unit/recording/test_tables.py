import json
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.parquet
import pytest

import vrx_mj
from vrx_mj.errors import RecordError, UnknownNameError
from vrx_mj.recording.exports import UNITS, read, write_table
from vrx_mj.recording.parts import Part
from vrx_mj.recording.reader import all_events
from vrx_mj.runtime.subscriptions import Touch

COURSE = {
    "extends": "ocean",
    "objects": [{"name": "buoy", "model": "robotx_light_buoy", "pose": [40, 0, 0.25, 0, 0, 0]}],
    "wind": {"direction": 90, "mean_velocity": 3.0},
    "georeference": {"latitude": -33.7, "longitude": 150.6, "elevation": 0.0, "heading": 30},
}


def recorded(world, file, duration):
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet={"usv_count": 2, "layout": "line", "origin": "spawn"}))
    sim.reset(seed=3)
    touches = []
    sim.watch_contacts(touches.append)
    with vrx_mj.record(sim, file):
        sim.step({"wamv1": {"left": 0.6, "right": 0.4}}, duration=duration)
    return sim, touches


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    file = tmp_path_factory.mktemp("runs") / "run.rrd"
    return file, *recorded(COURSE, file, 2.0)


@pytest.fixture(scope="module")
def tables(run):
    return read(run[0])


def test_motion_is_what_the_record_has_bit_by_bit(run, tables):
    record, motion = vrx_mj.read_record(run[0]), tables["motion"]
    bodies = len(record.boats) + len(record.objects) + len(record.balls)
    assert motion.num_rows == len(record.time) * bodies
    boat = motion.filter(pc.field("name") == "wamv1")
    columns = {key: boat[key].to_numpy() for key, unit in UNITS["motion"].items() if unit}
    track = record.boats["wamv1"]
    assert np.array_equal(columns["time"], record.time)
    for keys, values in (
        (("x", "y", "z"), track.position),
        (("qw", "qx", "qy", "qz"), track.quaternion),
        (("vx", "vy", "vz"), track.velocity),
        (("wx", "wy", "wz"), track.angular_velocity),
    ):
        assert np.array_equal(np.stack([columns[key] for key in keys], axis=1), values), keys


def test_the_last_row_is_what_the_simulation_says(run, tables):
    _, sim, _ = run
    seen = sim.observe()["wamv1"]
    last = tables["motion"].filter(pc.field("name") == "wamv1").to_pylist()[-1]
    w, x, y, z = seen.quaternion
    assert last["yaw"] == pytest.approx(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)), abs=1e-12)
    assert last["pitch"] == pytest.approx(np.arcsin(2 * (w * y - z * x)), abs=1e-12)
    assert last["roll"] == pytest.approx(np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), abs=1e-12)
    assert [last["vx"], last["vy"], last["vz"]] == pytest.approx(list(seen.velocity), abs=1e-12)
    place = sim.world.parameters.georeference.to_geodetic(last["x"], last["y"], last["z"])
    assert (last["latitude"], last["longitude"]) == place[:2]
    thrust = tables["thrust"].filter((pc.field("boat") == "wamv1") & (pc.field("thruster") == "left"))
    assert thrust["thrust"][-1].as_py() == pytest.approx(sim.thrust("wamv1")["left"])
    assert tables["wind"]["speed"][-1].as_py() == sim.wind.speed
    assert tables["wind"]["direction"][-1].as_py() == pytest.approx(sim.wind.direction)


def test_contacts_are_the_touches_that_a_watch_sees(tmp_path):
    pier = {"name": "pier", "pose": [14, 0, 0, 0, 0, 0], "layout": "XX\nXX\n"}
    world = {"extends": "ocean", "docks": [pier], "sea": {"model": "none"}}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world))
    seen = []
    watch = sim.watch_contacts(lambda touch: seen.append(replace(touch)), ended=True)
    with vrx_mj.record(sim, tmp_path / "run.rrd"):
        sim.step({"wamv": {"left": 1.0, "right": 1.0}}, duration=12.0)
    sim.unwatch_contacts(watch)
    found = read(tmp_path / "run.rrd")["contacts"].to_pylist()
    assert seen
    assert found == [{key: getattr(touch, key) for key in UNITS["contacts"]} for touch in seen]


def test_columns_have_their_units(tables):
    for name, table in tables.items():
        units = {field.name: field.metadata[b"unit"].decode() for field in table.schema}
        assert units == UNITS[name]


@pytest.mark.parametrize("table", UNITS)
def test_files_hold_the_table_to_the_last_bit(run, tables, tmp_path, table):
    whole = tables[table]
    for suffix, back in ((".csv", pyarrow.csv.read_csv), (".parquet", pyarrow.parquet.read_table)):
        target = tmp_path / f"out{suffix}"
        assert write_table(run[0], target, table) == whole.num_rows
        assert back(target).select(whole.column_names).to_pylist() == whole.to_pylist()


def test_tracks_have_the_latitudes_and_longitudes_of_the_boats(run, tables, tmp_path):
    motion = tables["motion"].filter(pc.field("kind") == "boat")
    rows = [(row["name"], row["longitude"], row["latitude"]) for row in motion.to_pylist()]
    expected = {name: [row[1:] for row in rows if row[0] == name] for name in ("wamv1", "wamv2")}
    assert write_table(run[0], tmp_path / "out.gpx") == motion.num_rows
    write_table(run[0], tmp_path / "out.geojson")
    lines = json.loads((tmp_path / "out.geojson").read_text(encoding="utf-8"))["features"]
    gpx = ET.parse(tmp_path / "out.gpx").getroot()
    space = {"g": "http://www.topografix.com/GPX/1/1"}
    for line, track in zip(lines, gpx.findall("g:trk", space), strict=True):
        name = line["properties"]["name"]
        assert track.findtext("g:name", None, space) == name
        points = [(float(p.get("lon")), float(p.get("lat"))) for p in track.iterfind(".//g:trkpt", space)]
        assert points == [tuple(one) for one in line["geometry"]["coordinates"]]
        assert np.allclose(points, expected[name], rtol=0, atol=1e-9)  # 9 digits: 0.1 mm
        times = [p.text for p in track.iterfind(".//g:time", space)]
        assert times == line["properties"]["times"]
        assert times[1] == "1970-01-01T00:00:00.050Z"


def test_a_track_needs_a_georeference(tmp_path):
    recorded({"extends": "ocean", "georeference": None}, tmp_path / "run.rrd", 0.1)
    text = f"no track in '{tmp_path / 'run.rrd'}': its world has no georeference, or no boat; .csv has x and y"
    with pytest.raises(RecordError) as caught:
        write_table(tmp_path / "run.rrd", tmp_path / "out.gpx")
    assert str(caught.value) == text
    assert not (tmp_path / "out.gpx").exists()


def test_an_unknown_table_has_a_suggestion(run, tmp_path):
    with pytest.raises(UnknownNameError) as caught:
        write_table(run[0], tmp_path / "out.csv", "contact")
    assert str(caught.value) == "no table named 'contact'; did you mean 'contacts'?"


EVENTS = {"sim_time": [np.array([10**9])], "TextLog:text": ["hit"], "TextLog:level": ["WARN"]}


@pytest.mark.parametrize("touch", ["[", "{}", '{"boat": "a", "other": "b", "time": 1, "force": NaN}'])
def test_a_damaged_touch_is_refused(touch):
    with pytest.raises(RecordError, match=r"^/events: touch: "):
        all_events([Part("/events", False, {**EVENTS, "touch": [touch]})])


def test_bodies_that_were_not_there_have_no_rows(run):
    record = vrx_mj.read_record(run[0])
    rows = record.rows.copy()
    body = next(body for body in record.layout.bodies if body.name == "wamv2")
    rows[:7, record.layout.pose(body)] = np.nan
    motion = read(replace(record, rows=rows))["motion"]
    assert motion.filter(pc.field("name") == "wamv2").num_rows == len(rows) - 7


def test_a_touch_is_the_same_after_json():
    touch = Touch("a", "b", 0.1 + 0.2, 1 / 3)
    (event,) = all_events([Part("/events", False, {**EVENTS, "touch": [json.dumps(vars(touch))]})])
    assert event.touch == touch


def test_a_wind_that_turns_and_engines_that_steer(tmp_path):
    air = {"direction": 60, "mean_velocity": 5.0, "var_direction": 20, "var_direction_time": 0.5}
    world = {"extends": "ocean", "physics": {"profile": "marine"}, "sea": {"model": "none"}, "wind": air}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet={"engines": "hinged"}))
    with vrx_mj.record(sim, tmp_path / "run.rrd"):
        sim.step({"wamv": {"left": 0.5, "left_angle": 0.4, "right": 0.5}}, duration=1.0)
    tables, track = read(tmp_path / "run.rrd"), vrx_mj.read_record(tmp_path / "run.rrd").boats["wamv"]
    last = tables["wind"]["direction"][-1].as_py()
    assert np.sin(last - sim.wind.direction) == pytest.approx(0.0, abs=1e-9)
    assert abs(last - np.radians(60)) > 0.01
    for name in ("left", "right"):
        rows = tables["thrust"].filter(pc.field("thruster") == name)
        assert rows["angle"].to_pylist() == track.angle[name].tolist()
        assert rows["thrust"].to_pylist() == track.thrust[name].tolist()
    assert track.angle["left"][-1] > 0.1 > abs(track.angle["right"][-1])
