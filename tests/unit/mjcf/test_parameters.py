"""Numbers of a compiled world by name: listed with unit and meaning, set with what files would set, and saved."""

import math
import shutil
from fractions import Fraction

import numpy as np
import pytest

import vrx_mj
from vrx_mj import Simulation, World, compile_world, parameters
from vrx_mj.errors import CommandError, UnknownNameError
from vrx_mj.model.numbers import with_numbers
from vrx_mj.resources import root
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.views import ARRAYS

ROBOTS = sorted(path.parent.name for path in (root() / "assets" / "robots").glob("*/robot.yaml"))
TIDE = {"speed": 0.3, "direction": 20, "var_gain": 0.1, "tide": {"speed": 0.5, "minor": 0.1, "direction": 10},
        "profile": [[0, 1.0], [5, 0.5]]}  # fmt: skip
MARINE = {"extends": "ocean", "physics": {"profile": "marine"}, "current": TIDE,
          "sea": {"model": "jonswap", "significant_height": 0.3, "peak_period": 4, "components": 5},
          "wind": {"mean_velocity": 4, "direction": 60, "spectrum": "npd", "components": 4}}  # fmt: skip
VRX = {"extends": "ocean", "wind": {"mean_velocity": 4, "direction": 60}}
DOCK = {**VRX, "docks": [{"name": "dock", "pose": [60, 0, 0, 0, 0, 0], "layout": "XX", "dynamic": True}]}


def world_with(robot, base=VRX, **how):
    return compile_world(base, fleet={"usv_count": 1, "robot": robot}, **how)


@pytest.fixture(scope="module")
def worlds():
    return {
        **{f"vrx {robot}": world_with(robot) for robot in ("wamv", "skiff")},
        **{f"marine {robot}": world_with(robot, MARINE) for robot in ("wamv", "skiff", "otter")},
        "dock": compile_world(DOCK),
    }


@pytest.mark.parametrize("base", [VRX, MARINE], ids=["vrx", "marine"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_every_number_of_every_robot_has_a_unit_and_a_meaning(robot, base):
    found = parameters(world_with(robot, base))
    assert f"{next(iter(found)).split('.')[0]}" in {"sea", "wind", "current"}
    assert any(".hull." in name for name in found)
    for name, number in found.items():
        assert number.name == name
        assert number.unit, name
        assert number.meaning.endswith("."), name
        assert math.isfinite(number.value), name


def arrays_of(world, own):
    """Contents of the loop's arrays of a world with the MuJoCo model of another one's."""
    arrays = LoopArrays(world, own.model, own.contact_free, own.data, known=own)
    return {name: getattr(arrays, name).tobytes() for name in ARRAYS if hasattr(arrays, name)}


def test_a_number_that_is_set_reaches_the_loop_and_is_listed_with_its_value(worlds):
    """All kinds of names: each changes some array of the loop, but for a battery's, which is not in the loop."""
    seen = set()
    for label, world in worlds.items():
        own = Simulation(world)._live.arrays
        before = arrays_of(world, own)
        for name, number in parameters(world).items():
            kind = tuple(0 if isinstance(step, int) else step for step in number.path[:-1])
            if number.path[0] == "boats" or (kind, name.rsplit(".", 1)[-1]) in seen:
                continue
            seen.add((kind, name.rsplit(".", 1)[-1]))
            value = number.value * 0.75 if number.value else 0.125
            changed = with_numbers(world.parameters, {name: value})
            again = World(world.pieces, changed)
            assert parameters(again)[name].value == pytest.approx(value, rel=1e-15), name
            assert arrays_of(again, own) != before, f"{label}: {name}"


@pytest.mark.parametrize(
    ("given", "key", "value"),
    [
        ({"wind.mean": 6.5}, "mean_velocity", 6.5),
        ({"wind.direction": math.radians(100)}, "direction", 100),
        ({"wind.gain": 1.5}, "var_gain", 1.5),
        ({"wind.time_constant": 3.0}, "var_time", 3.0),
    ],
)
def test_a_number_of_the_wind_does_what_the_world_s_file_does(given, key, value):
    gusty = {**VRX, "wind": {**VRX["wind"], "var_gain": 2.0}}
    changed = {**gusty, "wind": {**gusty["wind"], key: value}}
    assert run(compile_world(gusty, parameters=given)) == run(compile_world(changed))


@pytest.mark.parametrize(
    ("name", "value", "old", "new"),
    [
        ("hull.drag_linear.surge", 30.0, "drag_linear: [12,", "drag_linear: [30,"),
        ("hull.drag_quadratic.sway", 300.0, "[18, 220,", "[18, 300,"),
        ("hull.added_mass.yaw", 9.0, "9, 6]", "9, 9]"),
        ("hull.wind.y", 0.8, "[0.12, 0.4,", "[0.12, 0.8,"),
        ("thrusters.propeller.max_forward", 80.0, "max_force_forward: 120", "max_force_forward: 80"),
        ("thrusters.propeller.max_reverse", -20.0, "max_force_reverse: -60", "max_force_reverse: -20"),
        ("thrusters.rudder.area", 0.02, "area: 0.012", "area: 0.02"),
        ("thrusters.rudder.race_share", 0.3, "race_share: 0.8", "race_share: 0.3"),
    ],
)
def test_a_number_of_a_boat_does_what_the_robot_s_file_does(name, value, old, new, tmp_path):
    shutil.copytree(root() / "assets" / "robots" / "skiff", tmp_path / "skiff")
    file = tmp_path / "skiff" / "robot.yaml"
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1
    file.write_text(text.replace(old, new), encoding="utf-8")
    boat = world_with("skiff").boats[0]
    assert run(world_with("skiff", parameters={f"{boat}.{name}": value})) == run(world_with(str(file)))


def run(world):
    sim = Simulation(world)
    sim.reset(seed=3)
    names = [row.name for row in world.parameters.thrusters]
    commands = {"propeller": -0.6, "rudder_angle": 0.3} if "rudder" in names else dict.fromkeys(names, 0.6)
    sim.step({world.boats[0]: commands}, duration=0.5)
    sim.step({world.boats[0]: {name: abs(value) for name, value in commands.items()}}, duration=0.5)
    return sim.data.qpos.tobytes(), sim.data.qvel.tobytes()


def test_a_set_number_is_part_of_the_world(tmp_path):
    plain, changed = compile_world(VRX), compile_world(VRX, parameters={"wamv.hull.drag_linear.surge": 60.0})
    assert plain.sha256 != changed.sha256
    assert changed.sha256 == compile_world(VRX, parameters={"wamv.hull.drag_linear.surge": np.float32(60)}).sha256
    loaded = World.load(changed.save(tmp_path / "saved"))
    assert loaded.sha256 == changed.sha256
    assert parameters(loaded) == parameters(changed)
    assert parameters(loaded)["wamv.hull.drag_linear.surge"].value == 60.0


def test_a_number_that_the_mjcf_has_too_is_written_there():
    assert "&#39;tau&#39;: 3.5" in compile_world(VRX, parameters={"sea.tau": 3.5}).mjcf


def test_numbers_at_their_values_leave_the_world_as_it_is(worlds):
    world = worlds["marine skiff"]
    numbers = parameters(world)
    again = with_numbers(world.parameters, {name: number.value for name, number in numbers.items()})
    assert {name: number.value for name, number in numbers.items()} == {
        name: pytest.approx(number.value, rel=1e-15) for name, number in parameters(World(world.pieces, again)).items()
    }


def test_what_follows_from_other_numbers_is_not_listed(worlds):
    vrx, marine = parameters(worlds["vrx wamv"]), parameters(worlds["marine wamv"])
    assert not {"wamv1.hull.mass", "sea.significant_height", "sea.waves.0.frequency"} & {*vrx, *marine}
    assert "wamv1.hull.drag_linear.surge" in vrx
    assert "wamv1.hull.drag_linear.surge" not in marine
    assert marine["wamv1.hull.vessel.damping.surge.surge"].unit == "N s/m"
    assert marine["wamv1.hull.vessel.damping.surge.yaw"].unit == "N s"
    assert marine["wamv1.hull.vessel.damping.yaw.yaw"].unit == "N m s"


def test_units_of_forces_and_of_moments():
    found = parameters(compile_world("ocean"))
    assert found["wamv.hull.drag_linear.surge"].unit == "N s/m"
    assert found["wamv.hull.drag_linear.yaw"].unit == "N m s"
    assert found["wamv.hull.wind.y"].unit == "N s2/m2"
    assert found["wamv.hull.wind.yaw"].unit == "N m s2/m2"


def test_an_unknown_name_gets_the_nearest():
    with pytest.raises(UnknownNameError, match=r"^no parameter named 'wamv.hull.drag_linear.serge'; "
                       r"did you mean 'wamv.hull.drag_linear.surge'\?$"):  # fmt: skip
        compile_world("ocean", parameters={"wamv.hull.drag_linear.serge": 50.0})


@pytest.mark.parametrize("value", [math.nan, math.inf, "fast", None, True, [1.0], 1j, 10**400])
def test_a_value_is_a_finite_number(value):
    with pytest.raises(CommandError, match=r"^invalid wind.mean .*: a finite number \[m/s\] is needed$"):
        compile_world("ocean", parameters={"wind.mean": value})


@pytest.mark.parametrize(
    ("name", "value", "limit"),
    [
        ("wind.gain", -0.5, "must be at least 0, got -0.5"),
        ("wind.time_constant", 0, "must be above 0, got 0"),
        ("wamv.thrusters.left.max_reverse", 100.0, "must be at most 0, got 100"),
        ("wind.mean", 2e12, "must be at most 1000000000000, got 2000000000000"),
    ],
)
def test_a_value_is_in_the_range_of_its_field(name, value, limit):
    with pytest.raises(CommandError, match=rf"^invalid {name} \[.*\]: {limit}"):
        compile_world("ocean", parameters={name: value})


def test_any_kind_of_number_will_do():
    world = compile_world("ocean", parameters={"wind.mean": Fraction(7, 2)})
    assert parameters(world)["wind.mean"].value == 3.5


@pytest.mark.parametrize("given", [["wind.mean"], 5.0, "wind.mean=5"])
def test_parameters_are_a_mapping(given):
    with pytest.raises(CommandError, match=r"^parameters takes a mapping of numbers, as \{'wind.mean': 5.0\}, not "):
        compile_world("ocean", parameters=given)


def test_parameters_of_no_world_are_an_error():
    with pytest.raises(CommandError, match=r"^parameters takes a compiled world, as compile_world returns it, not "):
        vrx_mj.parameters("ocean")
