"""Recordings as files of other programs: Arrow tables, CSV, Parquet, GPX, GeoJSON, and pictures with COCO labels."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import numpy as np

from vrx_mj.arguments import as_number, as_path, as_text, check_name
from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.bar import Bar
from vrx_mj.errors import CommandError, RecordError, quote
from vrx_mj.outputs import atomic_write, write_files
from vrx_mj.recording.reader import Record, Track, read_record
from vrx_mj.recording.record_scene import POSITION, VELOCITY
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.state import State
from vrx_mj.sensors.readings import Labels, Reading
from vrx_mj.sensors.view import CATEGORIES

if TYPE_CHECKING:
    import pyarrow as pa

    from vrx_mj.model.things import Georeference


_JPEG_QUALITY = 95
"""Quality of the pictures of a data set, of 100."""
UNITS: Mapping[str, Mapping[str, str]] = {
    "motion": {
        "time": "s", "name": "", "kind": "", "x": "m", "y": "m", "z": "m", "qw": "1", "qx": "1", "qy": "1", "qz": "1",
        "roll": "rad", "pitch": "rad", "yaw": "rad", "vx": "m/s", "vy": "m/s", "vz": "m/s",
        "wx": "rad/s", "wy": "rad/s", "wz": "rad/s", "latitude": "deg", "longitude": "deg",
    },
    "thrust": {"time": "s", "boat": "", "thruster": "", "thrust": "N", "angle": "rad"},
    "wind": {"time": "s", "speed": "m/s", "direction": "rad"},
    "contacts": {"time": "s", "boat": "", "other": "", "force": "N"},
    "events": {"time": "s", "level": "", "text": ""},
}  # fmt: skip
"""Units of the columns of each table; texts have none."""


class CocoWriter(AbstractContextManager["CocoWriter"]):
    """Writes a data set, which is complete when the context ends, also by an exception.

    The same pictures give the same bytes.
    """

    def __init__(self, folder: str | Path, description: str = "vrx_mj") -> None:
        """Begin a data set.

        Args:
            folder: is made if need be; an older data set in it is replaced.
            description: of the data set, in its `info`.
        """
        self._folder = as_path("folder", folder)
        self._description = as_text("description", description)
        self._images: list[dict[str, Any]] = []
        self._annotations: list[dict[str, Any]] = []

    def __len__(self) -> int:
        """Number of pictures."""
        return len(self._images)

    def __exit__(self, *_: object) -> None:
        whole = {"info": {"description": self._description}, "images": self._images, "annotations": self._annotations}
        whole |= {"categories": [*CATEGORIES.values()]}
        write_files(self._folder, {"annotations.json": json.dumps(whole) + "\n"}, "the data set", RecordError)

    def add(self, reading: Reading) -> None:
        """Add a camera's picture.

        Args:
            reading: with labels, as `Simulation.labelled` gives it.

        Raises:
            CommandError: it has none.
            RecordError: it cannot be written.
        """
        labels = getattr(getattr(reading, "data", None), "labels", None)
        if not isinstance(labels, Labels):
            raise CommandError(f"invalid reading {quote(reading)}: one with labels is needed, as sim.labelled gives it")
        number, boat = len(self._images) + 1, reading.frame.partition("/")[0]
        name = f"{number:06}_{boat}_{reading.name}.jpg"
        write_files(self._folder, {f"images/{name}": reading.data.jpeg(_JPEG_QUALITY)}, "the data set", RecordError)
        height, width = labels.mask.shape
        self._images.append({"id": number, "file_name": name, "width": width, "height": height, "time": reading.time})
        for one in labels.objects:
            own = {"id": len(self._annotations) + 1, "image_id": number, "category_id": one.category_id}
            seen = {"name": one.name, "bbox": one.box, "area": one.area, "iscrowd": 0}
            runs = {"size": [height, width], "counts": run_lengths(labels.mask == one.number)}
            self._annotations.append({**own, **seen, "segmentation": runs})


def run_lengths(mask: BoolArray) -> list[int]:
    """COCO's uncompressed run lengths of a mask (height, width): down its columns, of 0 first, then of 1, in turn."""
    changes = np.flatnonzero(np.diff(mask.ravel(order="F"), prepend=False))
    return [int(length) for length in np.diff([0, *changes, mask.size])]


def write_coco(
    source: str | Path, folder: str | Path, *, boat: str | None = None, begin: float | None = None,
    end: float | None = None,
) -> int:  # fmt: skip
    """Write the cameras' pictures at every second of a recording, even if they were not recorded; returns their number.

    Args:
        source: a recording.
        folder: of the data set.
        boat: whose cameras; None: those of all boats.
        begin: first simulated time [s]; None: that of the recording.
        end: last simulated time [s]; None: that of the recording.

    Raises:
        RecordError: the file is not a recording, or has no camera or no state in that span, or nothing can be written.
        UnknownNameError: no boat of that name has a camera.
        RenderError: nothing can draw here; the message names what to install.
    """
    recorded = read_record(source)
    worlds = {one.world_sha256: one for one in recorded.companies}
    carriers = {row.boat for one in worlds.values() for row in one.world.parameters.sensors if row.type == "camera"}
    if not carriers:
        raise RecordError(f"'{recorded.path}' has no boat with a camera")
    if boat is not None:
        check_name("boat with a camera", boat, sorted(carriers))
    low, high = -math.inf if begin is None else as_number(begin), math.inf if end is None else as_number(end)
    seconds = {round(saved.time, 6): saved for saved in recorded.states}  # the end may be saved twice
    states = [saved for time, saved in seconds.items() if low <= time <= high]
    if not states:
        span = f"invalid begin {quote(begin)} or end {quote(end)}"
        raise RecordError(f"{span}: '{recorded.path}' has no state in that span; one is saved every second")
    about = f"{recorded.properties.get('world')}, seed {recorded.properties.get('seed')}"
    with CocoWriter(folder, about) as coco, Bar("drawing", len(states), "seconds") as bar:
        sim = Simulation(recorded.companies[0].world)
        for number, saved in enumerate(states, 1):
            state = State.from_bytes(saved.blob)
            if state.world in worlds and state.world != sim.world.sha256:
                sim = Simulation(worlds[state.world].world)
            sim.set_state(state)
            for name in sim.boats:
                for camera in sim.mounted(name) if boat in (None, name) else ():
                    if camera.config.type == "camera":
                        coco.add(sim.labelled(name, camera.name))
            bar.update(number)
    return len(coco)


_Columns = Mapping[str, Any]
"""Values of each column of a table."""


def read(recording: str | Path | Record) -> dict[str, pa.Table]:
    """A recording as Arrow tables by name; `tables["motion"].to_pandas()` is a data frame where pandas is installed.

    - `motion`: a row for each recorded time and moving body. Position and quaternion of its origin, and roll, pitch and
      yaw, in the world's axes; linear and angular velocity (vx to wz) in the body's, forward-left-up; latitude and
      longitude, null where the world has no georeference.
    - `thrust`: a row for each time and thruster.
    - `wind`: a row for each time; `direction` is the direction it blows toward, counter-clockwise from x, like `yaw`.
    - `contacts`: a row for each touch of a boat, with the largest force of its first half second.
    - `events`: a row for each message.

    The metadata of each column contain its unit.

    Raises:
        RecordError: the file is missing, not a recording, damaged, or of another version.
    """
    import pyarrow as pa

    recorded = recording if isinstance(recording, Record) else read_record(recording)
    found = {}
    for name, columns in _tables(recorded):
        types = {unit: pa.float64() if unit else pa.string() for unit in UNITS[name].values()}
        fields = [pa.field(key, types[unit], metadata={"unit": unit}) for key, unit in UNITS[name].items()]
        found[name] = pa.Table.from_pydict(dict(columns), pa.schema(fields))
    return found


def _tables(recorded: Record) -> Iterator[tuple[str, _Columns]]:
    earth = recorded.parameters.georeference if recorded.files else None
    kinds = {"boat": recorded.boats, "object": recorded.objects, "ball": recorded.balls}
    bodies = [(track, kind) for kind, several in kinds.items() for track in several.values()]
    yield "motion", _join("motion", (_motion(recorded.time, *body, earth) for body in bodies))
    yield "thrust", _join("thrust", (part for track, _ in bodies for part in _thrusts(recorded.time, track)))
    east, north = recorded.wind_direction
    direction = np.arctan2(north, east) + recorded.wind_angle
    yield "wind", {"time": recorded.time, "speed": recorded.wind, "direction": direction}
    touches = [event.touch for event in recorded.events if event.touch is not None]
    yield "contacts", {key: [getattr(touch, key) for touch in touches] for key in UNITS["contacts"]}
    yield "events", {key: [getattr(event, key) for event in recorded.events] for key in UNITS["events"]}


def _join(name: str, parts: Iterator[_Columns]) -> _Columns:
    """The rows of several tables, in the order of time."""
    several = list(parts)
    columns = {key: np.concatenate([part[key] for part in several] or [np.zeros(0)]) for key in UNITS[name]}
    order = np.argsort(columns["time"], kind="stable")
    return {key: column[order] for key, column in columns.items()}


def _motion(time: FloatArray, track: Track, kind: str, earth: Georeference | None) -> _Columns:
    """Rows of one body while it is there."""
    from scipy.spatial.transform import Rotation

    there = np.isfinite(track.position[:, 0])
    position, quaternion = track.position[there], track.quaternion[there]
    yaw, pitch, roll = Rotation.from_quat(quaternion, scalar_first=True).as_euler("ZYX").T
    geodetic = [earth.to_geodetic(*row)[:2] for row in position.tolist()] if earth else [(None, None)] * len(position)
    latitude, longitude = np.array(geodetic, object).reshape(-1, 2).T
    motion = (position, quaternion, track.velocity[there], track.angular_velocity[there])
    numbers = dict(zip((*POSITION, *VELOCITY), np.concatenate(motion, axis=1).T, strict=True))
    numbers |= {"roll": roll, "pitch": pitch, "yaw": yaw}
    names = {"name": np.full(len(yaw), track.name, object), "kind": np.full(len(yaw), kind, object)}
    return {"time": time[there], **names, **numbers, "latitude": latitude, "longitude": longitude}


def _thrusts(time: FloatArray, track: Track) -> Iterator[_Columns]:
    there = np.isfinite(track.position[:, 0])
    boat = np.full(int(there.sum()), track.name, object)
    for thruster, thrust in track.thrust.items():
        names = {"boat": boat, "thruster": np.full_like(boat, thruster)}
        yield {"time": time[there], **names, "thrust": thrust[there], "angle": track.angle[thruster][there]}


def write_table(recording: str | Path, target: Path, table: str = "motion") -> int:
    """Write a table of a recording as CSV or Parquet, or the tracks of its boats as GPX or GeoJSON; the number of rows.

    Times of tracks count from 1970-01-01T00:00:00Z, as simulated time does in ROS.

    Raises:
        UnknownNameError: there is no table of this name.
        RecordError: the recording cannot be read, or its world has no georeference for a track.
        VrxError: the target cannot be written.
    """
    check_name("table", table, UNITS)
    found = read(recording)[table]
    if target.suffix.lower() in _TRACK_SUFFIXES:
        import pyarrow.compute as pc

        found = found.filter(pc.field("kind") == "boat").drop_null()
        if not found.num_rows:
            raise RecordError(f"no track in '{recording}': its world has no georeference, or no boat; .csv has x and y")
    with atomic_write(target, "the table") as path:
        write = SUFFIXES[target.suffix.lower()]
        (resolve_name(write) if isinstance(write, str) else write)(found, path)
    return int(found.num_rows)


def _tracks(table: pa.Table) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Boats and the rows of each."""
    rows = table.to_pylist()
    for name in dict.fromkeys(row["name"] for row in rows):
        yield name, [row for row in rows if row["name"] == name]


def _write_gpx(table: pa.Table, path: Path) -> None:
    """GPX 1.1 (topografix.com/GPX/1/1), a track for each boat."""
    top = ET.Element("gpx", version="1.1", creator="vrx_mj", xmlns="http://www.topografix.com/GPX/1/1")
    for name, rows in _tracks(table):
        track = ET.SubElement(top, "trk")
        ET.SubElement(track, "name").text = name
        segment = ET.SubElement(track, "trkseg")
        for row in rows:
            place = {"lat": f"{row['latitude']:.9f}", "lon": f"{row['longitude']:.9f}"}
            point = ET.SubElement(segment, "trkpt", place)
            ET.SubElement(point, "time").text = _utc(row["time"])
    ET.ElementTree(top).write(path, "utf-8", xml_declaration=True)


def _write_geojson(table: pa.Table, path: Path) -> None:
    """GeoJSON (RFC 7946), a line for each boat."""
    features = []
    for name, rows in _tracks(table):
        places = [[round(row["longitude"], 9), round(row["latitude"], 9)] for row in rows]
        line = {"type": "LineString", "coordinates": places}
        properties = {"name": name, "times": [_utc(row["time"]) for row in rows]}
        features.append({"type": "Feature", "properties": properties, "geometry": line})
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}), encoding="utf-8")


def _utc(time: float) -> str:
    moment = datetime.fromtimestamp(0, UTC) + timedelta(seconds=time)
    return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")


_Write = Callable[[Any, Path], None]
_TRACK_SUFFIXES: Mapping[str, _Write] = {".gpx": _write_gpx, ".geojson": _write_geojson}
SUFFIXES: Mapping[str, str | _Write] = {
    ".csv": "pyarrow.csv:write_csv",
    ".parquet": "pyarrow.parquet:write_table",
    **_TRACK_SUFFIXES,
}
"""Writers by suffix; one given as a text is loaded when it is used."""
