"""Models of Gazebo with joints in whole runs: where their links are, and the same opened and imported."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import vrx_mj
from vrx_mj.cli.files import import_
from vrx_mj.frames import rotation

pytestmark = pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
BOX = "<geometry><box><size>1 1 0.4</size></box></geometry>"
INERTIA = "<inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia>"
HINGES = {"revolute": "axis", "prismatic": "axis", "universal": "axis2"}

numbers = st.floats(-1.5, 1.5).map(lambda value: round(value, 3))
poses = st.tuples(*[numbers] * 6)
directions = st.tuples(*[st.floats(-1.0, 1.0).map(lambda value: round(value, 2))] * 3).filter(
    lambda axis: math.hypot(*axis) > 0.2
)


def words(values):
    return " ".join(map(repr, values))


def link(name, pose):
    inertial = f"<inertial><mass>50</mass>{INERTIA}</inertial>"
    shapes = f'<collision name="c">{BOX}</collision><visual name="v">{BOX}</visual>'
    return f'<link name="{name}"><pose>{words(pose)}</pose>{inertial}{shapes}</link>'


def joint(name, kind, parent, child, pose, axes):
    tags = "".join(f"<axis{n}><xyz>{words(xyz)}</xyz></axis{n}>" for n, xyz in zip(("", "2"), axes, strict=False))
    ends = f"<parent>{parent}</parent><child>{child}</child><pose>{words(pose)}</pose>"
    return f'<joint name="{name}" type="{kind}">{ends}{tags}</joint>'


def matrix(pose):
    """A pose as a 4 x 4 matrix."""
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = rotation(*pose[3:]), pose[:3]
    return found


def moved(kind, axes, values):
    """The motion of a joint in its own frame (Rodrigues' formula)."""
    found = np.eye(4)
    for axis, value in zip(axes, values, strict=True):
        x, y, z = np.array(axis) / np.linalg.norm(axis)
        step, cross = np.eye(4), np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        if kind == "prismatic":
            step[:3, 3] = np.array([x, y, z]) * value
        else:
            step[:3, :3] = np.eye(3) + math.sin(value) * cross + (1 - math.cos(value)) * cross @ cross
        found = found @ step
    return found


def simulation_of(text, tmp_path, name="model.sdf"):
    (tmp_path / name).write_text(text, encoding="utf-8")
    items = [{"name": "m", "model": f"./{name}", "pose": [3.0, 1.0, 0.5, 0.1, 0.2, 0.3]}]
    world = vrx_mj.compile_world({"sea": {"model": "none"}, "objects": items}, fleet={"boats": []})
    sim = vrx_mj.Simulation(world)
    sim.reset(seed=1)
    return sim


@pytest.mark.slow
@settings(max_examples=12)
@given(
    kinds=st.tuples(st.sampled_from(sorted(HINGES)), st.sampled_from(sorted(HINGES))),
    places=st.tuples(poses, poses, poses, poses),
    axes=st.tuples(*[directions] * 4),
    values=st.tuples(*[st.floats(-1.0, 1.0)] * 4),
    turned=st.booleans(),
)
def test_links_are_where_the_joints_of_the_file_put_them(kinds, places, axes, values, turned, folders):
    """The second implementation: 4 x 4 matrices by the file's own numbers. A joint may be given the other way round."""
    folder = folders()
    first, second = kinds
    for kind, pair in ((first, axes[:2]), (second, axes[2:])):
        assume(
            kind != "universal" or np.linalg.norm(np.cross(*pair)) > 0.2 * math.hypot(*pair[0]) * math.hypot(*pair[1])
        )
    ends = ("hand", "arm") if turned else ("arm", "hand")
    links = {"base": (0.0,) * 6, "arm": places[0], "hand": places[1]}
    own = (axes[:2] if first == "universal" else axes[:1], axes[2:] if second == "universal" else axes[2:3])
    body = "".join(link(name, pose) for name, pose in links.items())
    body += joint("inner", first, "base", "arm", places[2], own[0])
    body += joint("outer", second, *ends, places[3], own[1])
    sim = simulation_of(f'<sdf version="1.6"><model name="m">{body}</model></sdf>', folder)
    given_at = {"inner": values[:2][: len(own[0])], "outer": values[2:][: len(own[1])]}
    for name, positions in given_at.items():
        order = positions if not (turned and name == "outer") else positions[::-1]
        for suffix, value in zip(("axis", "axis2"), order, strict=False):
            sim.data.qpos[sim.model.joint(f"m/{name}/{suffix}").qposadr[0]] = value
    sim.set_object("m", pose=(3.0, 1.0, 0.5, 0.1, 0.2, 0.3))
    zero = {name: matrix(pose) for name, pose in links.items()}
    arm = zero["arm"] @ matrix(places[2]) @ moved(first, own[0], given_at["inner"])
    arm = arm @ np.linalg.inv(zero["arm"] @ matrix(places[2])) @ zero["arm"]
    carried = zero[ends[1]] @ matrix(places[3])  # the joint, in the model
    relative = carried @ moved(second, own[1], given_at["outer"]) @ np.linalg.inv(carried)
    if turned:
        relative = np.linalg.inv(relative)
    hand = arm @ np.linalg.inv(zero["arm"]) @ relative @ zero["hand"]
    whole = matrix((3.0, 1.0, 0.5, 0.1, 0.2, 0.3))
    for name, expected in (("arm", whole @ arm), ("hand", whole @ hand)):
        found = sim.data.body(f"m/{name}")
        assert found.xpos == pytest.approx(expected[:3, 3], abs=1e-9)
        assert found.xmat.reshape(3, 3) == pytest.approx(expected[:3, :3], abs=1e-9)


CATAMARAN = "".join(
    (
        '<sdf version="1.6"><model name="catamaran">',
        link("deck", (0.0, 0.0, 0.2, 0.0, 0.0, 0.0)),
        link("port", (0.0, 1.5, 0.0, 0.0, 0.0, 0.0)),
        link("starboard", (0.0, -1.5, 0.0, 0.0, 0.0, 0.0)),
        link("mast", (0.0, 0.0, 1.5, 0.0, 0.0, 0.0)),
        joint("p", "revolute", "deck", "port", (0.0, -0.75, 0.0, 0.0, 0.0, 0.0), [(1.0, 0.0, 0.0)]),
        joint("s", "revolute", "deck", "starboard", (0.0, 0.75, 0.0, 0.0, 0.0, 0.0), [(1.0, 0.0, 0.0)]),
        joint("m", "fixed", "deck", "mast", (0.0,) * 6, []),
        "</model></sdf>",
    )
)
WORLD = """<sdf version="1.6"><world name="bay"><include><uri>model://ocean_waves</uri></include>
<include><uri>model://catamaran</uri><name>cat</name><pose>5 0 0 0 0 0.4</pose></include></world></sdf>"""


@pytest.fixture
def bay(tmp_path, monkeypatch):
    """A world that includes a model with joints, in the current folder."""
    (tmp_path / "catamaran").mkdir()
    (tmp_path / "catamaran/model.sdf").write_text(CATAMARAN, encoding="utf-8")
    (tmp_path / "bay.world").write_text(WORLD, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "bay.world"


def final(world):
    """The state of a world after 10 s."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet="none"))
    sim.reset(seed=2)
    sim.step(duration=10.0)
    return sim


def test_what_is_imported_moves_as_what_is_opened(bay):
    opened = final(bay)
    import_(bay, Path("out"), None)
    imported = final(next(Path("out").glob("*.yaml")))
    body = [opened.model.body(index).name for index in range(opened.model.nbody)]
    assert [name for name in body if name.startswith("cat/")] == ["cat/deck", "cat/port", "cat/starboard"]
    assert np.array_equal(opened.data.qpos, imported.data.qpos)
    assert (
        abs(opened.data.qpos[opened.model.joint("cat/p/axis").qposadr[0]]) > 0.01
    )  # its floats have drafts of their own


def test_links_of_a_model_reach_the_table_of_an_import(bay):
    import_(bay, Path("out"), None)
    (page,) = Path("out").glob("*.md")
    assert "| &lt;joint&gt; 'p' | imported | `joints` |" in page.read_text("utf-8")


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Goes to a new empty folder, and returns it."""
    with pytest.MonkeyPatch.context() as patch:

        def entered():
            folder = tmp_path_factory.mktemp("model")
            patch.chdir(folder)
            return folder

        yield entered
