"""Worlds of Gazebo that are not as their specification has them: what Gazebo takes is taken, and a fault is named."""

from pathlib import Path

import pytest

import vrx_mj
from vrx_mj.config.world import WorldConfig
from vrx_mj.errors import ConfigError
from vrx_mj.formats.gazebo.document import STRICT
from vrx_mj.formats.gazebo.worlds import gazebo_world


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch, strict):
    monkeypatch.chdir(tmp_path)


def said(body):
    """What a world of these elements is."""
    Path("bay.world").write_text(f'<sdf version="1.6"><world name="bay">{body}</world></sdf>', encoding="utf-8")
    return gazebo_world(Path("bay.world"))


KEPT = '<model name="m"><link name="l"><inertial><mass>10</mass>{}</inertial>{}</link>{}</model>'
SHAPE = '<collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision>'
HIGH = "<waypoints><waypoint>1 2 3</waypoint><waypoint>4 5 0</waypoint></waypoints>"
HIGH = f'<plugin name="f" filename="gz-sim-trajectory-follower-system">{HIGH}</plugin>'


@pytest.mark.parametrize(
    ("body", "key", "value"),
    [
        (KEPT.format("", SHAPE, HIGH), "objects", "m"),
        ("<spherical_coordinates/>", "georeference", 0.0),
        ("<gravity>1e-6 0 -9.5</gravity>", "physics", 9.5),
    ],
)
def test_what_gazebo_takes_is_taken(body, key, value):
    """A waypoint in the air, coordinates by default, gravity not quite down."""
    found = said(body).section[key]
    assert value in ([one["name"] for one in found] if key == "objects" else found.values())


@pytest.mark.parametrize(
    ("files", "line"),
    [
        ({"x/model.sdf": '<sdf><light name="a"/></sdf>'}, "<sdf>: expected <sdf> with a <model>, got <light>"),
        ({"x/model.sdf": '<sdf><actor name="a"/></sdf>'}, "<sdf>: expected <sdf> with a <model>, got <actor>"),
        ({"x/model.config": "<model><sdf>model.sdf</sdf></model>"}, "<sdf>: no file 'model.sdf' in this folder"),
        (
            {"x/model.config": "<model/>"},
            "x/model.sdf: cannot be read: No such file or directory",
        ),
    ],
)
def test_an_include_of_what_is_no_model_names_its_file(files, line):
    for name, text in files.items():
        Path(name).parent.mkdir()
        Path(name).write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        said("<include><uri>model://x</uri></include>")
    assert line in str(caught.value)


WIND = '<plugin filename="libusv_gazebo_wind_plugin.so"><wind_mean_velocity>{}</wind_mean_velocity></plugin>'
POINT = "<waypoints><waypoint><pose>{} 150 0</pose></waypoint></waypoints>"
TASK = f'<plugin filename="libwayfinding_scoring_plugin.so">{POINT}</plugin>'
KINDS = {
    "task": (TASK.format("x"), TASK.format(-33)),
    "wind": (WIND.format(-3), WIND.format(5)),
    "physics": ("<gravity>0 0 x</gravity>", "<gravity>0 0 -9</gravity>"),
}
"""Parts of a world of which one counts, by our key: one that cannot be read, and one that can."""


@pytest.fixture
def tolerant():
    """Parts that cannot be read are notes."""
    token = STRICT.set(False)
    yield
    STRICT.reset(token)


@pytest.mark.parametrize("key", KINDS)
@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_any_number_of_broken_parts_is_told_and_the_rest_is_read(key, tolerant):
    broken, _ = KINDS[key]
    found = said(broken * 300 + KEPT.format("", SHAPE, ""))
    assert [note.fate for note in found.notes].count("not read") == 300
    assert [one["name"] for one in found.section["objects"]] == ["m"]


@pytest.mark.parametrize("key", KINDS)
@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_the_one_that_can_be_read_counts(key, tolerant):
    """Of tasks and elements the first, of winds the last."""
    broken, good = KINDS[key]
    found = said(f"<spherical_coordinates/>{broken}{broken}{good}{broken}")
    assert key in found.section
    assert [note.fate for note in found.notes].count("not read") == (1 if key == "wind" else 2)


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_a_world_is_validated_once(tolerant, monkeypatch):
    seen, faults = [], WorldConfig._faults
    monkeypatch.setattr(WorldConfig, "_faults", lambda world: seen.append(world.name) or faults(world))
    said(KEPT.format("", SHAPE, ""))
    seen.clear()
    vrx_mj.compile_world("bay.world", fleet="none")
    assert seen == ["bay"]
