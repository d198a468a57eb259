"""The catalogue of parts against VRX's macros, the sets of rules and the start files."""

import re

import pytest

from vrx_mj.formats.parts.compliance import judge, load_rules, rule_sets
from vrx_mj.formats.parts.read import catalogue, load_parts, part_types
from vrx_mj.packages import root

TYPES = part_types()
START = root() / "assets" / "start"
POSE = {"R": 0.0, "P": 0.0, "Y": 0.0}
DEFAULTS = {
    "wamv_camera": {
        "name": None, "x": 0.5, "y": 0.0, "z": 1.5, **POSE, "post_Y": 0.0, "visualize": False, "post_z_from": 1.2965,
    },
    "wamv_gps": {"name": "gps", "x": 0.3, "y": 0.0, "z": 1.3, **POSE, "update_rate": 15.0},
    "wamv_imu": {"name": "imu", "x": 0.3, "y": 0.5, "z": 1.3, **POSE, "update_rate": 15.0},
    "lidar": {
        "name": None, "type": "16_beam", "x": 0.7, "y": 0.0, "z": 1.8, **POSE, "post_Y": 0.0, "post_z_from": 1.2965,
    },
    "wamv_ball_shooter": {
        "name": "ball_shooter", "x": 0.55, "y": 0.35, "z": 1.4, "pitch": 0.0, "yaw": 0.0,
        "frameId": "wamv/ball_shooter",
    },
    "wamv_pinger": {
        "name": "pinger", "sensor_name": "receiver", "pinger_name": "pinger", "position": "0 0 0",
        "orientation": "0 0 0", "frameId": "wamv/pinger",
    },
    "wamv_p3d": {"name": "ground_truth_odometry"},
    "engine": {"prefix": None, "position": None, "orientation": "0 0 0"},
}  # fmt: skip
"""Of the macros of VRX classic; the pinger also has what jazzy's has."""


@pytest.mark.parametrize("name", DEFAULTS)
def test_parameters_and_defaults_are_those_of_vrx(name):
    assert {each.name: each.default for each in TYPES[name].parameters} == DEFAULTS[name]


def test_there_are_no_other_types():
    assert set(TYPES) == set(DEFAULTS)
    assert not set(catalogue().elsewhere) & set(TYPES)
    assert set(catalogue().misnamed.values()) | set(catalogue().fixed) <= set(TYPES)


@pytest.mark.parametrize("name", TYPES)
def test_units_are_those_of_the_form(name):
    for each in TYPES[name].parameters:
        assert each.unit in ({"m", "rad", "Hz"} if each.form in {"number", "triple"} else {""})
        assert each.meaning


@pytest.mark.parametrize("name", ["classic", "jazzy"])
def test_what_the_rules_permit_exists(name):
    rules = load_rules(name)
    for kind in ("components", "thrusters"):
        for part, limits in rules.of(kind).types.items():
            known = {each.name for each in TYPES[part].parameters if each.release in {None, rules.release}}
            assert TYPES[part].kind == kind
            assert set(limits.parameters) <= known


def test_every_set_of_rules_says_where_it_is_from():
    assert list(rule_sets()) == ["jazzy", "classic", "2019"]
    for file in rule_sets().values():
        assert "# Origin: osrf/vrx, " in file.read_text(encoding="utf-8")


FILES = ("component_config.yaml", "thruster_config.yaml")


def starts():
    return {name: (START / name).read_text(encoding="utf-8") for name in FILES}


def commented(parameter):
    """A default as the start file's comment has it."""
    if parameter.form == "number":
        return f"{parameter.default:g}"
    return f'"{parameter.default}"' if parameter.form == "triple" else str(parameter.default).lower()


def test_the_start_files_are_legal():
    files = (
        load_parts(START / "component_config.yaml", "components"),
        load_parts(START / "thruster_config.yaml", "thrusters"),
    )
    verdict = judge(*files)
    assert (verdict.compliant, verdict.reasons, verdict.generator.passes, verdict.generator.errors) == (
        True,
        (),
        True,
        False,
    )
    assert len(verdict.parts) == 10


@pytest.mark.parametrize("name", [name for name in TYPES if name not in {"engine", "wamv_p3d"}])
def test_the_start_file_s_comments_are_the_catalogue_s(name):
    text = starts()["component_config.yaml"]
    line = re.search(rf"^{name}: +# (.*)$", text, re.MULTILINE)[1]
    rules = load_rules("classic").components.types[name]
    assert f"at most {rules.most};" in line
    told = dict(re.findall(r"(\w+) (\"0 0 0\"|[\w.]+)(?=,|$)", line.split("default: ")[1].split(";")[0]))
    shown = [each for each in TYPES[name].parameters if each.name in rules.parameters and each.default is not None]
    expected = {each.name: commented(each) for each in shown}
    assert told == expected
    assert ("name is required" in line) == (TYPES[name].default("name") is None)


def test_the_start_file_names_what_is_not_permitted():
    text, rules = starts()["component_config.yaml"], load_rules("classic").components.types
    for name, limits in rules.items():
        odd = [
            each.name for each in TYPES[name].parameters if each.name not in limits.parameters and each.release is None
        ]
        assert all(each in text for each in odd)


def test_the_start_files_boxes_are_the_rules():
    components, thrusters = starts().values()
    for text, rules in ((components, load_rules("classic").components), (thrusters, load_rules("classic").thrusters)):
        for box in rules.boxes:
            for low, high in zip(box.low, box.high, strict=True):
                assert f"{low:g} to {high:g}" in text
