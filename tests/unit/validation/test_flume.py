"""The linear theory of the flume's section, against what holds for any section, and the robot's file that it made."""

import json
import math
import runpy

import numpy as np
import pytest

from vrx_mj.validation.case import folder


@pytest.fixture(scope="module")
def recipe():
    return runpy.run_path(str(folder() / "make_flume.py"))


@pytest.fixture(scope="module")
def section(recipe):
    return recipe["Section"]()


@pytest.mark.slow
@pytest.mark.parametrize("omega", [4.0, 5.5, 9.0])
def test_energy_is_kept_and_excitation_is_what_radiates(recipe, section, omega):
    """|R|^2 + |T|^2 = 1; damping is what waves carry away; Haskind (1957): forces are 2 rho g c_g times these.

    The first converges with the panels of the surface: 300 leave 1 % at 9 rad/s, 420 half of that.
    """
    _, damping, waves, made, passing = section.forces(omega)
    flux = recipe["DENSITY"] * recipe["GRAVITY"] * recipe["group_speed"](omega)
    assert np.square(np.abs(passing)).sum() == pytest.approx(1.0, abs=0.012)
    assert np.diag(damping) == pytest.approx(flux * np.square(np.abs(made)).sum(axis=0) / omega**2, rel=0.015)
    assert np.abs(waves.sum(axis=0)) == pytest.approx(2.0 * flux * np.abs(made[1]) / omega, rel=2e-3)


@pytest.mark.slow
def test_the_robots_file_is_what_the_recipe_makes(recipe, section):
    table = json.loads((folder() / "worlds" / "flume_section" / "hydro.json").read_text("utf-8"))
    omega, own = table["frequencies"][6], np.ix_(recipe["MOTIONS"], recipe["MOTIONS"])
    added, damping, waves, _, _ = section.forces(omega)
    length, rig = recipe["LENGTH"], np.diag([recipe["RIG_MASS"], 0.0, 0.0])
    assert np.array(table["added_mass"][6])[own] == pytest.approx(length * added + rig, rel=1e-4, abs=1e-4)
    assert np.array(table["damping"][6])[own] == pytest.approx(length * damping, rel=1e-4, abs=1e-4)
    forces = np.array(table["diffraction"][6][recipe["TOWARD"]])[recipe["MOTIONS"]]
    assert forces @ (1.0, 1.0j) == pytest.approx(length * waves[1], rel=1e-4)


@pytest.mark.slow
def test_long_waves_carry_the_section_along(recipe, section):
    """A long wave in deep enough water moves a small hull as it moves the water, and drives it by next to nothing."""
    sizes, mean = recipe["theory"](section, 3.0, held=True)
    assert sizes[4] == pytest.approx(1.0, abs=0.15)
    assert abs(mean) < 0.05
    assert math.isclose(sizes[5], 0.0, abs_tol=1e-6)
