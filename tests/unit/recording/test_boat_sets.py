"""Rows of boat sets in the columns of all of them."""

import dataclasses
import json
import tempfile

import numpy as np
import pytest

from vrx_mj.errors import RecordError, StateError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.recording.boat_sets import BoatSet, all_rows, joint_layout, read_boat_sets
from vrx_mj.recording.packing import pack_rows
from vrx_mj.recording.parts import Part, pack_files
from vrx_mj.recording.record_scene import MovingBody, RowLayout

FIRST = RowLayout(
    nq=15,  # a, its engine on a hinge, b
    nv=13,
    thrusters=(("a", "left"),),
    bodies=(MovingBody("a", "boat", 0, 0), MovingBody("b", "boat", 8, 7)),
    display_marks=1,
)
SECOND = RowLayout(
    nq=14,  # b, c
    nv=12,
    thrusters=(("c", "left"),),
    bodies=(MovingBody("b", "boat", 0, 0), MovingBody("c", "boat", 7, 6)),
    display_marks=1,
)


MOST = 1 << 20


def part(rows, boat_set=0):
    return Part("/record/rows", static=False, columns={"block": [pack_rows(rows)], "company": [np.array([boat_set])]})


def numbered(layout, start):
    """Two rows in which every number is another."""
    rows = start + np.arange(2.0 * layout.width).reshape(2, -1)
    rows[:, 0] = start, start + 1.0
    return rows


def test_one_boat_set_has_its_own_columns():
    rows = numbered(FIRST, 0.0)
    assert joint_layout([FIRST]) == FIRST
    assert np.array_equal(all_rows([part(rows)], [FIRST], MOST)[0], rows)


def test_who_joins_later_comes_last():
    joint = joint_layout([FIRST, SECOND])
    assert (joint.nq, joint.nv) == (22, 19)
    assert joint.thrusters == (("a", "left"), ("c", "left"))
    assert joint.bodies == (*FIRST.bodies, MovingBody("c", "boat", 15, 13))


def test_numbers_stay_those_of_their_body():
    joint = joint_layout([FIRST, SECOND])
    blocks = {FIRST: numbered(FIRST, 0.0), SECOND: numbered(SECOND, 1000.0)}
    wide, numbers = all_rows([part(blocks[SECOND], 1), part(blocks[FIRST], 0)], [FIRST, SECOND], MOST)
    assert numbers.tolist() == [0, 0, 1, 1]
    assert wide[:, 0].tolist() == [0.0, 1.0, 1000.0, 1001.0]
    for layout, lines in ((FIRST, wide[:2]), (SECOND, wide[2:])):
        rows = blocks[layout]
        own = {body.name: body for body in layout.bodies}
        for body in joint.bodies:
            found = np.hstack([lines[:, joint.pose(body)], lines[:, joint.velocity(body)]])
            if body.name in own:
                there = [rows[:, layout.pose(own[body.name])], rows[:, layout.velocity(own[body.name])]]
                assert np.array_equal(found, np.hstack(there))
            else:
                assert np.isnan(found).all()
        assert np.array_equal(lines[:, joint.marks], rows[:, layout.marks])
        for thruster in joint.thrusters:
            column = lines[:, joint.thrust.start + joint.thrusters.index(thruster)]
            assert np.isnan(column).all() == (thruster not in layout.thrusters)
        assert np.count_nonzero(np.isfinite(lines)) == rows.size


@pytest.mark.parametrize("layouts", [[FIRST], [FIRST, SECOND]])
def test_nothing_recorded_has_no_rows(layouts):
    assert all_rows([], layouts, MOST)[0].shape == (0, joint_layout(layouts).width)


# Worlds in recordings: what comes from somebody else is read, and never written to disk


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A saved world, by relative path."""
    folder = tmp_path_factory.mktemp("saved")
    compile_world("ocean").save(folder)
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def boat_set(files):
    """Boats whose world's archive has these files."""
    return BoatSet(RowLayout(nq=0, nv=0, thrusters=(), bodies=()), "", files)


def test_names_in_a_recording_are_no_paths_on_disk(saved, tmp_path, monkeypatch):
    home = tmp_path / "a" / "b"
    home.mkdir(parents=True)
    monkeypatch.setattr(tempfile, "tempdir", str(home))
    outside = {"../../evil": b"1", str(tmp_path / "worse"): b"2"}
    assets = boat_set(saved | outside).world.assets
    assert {f"assets/{name}" for name in assets} == {name for name in saved if name.startswith("assets/")}
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize("name", ["../hull.obj", "/etc/passwd", "..\\hull.obj", "C:hull.obj", ".."])
def test_an_asset_with_a_folder_in_its_name_is_refused(saved, name):
    mjcf = saved["scene.xml"].replace(b"<asset>", b'<asset><mesh name="hull" file="%s"/>' % name.encode(), 1)
    with pytest.raises(StateError) as refused:
        boat_set({**saved, "scene.xml": mjcf, f"assets/{name}": b"v 0 0 0"}).world  # noqa: B018
    assert str(refused.value) == f"the recording's scene.xml is damaged: invalid file '{name}' of <mesh>"


def test_a_recording_that_lacks_a_file_of_its_world_is_refused(saved):
    name = next(name for name in saved if name.startswith("assets/"))
    with pytest.raises(StateError) as refused:
        boat_set({other: content for other, content in saved.items() if other != name}).world  # noqa: B018
    assert str(refused.value) == f"no saved world in the recording: '{name}'"


# Damage


def refusal(function, *arguments):
    with pytest.raises(RecordError) as refused:
        function(*arguments)
    return str(refused.value)


def test_rows_of_no_boat_set_or_of_another_width_or_time_are_refused():
    late, early, last = (numbered(FIRST, 0.0) for _ in range(3))
    late[1, 0], early[0, 0], last[1, 0] = np.nextafter(1e9, 2e9), -1e-9, 1e9
    outside = "/record/rows: block: a time from 0 to 1e+09 s is needed"
    for rows, number, reason in (
        (numbered(FIRST, 0.0), 1, "/record/rows: company: 1, of 1"),
        (numbered(FIRST, 0.0), -1, "/record/rows: company: -1, of 1"),
        (numbered(SECOND, 0.0), 0, f"/record/rows: block: rows of {SECOND.width} columns instead of {FIRST.width}"),
        (late, 0, outside),
        (early, 0, outside),
    ):
        assert refusal(all_rows, [part(rows, number)], [FIRST], MOST) == reason
    assert all_rows([part(last)], [FIRST], MOST)[0][-1, 0] == 1e9


def test_rows_take_no_more_memory_than_they_may_with_the_columns_of_all():
    width, rows = joint_layout([FIRST, SECOND]).width, numbered(FIRST, 0.0)
    needed = 8 * (2 * width + FIRST.width + SECOND.width)
    assert len(all_rows([part(rows)], [FIRST, SECOND], needed)[0]) == 2
    reason = refusal(all_rows, [part(rows)], [FIRST, SECOND], needed - 1)
    assert reason == "/record/rows: 0 MiB with the columns of all boat sets: at most 0"
    long = np.tile(rows, (5000, 1))
    reason = f"block: {long.nbytes >> 20} MiB of rows: at most {long.nbytes - 1 >> 20}"
    assert refusal(all_rows, [part(long)], [FIRST], long.nbytes - 1) == reason


def test_later_boat_sets_are_numbered_and_have_the_files_that_they_name():
    first = BoatSet(FIRST, "", {"scene.xml": b"<mujoco/>"})

    def read(number, files, *names):
        head = {"number": number, "layout": to_json(SECOND), "world_sha256": "", "files": [*names]}
        columns = {"head": [json.dumps(head)], "files": [pack_files(files)]}
        return read_boat_sets(first, [Part("/record/companies", False, columns)], MOST)

    assert read(1, {"b": b"2"}, "b", "scene.xml")[1].files == {"b": b"2", "scene.xml": b"<mujoco/>"}
    assert refusal(read, 2, {}) == "companies: number 2 instead of 1"
    assert refusal(read, 1, {"b": b"2"}, "b", "c", "d") == "companies: files: 2 are missing"


def to_json(layout):
    return json.loads(json.dumps(dataclasses.asdict(layout)))
