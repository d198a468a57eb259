"""Recordings in which boats come and go."""

import numpy as np
import pytest

import vrx_mj
from integration.sailing import AFLOAT, AHEAD, same_bits, simulation
from vrx_mj.recording.checks import rescore

ONE = {"name": "one", "pose": [0, 0, AFLOAT, 0, 0, 0.3]}
TWO = {"name": "two", "pose": [20, 0, AFLOAT, 0, 0, 0.3], "engines": "hinged"}
BUOY = {"name": "buoy", "model": "robotx_light_buoy", "pose": [30, 20, 0.5, 0, 0, 0]}
LATE = [0.0, 30.0, AFLOAT, 0.0, 0.0, 0.0]


def sail(path, *, changes=True):
    """Six seconds: `late` is there from 2 to 5 s; `two` leaves at 3 s, and comes back at 4 s as another."""
    sim = simulation({"boats": [ONE, TWO], "sensors": "none"}, objects=[BUOY], seed=3)
    plan = {
        2: lambda: sim.spawn("late", pose=LATE, sensors="none"),
        3: lambda: sim.remove("two"),
        4: lambda: sim.spawn("two", pose=TWO["pose"], robot="skiff", sensors="none"),
        5: lambda: sim.remove("late"),
    }
    states = {}
    with vrx_mj.record(sim, path, sea=False):
        for second in range(6):
            if changes and second in plan:
                plan[second]()
            states[second] = sim.get_state().sha256
            sim.step({"one": AHEAD}, duration=1.0)
    return states


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("boats")
    states = sail(folder / "changing.rrd")
    sail(folder / "again.rrd")
    sail(folder / "same.rrd", changes=False)
    return folder, states


def chunks(path, entity):
    """Of an entity's chunks: whether each is static, its times [s], its columns."""
    from rerun.chunk import RrdReader

    for chunk in RrdReader(path).stream().filter(content=entity):
        batch = chunk.to_record_batch()
        times = [] if chunk.is_static else [time.total_seconds() for time in batch.to_pydict()["sim_time"]]
        yield chunk.is_static, times, batch.schema.names


def test_a_boat_has_numbers_while_it_is_there(runs):
    record = vrx_mj.read_record(runs[0] / "changing.rrd")
    assert set(record.boats) == {"one", "two", "late"}
    assert len(record.companies) == 5
    there = {name: record.time[np.isfinite(track.position[:, 0])] for name, track in record.boats.items()}
    assert len(there["one"]) == len(record.time) == 121
    assert (there["late"].min(), there["late"].max()) == pytest.approx((2.0, 4.95))
    away = record.time[np.isnan(record.boats["two"].position[:, 0])]
    assert (away.min(), away.max()) == pytest.approx((3.0, 3.95))
    assert np.isnan(record.boats["late"].thrust["left"][record.time > 5.0]).all()
    assert set(record.boats["two"].thrust) == {"left", "lateral", "right", "propeller", "rudder"}  # a WAM-V, a skiff
    assert [event.text for event in record.events[1:]] == ["late joins", "two leaves", "two joins", "late leaves"]


def test_what_is_recorded_of_the_others_is_the_same(runs):
    changing, same = (vrx_mj.read_record(runs[0] / name) for name in ("changing.rrd", "same.rrd"))
    assert same_bits(changing.time, same.time)
    assert same_bits(changing.wind, same.wind)
    for one, other in ((changing.boats["one"], same.boats["one"]), (changing.objects["buoy"], same.objects["buoy"])):
        for field in ("position", "quaternion", "velocity", "angular_velocity"):
            assert same_bits(getattr(one, field), getattr(other, field))
    assert same_bits(changing.boats["one"].thrust["left"], same.boats["one"].thrust["left"])


def test_equal_runs_are_equal_and_others_part(runs):
    folder = runs[0]
    assert vrx_mj.compare(folder / "changing.rrd", folder / "again.rrd").equal
    assert not vrx_mj.compare(folder / "changing.rrd", folder / "same.rrd").equal


@pytest.mark.parametrize(
    ("second", "boats"),
    [(1, ("one", "two")), (2, ("one", "two", "late")), (3, ("one", "late")), (4, ("one", "late", "two"))],
)
def test_a_run_goes_on_with_the_boats_of_any_second(runs, second, boats):
    resumed = vrx_mj.resume(runs[0] / "changing.rrd", second + 0.5)
    assert resumed.boats == boats
    assert resumed.get_state().sha256 == runs[1][second]


def test_the_viewer_gets_looks_when_a_boat_joins_and_a_clear_when_it_leaves(runs):
    path = runs[0] / "changing.rrd"
    shapes = {name: list(chunks(path, f"/world/boats/{name}/shape")) for name in ("one", "two", "late")}
    assert {name: [times for _, times, _ in found] for name, found in shapes.items()} == {
        "one": [[0.0]],
        "two": [[0.0], [4.0]],
        "late": [[2.0]],
    }
    ends = {
        name: [times for _, times, names in chunks(path, f"/world/boats/{name}") if "Clear:is_recursive" in names]
        for name in shapes
    }
    assert ends == {"one": [], "two": [[3.0]], "late": [[5.0]]}
    poses = [times for _, times, names in chunks(path, "/world/boats/late") if "Transform3D:translation" in names]
    assert min(time for times in poses for time in times) == pytest.approx(2.0)


def test_a_plot_has_as_many_series_at_all_times(runs):
    from rerun.chunk import RrdReader

    path = runs[0] / "changing.rrd"
    widths = {}
    for chunk in RrdReader(path).stream().filter(content="/plots/**", components="Scalars:scalars"):
        rows = chunk.to_record_batch().to_pydict().get("Scalars:scalars", [])
        widths.setdefault(chunk.entity_path, set()).update(len(row) for row in rows if row is not None)
    assert widths["/plots/speed"] == {2}
    assert widths["/plots/speed/late"] == {1}
    assert "/plots/speed/two" not in widths
    assert widths["/plots/thrust/two"] == {2}  # the skiff's propeller and rudder: the WAM-V before it had neither
    assert all(len(found) == 1 for found in widths.values())


def test_the_score_of_a_run_with_a_newcomer_is_read_back(tmp_path):
    sim = vrx_mj.Simulation(vrx_mj.compile_world("stationkeeping_task"), seed=2)
    with vrx_mj.record(sim, tmp_path / "run.rrd", sea=False):
        sim.step(duration=11.0)
        x, y, _ = sim.observe()["wamv"].position
        sim.spawn("late", pose=[x + 7.0, y, AFLOAT, 0, 0, np.pi], sensors="none")
        sim.set_boat("late", velocity=(4.0, 0, 0, 0, 0, 0))
        sim.step(duration=4.0)
        sim.remove("late")
        sim.step(duration=1.0)
        told = sim.task
    status = rescore(tmp_path / "run.rrd")[0].status
    assert (status.score, status.collisions) == (told["score"], told["num_collisions"])
    assert status.collisions > 0


@pytest.mark.slow
def test_objects_and_docks_appear_and_disappear(tmp_path):
    """A light, a floating dock with a placard and a fixed object are there from 1 to 2 s."""
    path, guests = tmp_path / "run.rrd", ("lamp", "pier", "post")
    sim = simulation({"boats": [ONE], "sensors": "none"}, objects=[BUOY], seed=3)
    with vrx_mj.record(sim, path, sea=False):
        sim.step({"one": AHEAD}, duration=1.0)
        sim.spawn_object("lamp", model="robotx_light_buoy", pose=[60, 0, 0.3, 0, 0, 0])
        sim.spawn_object("post", model="post", pose=[60, 20, 0, 0, 0, 0])
        sim.spawn_dock(
            "pier", layout="X X\nXXX", dynamic=True, bays=[{"symbol": "red_cross"}], pose=[60, 40, 0, 0, 0, 0]
        )
        sim.set_light("lamp", ("red", "green", "blue"))
        there = sim.get_state().sha256
        sim.step({"one": AHEAD}, duration=1.0)
        for name in guests:
            sim.remove(name)
        sim.step({"one": AHEAD}, duration=1.0)
    record = vrx_mj.read_record(path, whole=True)
    lamp = record.time[np.isfinite(record.objects["lamp"].position[:, 0])]
    assert (lamp.min(), lamp.max()) == pytest.approx((1.0, 1.95))
    assert np.isfinite(record.objects["buoy"].position).all()
    assert len(record.companies) == 7
    assert [len(one.world.parameters.lights) for one in record.companies] == [1, 2, 2, 2, 1, 1, 1]
    for entity in ("objects/lamp", "docks/pier", "objects/post"):
        shapes = [times for _, times, _ in chunks(path, f"/world/{entity}/shape")]
        ends = [times for _, times, names in chunks(path, f"/world/{entity}") if "Clear:is_recursive" in names]
        assert (shapes, ends) == ([[1.0]], [[2.0]]), entity
    resumed = vrx_mj.resume(path, 1.5)
    assert {*guests} <= {name.partition("/")[0] for name in (*names_of(resumed), *resumed.lights)}
    assert resumed.get_state().sha256 != there  # a light was set after the last of them joined
    resumed.step(duration=0.1)
    assert vrx_mj.resume(path, 2.5).lights == ("buoy",)


def names_of(sim):
    there = sim.world.parameters
    return [*(item.name for item in there.objects), *(dock.name for dock in there.docks)]
