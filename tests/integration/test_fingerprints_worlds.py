"""What worlds compile to, and how their boats, objects, sensors and tasks go on: the numbers that they had before."""

import warnings

import numpy as np
import pytest

import vrx_mj
from fingerprints import check, numbers_in
from vrx_mj.config.search import catalogue
from vrx_mj.mjcf.parameters import parameters
from vrx_mj.model.world import tree_of
from vrx_mj.runtime.views import ARRAYS, OWN, PARAMETER, STATE

EVERYDAY = {
    "example_course": "trio", "gymkhana": None, "marina": None, "my_course": None,
    "vrx2023/scan_dock_deliver_task": None,
}  # fmt: skip
BY_NIGHT = {name: None for name in catalogue("worlds") if not name.startswith("vrx2") and name not in EVERYDAY}
BY_NIGHT |= {
    name: None
    for name in catalogue("worlds")
    if name.startswith("vrx2023/") and name.count("/") == 1 and name not in EVERYDAY
}
FLEETS = [*catalogue("fleets")]
ROBOTS = [*catalogue("robots")]
DIFFERENCES = 1e-5
"""As `fingerprints.ROUNDING`, of mean forces: their differences of two speeds magnify what another BLAS rounds."""
SEA = {"model": "jonswap", "significant_height": 0.4, "peak_period": 4.5, "components": 12, "spreading": 10.0}


def compiled(*source, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", vrx_mj.VrxWarning)
        return vrx_mj.compile_world(*source, **options)


def model_numbers(model):
    """The numbers of a model's bodies, joints, shapes and cameras; its meshes by what they weigh and span."""
    kinds = ("body", "jnt", "dof", "geom", "site", "cam", "light", "eq", "tendon", "mat")
    own = {name: getattr(model, name) for name in sorted(dir(model)) if name.partition("_")[0] in kinds}
    return {name: value for name, value in own.items() if isinstance(value, np.ndarray)}


def check_run(file, key, world, seconds=1.0):
    """What a world compiles to, and a run of it in which each boat has a course and speed of its own."""
    tree = tree_of(world.parameters)
    mean = [hull["vessel"].pop("drift") for hull in tree["hulls"] if hull.get("vessel", {}).get("drift")]
    if mean:
        check(file, f"{key}: mean forces", rounding=DIFFERENCES, mean=mean)
    sim = vrx_mj.Simulation(world, seed=3)
    given = {
        boat: {
            name: (0.3 if name.endswith("angle") else 0.7) * (1.0 - 0.1 * place)
            for place, name in enumerate(sim.command_names(boat))
        }
        for boat in sim.boats
    }
    sim.command_all(given)
    sim.advance(round(seconds / sim.timestep))
    seen = sim.observe()
    boats = [one for name, one in seen.items() if name in sim.boats]
    without = {"camera"} if world.parameters.georeference else {"camera", "gps"}
    read = {one.name for boat in sim.boats for one in sim.mounted(boat) if one.kind.type not in without}
    check(
        file, key,
        compiled=[numbers_in(world.mjcf), tree],
        model=model_numbers(sim.model),
        motion=[sim.data.qpos, sim.data.qvel, sim.data.qacc],
        boats=[[one.position, one.velocity, one.roll, one.pitch, one.heading, one.speed, one.course] for one in boats],
        forces=[sim.forces(boat) for boat in sim.boats],
        engines=[[sim.thrust(boat), sim.steering(boat)] for boat in sim.boats],
        sensors=[[name, one.sensors[name]] for one in boats for name in one.sensors if name in read],
        task=sim.task,
        weather=[sim.row(), sim.sea.height(*np.mgrid[:3, :4], sim.time)],
    )  # fmt: skip
    check("loop", f"{file}: {key}", **arrays_of(sim))


def arrays_of(sim):
    """The arrays of the compiled loop: those of all runs of a world, of a state, and of the run."""
    found = sim._live.arrays.by_name(np.zeros(3, np.int64), np.zeros((0, 0)))
    del found["drift"]  # the mean forces
    return {use: {name: found[name] for name in found if ARRAYS[name].use == use} for use in (PARAMETER, STATE, OWN)}


@pytest.mark.parametrize("name", EVERYDAY)
def test_a_world_is_and_goes_on_as_before(name):
    check_run("worlds", name, compiled(name, fleet=EVERYDAY[name]))


@pytest.mark.slow
@pytest.mark.nightly
def test_so_do_the_others():
    for name in BY_NIGHT:
        check_run("worlds", name, compiled(name))


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_floats_and_moves_in_waves_as_before(robot):
    water = {"sea": SEA, "current": {"speed": 0.3, "direction": 30}, "wind": {"mean_velocity": 5, "var_gain": 2}}
    place = {"georeference": {"latitude": 21.3, "longitude": -157.9}, "physics": {"profile": "marine"}}
    world = compiled({**water, **place}, fleet={"boats": [{"robot": robot, "pose": [0, 0, 0, 0, 0, 0.4]}]})
    check_run("robots", robot, world)
    check("robots", f"{robot}: parameters", numbers=[[name, one.value] for name, one in parameters(world).items()])


HALF_A_METRE = {"significant_height": 0.5, "peak_period": 5.0, "components": 15}
WIND = {"direction": 200, "mean_velocity": 6}
WEATHERS = {
    "pms": {"sea": {"model": "pms", "gain": 0.3, "period": 4.0, "angle": 0.5, "number": 2, "steepness": 0.4}},
    "cwr": {"sea": {"model": "cwr", "amplitude": 0.2, "period": 5.0, "scale": 1.3, "direction": [0.6, -0.8]}},
    "regular": {"sea": {"model": "regular", "height": 0.3, "period": 4.0, "depth": 3.0}},
    "stokes5": {"sea": {"model": "stokes5", "height": 0.6, "period": 4.5, "depth": 5.0, "direction": [0.8, 0.6]}},
    "pm": {"sea": {"model": "pm", "sea_state": 3}},
    "jonswap": {"sea": {"model": "jonswap", **HALF_A_METRE, "gamma": 2.5, "amplitudes": "fixed", "spreading": 6.0}},
    "tma": {"sea": {"model": "tma", **HALF_A_METRE, "depth": 6.0, "record": 600.0}},
    "npd": {"wind": {**WIND, "spectrum": "npd", "components": 25, "height": 2.0, "exponent": 0.12}},
    "gusts": {"wind": {**WIND, "var_gain": 2, "turning": 3.0, "var_direction": 8.0, "roughness": 0.001}},
    "current": {"current": {"speed": 0.3, "direction": 80, "profile": [[0, 1], [5, 0.4]], "var_gain": 0.1,
                            "tide": {"speed": 0.4, "minor": 0.1, "direction": 20, "phase": 50}}},
}  # fmt: skip


@pytest.mark.parametrize("name", WEATHERS)
def test_weather_is_and_goes_on_as_before(name):
    calm = {"sea": {"model": "none"}, "physics": {"profile": "marine"}}
    fleet = {"boats": [{"robot": "barge_4m", "pose": [3, -2, 0, 0, 0, 0.4]}]}
    check_run("weather", name, compiled({**calm, **WEATHERS[name]}, fleet=fleet))


@pytest.mark.slow
@pytest.mark.nightly
def test_a_fleet_sails_as_before():
    for fleet in FLEETS:
        check_run("fleets", fleet, compiled("example_course", fleet=fleet))
