"""What recordings of busy worlds hold, chunk for chunk: the numbers that they had before."""

import functools
import math
import re
import shutil
from collections import defaultdict

import numpy as np
import pytest
from pyarrow import types

import recorded_run
import vrx_mj
from fingerprints import check
from integration.jointed import PENDULUM, RAFT, simulation_of
from integration.test_fingerprints_worlds import compiled
from vrx_mj.recording.reader import read_record
from vrx_mj.recording.session import viewable

WINDY = {
    "sea": {"model": "jonswap", "significant_height": 0.4, "peak_period": 4.5, "components": 12, "spreading": 10.0},
    "wind": {"direction": 200, "mean_velocity": 6, "var_gain": 2, "var_direction": 8.0},
    "current": {"speed": 0.3, "direction": 80, "tide": {"speed": 0.4, "minor": 0.1, "direction": 20, "phase": 50}},
}
"""Weather of which a recording has arrows and figures."""
BOATS = {"boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0.4]}, {"name": "b", "pose": [9, 4, 0, 0, 0, 2.0]}]}
WORLDS = {
    "windy": WINDY,
    "pond": {"extends": "scan_dock_deliver", "sea": WINDY["sea"],
             "wind": {"direction": 200, "mean_velocity": 6, "var_gain": 2}},
    "fog": {"extends": "ocean", "scene": {"fog": {"type": "exp", "density": 0.02}},
            "sea": {"model": "regular", "height": 0.02, "period": 6.0}},
}  # fmt: skip
"""Worlds of two boats, for this file and others."""
EVERYDAY = {"wildlife_task": None}
BY_NIGHT = {
    "gymkhana": None,
    "example_course": "trio", "scan_dock_deliver": None, "perception_task": None, "wayfinding_task": None,
    "stationkeeping_task": None, "ocean_buoys": "usv_config", "my_course": None, "vrx2023/acoustic_tracking_task": None,
    "vrx2023/follow_path_task": None,
}  # fmt: skip
PROCESSORS = re.compile(r"/(record|__properties)/")
"""States and hashes: in `marine` their last digits are a processor's."""
NOT_OURS = re.compile(r"row_id|log_time|log_tick|RecordingInfo:start_time|rerun\.controls")
"""What tells of the machine and the hour."""


@functools.cache
def world_of(name):
    """One of `WORLDS`, compiled."""
    return compiled(WORLDS[name], fleet=BOATS)


def numbers_of(path):
    """Of each entity and column of a recording, all that it holds."""
    from rerun.chunk import RrdReader

    found = defaultdict(list)
    for chunk in RrdReader(str(path)).stream():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if not NOT_OURS.search(name) and chunk.entity_path != "/__properties":
                found[f"{chunk.entity_path} {name}"] += leaves(batch.column(name))
    return dict(sorted(found.items()))


def leaves(array):
    """What is at the ends of lists and records."""
    kind = array.type
    if types.is_struct(kind):
        return [leaf for part in array.flatten() for leaf in leaves(part)]
    if types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
        return leaves(array.flatten())
    if types.is_duration(kind) or types.is_timestamp(kind):
        array = array.cast("int64")
    plain = types.is_integer(array.type) or types.is_floating(array.type)
    return [array.to_numpy(zero_copy_only=False) if plain else array.to_pylist()]


def columns_of(chunk):
    """What is in the columns of a chunk, but for its own numbers."""
    batch = chunk.to_record_batch()
    return [colors_apart(leaves(batch.column(name))) for name in batch.schema.names if not NOT_OURS.search(name)]


def colors_apart(parts):
    """Parts of columns, colours as four numbers: of one number the last channel would hardly count."""
    return [one.view(np.uint8) if getattr(one, "dtype", None) == np.uint32 else one for one in parts]


def colors_of(columns):
    """The colours in the columns of a recording, but for those of meshes, which are many."""
    named = {name: one for name, one in columns.items() if "olor" in name and "vertex" not in name}
    return {name: colors_apart(parts) for name, parts in named.items()}


def check_recording(name, world, folder, seconds=1.5, without=re.compile("$^")):
    sim = vrx_mj.Simulation(world, seed=3)
    path = folder / f"{name.replace('/', '_')}.rrd"
    with vrx_mj.record(sim, path):
        for part in range(3):
            given = {boat: dict.fromkeys(sim.command_names(boat), 0.3 + 0.2 * part) for boat in sim.boats}
            sim.command_all(given)
            sim.advance(round(seconds / 3 / sim.timestep))
        sim.event("done", "WARN")
    columns = {name: values for name, values in numbers_of(path).items() if not without.match(name)}
    check("recordings", name, **by_root(columns))
    record = vrx_mj.read_record(path)
    check("recordings", f"{name}: read", boats=record.boats, objects=record.objects, wind=[record.wind, record.time])


def by_root(columns):
    """The columns by the first part of their entity's path."""
    found = defaultdict(dict)
    for name, values in columns.items():
        found["/".join(name.split("/")[1:3]).partition(" ")[0]][name] = values
    return found


@pytest.mark.parametrize("name", EVERYDAY)
def test_a_recording_holds_what_it_held(name, tmp_path):
    check_recording(name, compiled(name, fleet=EVERYDAY[name]), tmp_path)


def test_so_does_one_of_a_boat_in_wind_waves_and_tide(tmp_path):
    check_recording(
        "windy", compiled(WINDY, fleet={"boats": [{"robot": "wamv", "pose": [1, 2, 0, 0, 0, 0.4]}]}), tmp_path,
        without=PROCESSORS,
    )  # fmt: skip


@pytest.mark.parametrize("boats", [1, 3, 9])
def test_so_do_made_up_ones(boats, tmp_path):
    """Of boats in circles on one wave."""
    check(
        "recordings",
        f"made up, {boats}",
        **by_root(numbers_of(recorded_run.record_run(tmp_path / "a.rrd", 3.0, boats))),
    )


def test_so_do_ones_of_joints_and_boats_that_come_and_go_closed_or_killed(tmp_path, monkeypatch):
    monkeypatch.setattr("vrx_mj.recording.parts.FLUSH", 0.0)
    monkeypatch.setattr("vrx_mj.runtime.running_world._DRAIN_PERIOD", math.inf)
    things = {"raft": (RAFT, (0, 0, 0, 0, 0, 0)), "arm": (PENDULUM, (6, 0, 0, 0, 0.3, 0))}
    sim, path, killed = simulation_of(tmp_path, sea=WINDY["sea"], **things), tmp_path / "run.rrd", tmp_path / "cut.rrd"
    with vrx_mj.record(sim, path) as writer:
        sim.advance(40)
        sim.spawn("late", pose=(20, -30, 0, 0, 0, 1.0), sensors="none")
        sim.advance(40)
        sim.remove("late")
        sim.spawn("later", pose=(-20, -30, 0, 0, 0, 2.0), sensors="none")
        sim.spawn("late", pose=(20, -30, 0, 0, 0, 1.0), sensors="none")
        sim.advance(40)
        shutil.copy(writer.path, killed)
    shown = tmp_path / "shown"
    shown.mkdir()
    for name, file in (("joints", path), ("killed", viewable(read_record(killed), None, shown))):
        check("recordings", name, **by_root(numbers_of(file)), views=views_of(file))
    (tmp_path / "followed").mkdir()
    check("recordings", "followed", views=views_of(viewable(read_record(path), "later", tmp_path / "followed")))


def views_of(path):
    """Fractions in the views of a recording, by column, smallest rows first: views have numbers at random."""
    from rerun.chunk import RrdReader

    reader, found = RrdReader(str(path)), defaultdict(list)
    for chunk in reader.stream(store=reader.blueprints()[0]):
        batch = chunk.to_record_batch()
        for name in (name for name in batch.schema.names if not NOT_OURS.search(name)):
            arrays = [
                one for one in leaves(batch.column(name)) if isinstance(one, np.ndarray) and one.dtype.kind == "f"
            ]
            found[name] += [one.tolist() for one in arrays if one.size]
    return {name: sorted(rows) for name, rows in sorted(found.items())}


@pytest.mark.slow
@pytest.mark.nightly
def test_so_do_those_of_other_worlds(tmp_path):
    for name, fleet in BY_NIGHT.items():
        check_recording(name, compiled(name, fleet=fleet), tmp_path)
