"""Worlds, fleets and comparisons that several tests of whole runs share."""

import csv
import dataclasses
import json
import warnings
from functools import cache
from pathlib import Path

import numpy as np

import vrx_mj
from trees import partial
from vrx_mj.config.objects import load_object
from vrx_mj.config.search import catalogue
from vrx_mj.model.world import tree_of

GOLDEN = Path(__file__).resolve().parents[1] / "golden"
CALM = {"model": "none"}
ROUGH = {"model": "pms", "gain": 0.4, "period": 5.0, "scale": 1.5, "direction": [1.0, 0.3], "tau": 2.0}
COEFFICIENTS = (0.5, 0.5, 0.33)
GUSTY = {
    "direction": 120,
    "mean_velocity": 6.0,
    "var_gain": 2.0,
    "var_time": 2.0,
    "seed": 15,
    "objects": [{"model": "wamv", "coefficients": COEFFICIENTS}],
}
COMPILED = {}
"""Worlds by what they were compiled from."""
AFLOAT = -0.1018635
"""Height of a boat's origin at rest in calm water [m]: vessel_equilibrium.csv of VRX's reference values."""


@cache
def object_kinds():
    """Kinds of the objects of the catalogue, by their names."""
    return {name: load_object(name).kind for name in catalogue("objects")}


def table(path):
    """Rows of a CSV file as mappings of strings."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def water(*, sea=ROUGH, wind=GUSTY, timestep=0.01, **more):
    """Open water of VRX classic's profile."""
    world = {"physics": {"profile": "vrx", "timestep": timestep}, "sea": sea, **more}
    return world if wind is None else {**world, "wind": wind}


def boats(*places, **more):
    """A fleet of boats a, b, ... at (x, y, yaw) [m, rad], without sensors: VRX's 258 kg."""
    entries = [
        {"name": name, "pose": [x, y, AFLOAT, 0, 0, yaw]} for name, (x, y, yaw) in zip("abcdefgh", places, strict=False)
    ]
    return {"boats": entries, "thrusters": "H", "sensors": "none", **more}


def simulation(fleet=None, *, seed=None, edit=None, **world):
    """A simulation in open water; `edit` changes the world's parameters before it starts."""
    made = compiled(water(**world), fleet or boats((0.0, 0.0, 0.3)))
    return vrx_mj.Simulation(made if edit is None else edited(made, edit), seed=seed)


def compiled(world, fleet):
    """A compiled world, the same object for the same mappings in the same folder unless compiling it warns."""
    key = repr((world, fleet, Path.cwd()))
    if key in COMPILED:
        return COMPILED[key]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        made = vrx_mj.compile_world(world, fleet=fleet)
    for each in caught:
        warnings.warn_explicit(each.message, each.category, each.filename, each.lineno)
    if not caught:
        COMPILED[key] = made
    return made


def edited(world, change):
    """The world with other parameters: `change` edits a copy of the tree."""
    parameters = json.loads(json.dumps(dict(tree_of(world.parameters))))
    change(parameters)
    return dataclasses.replace(world, parameters=partial(parameters))


def added_mass(*values):
    """An edit that gives every hull this added mass."""

    def change(parameters):
        for hull in parameters["hulls"]:
            hull["added_mass"] = list(values)

    return change


def head_on(engines="fixed"):
    """Two boats that meet after about 4 s, off centre."""
    return boats((0.0, 0.0, 0.0), (9.0, 0.9, np.pi), engines=engines)


AHEAD = {"left": 1.0, "right": 0.7}


def same_bits(one, other):
    """Whether two arrays of numbers are equal to the last bit."""
    return np.ascontiguousarray(one).tobytes() == np.ascontiguousarray(other).tobytes()
