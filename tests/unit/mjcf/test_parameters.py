"""Numbers of a compiled world by name: listed with unit and meaning, set with what files would set, and saved."""

import math
import re
import shutil
from fractions import Fraction
from functools import cache
from types import UnionType
from typing import Annotated, Union, get_args, get_origin, get_type_hints

import numpy as np
import pytest
import yaml
from pydantic import BaseModel

import vrx_mj
from vrx_mj import Simulation, World, compile_world, parameters
from vrx_mj.config.robots import RobotConfig
from vrx_mj.config.values import NumberOf
from vrx_mj.config.world import WorldConfig
from vrx_mj.errors import CommandError, CompileError, UnknownNameError
from vrx_mj.model.numbers import run_numbers, with_numbers
from vrx_mj.packages import root
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.views import ARRAYS

ROBOTS = sorted(path.parent.name for path in (root() / "assets" / "robots").glob("*/robot.yaml"))
TIDE = {"speed": 0.3, "direction": 20, "var_gain": 0.1, "tide": {"speed": 0.5, "minor": 0.1, "direction": 10},
        "profile": [[0, 1.0], [5, 0.5]]}  # fmt: skip
MARINE = {"extends": "ocean", "physics": {"profile": "marine"}, "current": TIDE,
          "sea": {"model": "jonswap", "significant_height": 0.3, "peak_period": 4, "components": 5},
          "wind": {"mean_velocity": 4, "direction": 60, "spectrum": "npd", "components": 4}}  # fmt: skip
WINDY = {**MARINE, "sea": {**MARINE["sea"], "ramp": 2},
         "current": {**TIDE, "var_time": 30, "tide": {**TIDE["tide"], "phase": 5}},
         "wind": {"mean_velocity": 4, "direction": 60, "var_gain": 1, "var_time": 3, "update_rate": 5, "height": 8,
                  "exponent": 0.1, "turning": 1, "var_direction": 5, "var_direction_time": 20}}  # fmt: skip
ROUGH = {**WINDY, "wind": {"mean_velocity": 4, "roughness": 0.001}}
VRX = {"extends": "ocean", "wind": {"mean_velocity": 4, "direction": 60}}
DOCK = {
    **VRX,
    "docks": [
        {
            "name": "dock",
            "pose": [60, 0, 0, 0, 0, 0],
            "layout": "XX",
            "dynamic": True,
            "mooring": {"stiffness": 50, "damping": 5},
        }
    ],
}


def world_with(robot, base=VRX, **how):
    return compile_world(base, fleet={"usv_count": 1, "robot": robot}, **how)


@pytest.fixture(scope="module")
def worlds():
    return {
        **{f"vrx {robot}": world_with(robot) for robot in ("wamv", "skiff")},
        **{f"marine {robot}": world_with(robot, MARINE) for robot in ("wamv", "skiff", "otter")},
        "dock": compile_world(DOCK),
    }


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
            if number.path[0] == "boats" or number.in_mjcf or (kind, name.rsplit(".", 1)[-1]) in seen:
                continue
            seen.add((kind, name.rsplit(".", 1)[-1]))
            value = number.value * 0.75 if number.value else 0.125
            changed = with_numbers(world.parameters, {name: value})
            again = World(world.pieces, changed)
            assert parameters(again)[name].value == pytest.approx(value, rel=1e-15), name
            assert arrays_of(again, own) != before, f"{label}: {name}"


SIX = ("surge", "sway", "heave", "roll", "pitch", "yaw")
DEGREE = math.pi / 180
GIVEN = {
    # name of a number: place in the robot's YAML
    **{f"hull.{key}.{motion}": f"hydrodynamics.{key}.{i}"
       for key in ("added_mass", "drag_linear", "drag_quadratic") for i, motion in enumerate(SIX)},
    **{f"hull.wind.{axis}": f"wind.{i}" for i, axis in enumerate(("x", "y", "yaw"))},
    "hull.density": "hydrodynamics.water_density",
    "hull.level": "hydrodynamics.water_level",
    **{f"hull.vessel.damping_quadratic.{motion}": f"hull.damping_quadratic.{i}" for i, motion in enumerate(SIX)},
    **{f"thrusters.*.{key}": f"thrusters.*.{own}" for key, own in {
        "max_forward": "max_force_forward", "max_reverse": "max_force_reverse", "max_command": "max_command",
        "timeout": "timeout"}.items()},
    **{f"thrusters.*.{key}": f"rudders.*.{key}" for key in ("max_angle", "area", "race_share")},
    **{f"thrusters.*.{key}": f"rudders.*.servo.{key}" for key in ("kp", "kd", "effort", "velocity")},
    **{f"thrusters.*.measured.{key}": f"propellers.*.{key}"
       for key in ("diameter", "vanishing_speed", "time_constant", "dead_zone", "power")},
    **{f"thrusters.*.measured.thrust.#.{part}": f"propellers.*.thrust.#.{i}"
       for i, part in enumerate(("command", "thrust"))},
    "battery.capacity": "battery.capacity",
    "battery.resistance": "battery.resistance",
    **{f"battery.voltage.#.{part}": f"battery.voltage.#.{i}" for i, part in enumerate(("charge", "voltage"))},
    # in the world's YAML
    "wind.mean": "wind.mean_velocity",
    "wind.direction": ("wind.direction", DEGREE),
    "wind.gain": "wind.var_gain",
    "wind.time_constant": "wind.var_time",
    "wind.update_rate": "wind.update_rate",
    "air.height": "wind.height",
    "air.exponent": "wind.exponent",
    "air.roughness": "wind.roughness",
    "air.turning": ("wind.turning", DEGREE),
    "air.spread": ("wind.var_direction", DEGREE),
    "air.time_constant": "wind.var_direction_time",
    "current.gain": "current.var_gain",
    "current.time_constant": "current.var_time",
    "current.tide_phase": ("current.tide.phase", DEGREE),
    **{f"current.layers.#.{part}": f"current.profile.#.{i}" for i, part in enumerate(("depth", "share"))},
    "sea.tau": "sea.ramp",
    "sea.significant_height": "sea.significant_height",
    "moorings.#.stiffness": "docks.0.mooring.stiffness",
    "moorings.#.damping": "docks.0.mooring.damping",
}  # fmt: skip
"""Numbers that are those of a file, and their places there; `*` is the name of a thruster, `#` the number of a row."""
FOLLOWING = (
    r"hull\.(body_com|link_com|inertia)\..*", r"hull\.(mass|gravity)", r"stations\..*",
    r"hull\.vessel\.(added_mass|damping|restoring|spread|buoyancy|point|memory|strips)\..*",
    r"hull\.vessel\.(displacement|waterline|(diffraction|drift)\.step)",
    r"thrusters\.\w+\.(propeller\.[xyz]|slope|density|race_area)",
    r"current\.(mean|tide_major|tide_minor)\.[xy]", r"current\.tide_frequency", r"wind\.first_step", r"sea\.level",
    r"sea\.waves\..*", r"air\.gust_frequencies\..*", r"moorings\.\d+\.(anchor|point)\.[xyz]",
)  # fmt: skip
"""Numbers that are made of several of a file's: tests of masses, hulls, waves and currents hold these."""


def in_file(tree, path):
    """The value at a place of a YAML; None where it gives none."""
    for step in path.split("."):
        tree = tree[int(step)] if isinstance(tree, list) else (tree or {}).get(step)
    return tree


@cache
def expression_of(pattern):
    return re.compile(re.escape(pattern).replace(r"\*", r"(\w+)").replace(r"\#", r"(\d+)"))


def places_of(name):
    """Place of a number in a file, and the factor that makes its unit SI; nothing for what no file gives as it is."""
    for pattern, place in GIVEN.items():
        if match := expression_of(pattern).fullmatch(name):
            path, factor = (place, 1.0) if isinstance(place, str) else place
            for step in match.groups():
                path = re.sub(r"[*#]", step, path, count=1)
            yield pattern, path, factor


def full_robot(folder):
    """A skiff whose file gives all that a robot's file can."""
    shutil.copytree(root() / "assets" / "robots" / "skiff", folder / "full")
    path = folder / "full" / "robot.yaml"
    file = yaml.safe_load(path.read_text(encoding="utf-8"))
    file["hydrodynamics"] |= {"water_level": 0.02, "water_density": 1010}
    file["thrusters"]["propeller"] |= {"max_command": 0.9, "timeout": 2}
    file["rudders"]["rudder"] |= {"max_angle": 0.5, "servo": {"kp": 200, "kd": 10, "effort": 8, "velocity": 0.5}}
    file["propellers"] = {"propeller": {"thrust": [[-1, -50], [0, 0], [1, 90]], "diameter": 0.2, "vanishing_speed": 4,
                                        "time_constant": 0.3, "dead_zone": 0.05, "power": 300}}  # fmt: skip
    path.write_text(yaml.safe_dump(file), encoding="utf-8")
    return path


def patterns_of(path, base):
    """Patterns of a world's numbers that are given by a robot's file or by the world's, compared with the file."""
    compared = set()
    file = yaml.safe_load(path.read_text(encoding="utf-8"))
    world = world_with(str(path), base)
    for name, number in parameters(world).items():
        assert number.name == name
        assert number.unit, name
        assert number.meaning.endswith("."), name
        assert math.isfinite(number.value), name
        own = name.removeprefix(f"{world.boats[0]}.")
        found = list(places_of(own))
        assert found or any(re.fullmatch(known, own) for known in FOLLOWING), name
        for pattern, place, factor in found:
            value = in_file(base if own == name else file, place)
            if value is not None and not (base is MARINE and replaced(place, file)):
                if pattern not in {*compared, "wind.direction"}:  # which is kept as a unit vector
                    declared = declaration_in_file(WorldConfig if own == name else RobotConfig, place)
                    assert declared == declaration_of(world, number.path), name
                compared.add(pattern)
                assert number.value == pytest.approx(value * factor, rel=1e-12), f"{name}, {place}"
    return compared


@pytest.mark.filterwarnings("ignore:.* waves shorter than")
@pytest.mark.parametrize("robot", ROBOTS)
def test_every_number_of_a_robot_has_a_unit_and_a_meaning_and_is_that_of_its_file(robot):
    """In the two profiles by turns."""
    base = (VRX, MARINE)[ROBOTS.index(robot) % 2]
    assert patterns_of(root() / "assets" / "robots" / robot / "robot.yaml", base)


def test_every_place_of_a_file_is_that_of_a_number(tmp_path):
    """All that a file gives as it is, in a robot's file and in worlds' that give everything."""
    paths = {robot: root() / "assets" / "robots" / robot / "robot.yaml" for robot in ("skiff", "blueboat", "otter")}
    paths["full"] = full_robot(tmp_path)
    tried = [("full", VRX), ("full", MARINE), ("skiff", WINDY), ("skiff", ROUGH), ("skiff", DOCK), ("blueboat", VRX),
             ("otter", MARINE)]  # fmt: skip
    assert set().union(*(patterns_of(paths[robot], base) for robot, base in tried)) == GIVEN.keys()


def declaration_in_file(kind, place):
    """Dataclass and field that declare the number at a place of a file."""
    found = None
    for step in [*place.split("."), ""]:
        while get_origin(kind) in {Annotated, Union, UnionType}:
            kind, *marks = get_args(kind)
            found = next((mark for mark in marks if isinstance(mark, NumberOf)), found)
        if step and isinstance(kind, type) and issubclass(kind, BaseModel):
            kind = get_type_hints(kind, include_extras=True)[step]
        elif step:
            parts = get_args(kind)
            kind = parts[1] if get_origin(kind) is dict else parts[0 if parts[-1] is ... else int(step)]
    return found and (found.record, found.name)


def declaration_of(world, path):
    """Dataclass and field of a number of a compiled world."""
    found, value = None, world.parameters
    for step in path:
        if isinstance(step, str):
            found = type(value), step
        value = getattr(value, step) if isinstance(step, str) else value[step]
    return found


def replaced(place, file):
    """Whether a hull or a propeller of profile marine takes the place of a value in a robot's file."""
    return (place == "hydrodynamics.water_level" and "hull" in file) or (
        "max_force" in place and "propellers" in file and place.split(".")[1] in file["propellers"]
    )


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


@pytest.mark.parametrize("engines", ["fixed", "hinged"])
def test_masses_are_those_of_the_compiled_model(engines, tmp_path):
    """Twice the mass and inertia, and the centre of mass elsewhere: of one of two boats of a kind, loaded too."""
    fleet = {
        "boats": [{"name": name, "pose": [x, 0, 0, 0, 0, 0], "engines": engines} for name, x in (("a", 0), ("b", 20))]
    }
    plain = compile_world(VRX, fleet=fleet)
    names = ["mass", *(f"inertia.{axes}" for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))]
    numbers = parameters(plain)
    given = {f"a.hull.{name}": 2.0 * numbers[f"a.hull.{name}"].value for name in names} | {"a.hull.body_com.x": 0.3}
    changed = compile_world(VRX, fleet=fleet, parameters=given)
    old, new = Simulation(plain).model, Simulation(World.load(changed.save(tmp_path / "saved"))).model
    a = old.body("a/base_link").id
    assert new.body_mass[a] == pytest.approx(2.0 * old.body_mass[a], rel=1e-15)
    assert new.body_inertia[a] == pytest.approx(2.0 * old.body_inertia[a], rel=1e-9)
    assert new.body_ipos[a] == pytest.approx([0.3, *old.body_ipos[a][1:]], rel=1e-12)
    others = [index for index in range(old.nbody) if index != a]
    assert (new.body_mass[others] == old.body_mass[others]).all()
    pushing = [row for row in changed.parameters.thrusters if row.joint is None and row.hull == 0]
    assert all(row.body_com == changed.parameters.hulls[0].body_com for row in pushing)
    assert bool(pushing) is (engines == "fixed")
    at_values = {name: number.value for name, number in numbers.items() if number.in_mjcf}
    assert compile_world(VRX, fleet=fleet, parameters=at_values).sha256 == plain.sha256


def test_a_body_that_mujoco_does_not_take_is_an_error():
    with pytest.raises(CompileError, match=r"^MuJoCo cannot compile the world .* with wamv: .*A \+ B >= C"):
        compile_world("ocean", parameters={"wamv.hull.inertia.zz": 5000.0})
    with pytest.raises(CompileError, match=r"^robot wamv has moments of inertia of "):
        compile_world("ocean", parameters={"wamv.hull.inertia.xy": 5000.0})


def test_numbers_at_their_values_leave_the_world_as_it_is(worlds):
    world = worlds["marine skiff"]
    numbers = parameters(world)
    again = with_numbers(world.parameters, {name: number.value for name, number in numbers.items()})
    assert {name: number.value for name, number in numbers.items()} == {
        name: pytest.approx(number.value, rel=1e-15) for name, number in parameters(World(world.pieces, again)).items()
    }


def test_what_follows_from_other_numbers_is_not_listed(worlds):
    vrx, marine = parameters(worlds["vrx wamv"]), parameters(worlds["marine wamv"])
    assert not {"wamv1.stations.0.count", "sea.waves.0.frequency"} & {*vrx, *marine}
    stokes = parameters(compile_world({"sea": {"model": "stokes5", "height": 0.5, "period": 4.0}}, fleet="none"))
    assert {name for name in stokes if name.startswith("sea.")} == {"sea.tau", "sea.level"}
    assert "wamv1.hull.drag_linear.surge" in vrx
    assert "wamv1.hull.drag_linear.surge" not in marine
    assert not any(".stations." in name for name in marine)  # its mesh carries it
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


SHAPES = r"com\.|propeller\.[xyz]|stations\.|anchor|point|voltage|thrust\.|race|memory|strips|curve"
"""Places and curves, which not any factor leaves valid."""


@pytest.mark.parametrize("label", ["vrx wamv", "marine skiff", "marine otter", "dock"])
def test_a_run_with_numbers_of_its_own_is_that_of_a_world_compiled_with_them(worlds, label):
    """The run before, with other numbers, and the one after, without, leave no trace."""
    base = worlds[label]
    numbers = {
        name: number.value * 0.8 if number.value else 0.1
        for name, number in run_numbers(base.numbers).items()
        if not re.search(SHAPES, name)
    }
    runs = []
    sim = Simulation(base)
    for seed, own in ((1, {"wind.mean": 9.0}), (3, numbers), (3, None)):
        sim.reset(seed, parameters=own)
        sim.step({base.boats[0]: dict.fromkeys(sim.command_names(base.boats[0])[:1], 0.5)}, duration=1.0)
        runs.append(sim.data.qpos.tobytes())
    whole = Simulation(World(base.pieces, with_numbers(base.parameters, numbers)))
    plain = Simulation(base)
    for fresh in (whole, plain):
        fresh.reset(3)
        fresh.step({base.boats[0]: dict.fromkeys(sim.command_names(base.boats[0])[:1], 0.5)}, duration=1.0)
    assert runs[1:] == [whole.data.qpos.tobytes(), plain.data.qpos.tobytes()]
    assert runs[1] != runs[2]


def test_a_run_cannot_have_another_mass(worlds):
    with pytest.raises(CommandError, match=r"^wamv1\.hull\.mass cannot differ between runs of a world: compile "):
        Simulation(worlds["vrx wamv"]).reset(parameters={"wamv1.hull.mass": 300.0})


def test_the_water_moves_with_the_amplitudes_of_its_waves():
    world = {"sea": {"model": "jonswap", "significant_height": 0.3, "peak_period": 4.0, "components": 3, "depth": 9.0}}
    base = compile_world(world, fleet="none")
    amplitudes = {name: 2.0 * own.value for name, own in base.numbers.items() if name.endswith(".amplitude")}
    one = compile_world(world, fleet="none", parameters=amplitudes)
    assert len(amplitudes) == 3
    assert one.numbers["sea.significant_height"].value == pytest.approx(0.6)
    whole = compile_world(world, fleet="none", parameters={"sea.significant_height": 0.6})
    for own, other in zip(one.parameters.sea.waves, whole.parameters.sea.waves, strict=True):
        assert own.amplitude == pytest.approx(other.amplitude)
        assert own.orbital == pytest.approx(other.orbital)
    same = with_numbers(base.parameters, {"sea.waves.0.amplitude": base.numbers["sea.waves.0.amplitude"].value})
    assert same == base.parameters
    calm = with_numbers(base.parameters, dict.fromkeys(amplitudes, 0.0)).sea
    assert [wave.orbital for wave in calm.waves] == [0.0] * 3
