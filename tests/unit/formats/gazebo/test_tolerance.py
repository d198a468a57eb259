"""Worlds of Gazebo that are not as their specification has them: what Gazebo takes is taken, and a fault is named."""

from pathlib import Path

import pytest

from vrx_mj.errors import ConfigError
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
