"""Rows of boat sets in the columns of all of them."""

import tempfile

import numpy as np
import pytest

from vrx_mj.errors import StateError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.recording.boat_sets import BoatSet, all_rows, joint_layout
from vrx_mj.recording.packing import pack_rows
from vrx_mj.recording.parts import Part
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
