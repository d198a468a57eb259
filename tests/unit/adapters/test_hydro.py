"""Radiation and diffraction by Capytaine: a small sphere, and what cannot be computed."""

import json
import math
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from needs import CAPYTAINE, needs
from vrx_command import environment
from vrx_mj.adapters import hydro
from vrx_mj.adapters.hydro import (
    FREQUENCY_COUNTS,
    _cut_along_edges,
    _fine_solver,
    _Solver,
    _wet_mesh,
    hydro_of_hull,
    mean_drift,
    panel_hull,
)
from vrx_mj.config.dynamics import read_hydro
from vrx_mj.errors import CommandError, VrxError

BALL = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
SPHERE = np.array(BALL.triangles) * (4.0 / 3.0 * math.pi / BALL.volume) ** (1.0 / 3.0)
BOX = np.array(trimesh.creation.box((4.0, 2.0, 1.0)).triangles)


def test_a_coarse_hull_is_cut_into_panels():
    vertices, faces, edge = panel_hull(BOX, 300)
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2.0
    wet = corners[:, :, 2].mean(axis=1) < 0.0
    assert wet.sum() >= 300
    assert area.sum() == pytest.approx(28.0)
    assert math.sqrt(area.max() * 4.0 / math.sqrt(3.0)) < 2.0 * edge


@pytest.mark.parametrize("subdivisions", [2, 3, 4])
def test_the_edge_is_that_of_the_mesh_that_is_made(subdivisions):
    """A fine mesh is not cut: its mean edge halves with each subdivision, whatever number of panels is asked for."""
    ball = trimesh.creation.icosphere(subdivisions=subdivisions)
    vertices, faces, edge = panel_hull(np.array(ball.triangles), 50)
    assert len(faces) == len(ball.faces)
    assert edge == pytest.approx(ball.edges_unique_length.mean(), rel=0.02)  # the lower half's
    assert len(vertices) == len(ball.vertices)


@pytest.mark.parametrize("frequencies", [0, 3, 9, 501])
def test_a_memory_needs_enough_frequencies(frequencies):
    with pytest.raises(CommandError) as error:
        hydro_of_hull(SPHERE, 0.0, (0, 0, 0), density=1000.0, gravity=9.81, frequencies=frequencies)
    assert str(error.value) == f"invalid frequencies {frequencies}: 10 to 500 are needed"


@needs(CAPYTAINE)
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_the_fewest_frequencies_are_enough():
    found = hydro_of_hull(
        SPHERE,
        0.0,
        (0, 0, 0),
        density=1000.0,
        gravity=9.81,
        frequencies=FREQUENCY_COUNTS[0],
        panels=100,
        tolerance=None,
        angles=2,
    )
    assert found["fit_error"] < 0.05
    k = found["frequencies"][-1] ** 2 / 9.81
    wet = panel_hull(SPHERE, 100)[2]
    assert 2.0 * math.pi / k == pytest.approx(5.0 * wet)


def test_a_hull_is_solved_for_in_axes_whose_origin_is_at_the_waterline(monkeypatch):
    solved = []

    def solver(_, mesh, *others):
        solved.append([np.array(mesh), *map(np.array, others)])
        raise VrxError("enough")

    monkeypatch.setitem(sys.modules, "capytaine", SimpleNamespace())
    monkeypatch.setattr(hydro, "_wet_mesh", lambda _, corners, *others, **options: corners)
    monkeypatch.setattr(hydro, "_Solver", solver)
    for up in (0.0, 0.75):
        with pytest.raises(VrxError, match="enough"):
            hydro_of_hull(
                np.add(BOX, (0, 0, up)), up, (0.5, 0.25, up - 0.125), density=1000.0, gravity=9.81, tolerance=None
            )
    for mesh, point, density, gravity in solved:
        assert (mesh == BOX).all()
        assert (*point, density, gravity) == (0.5, 0.25, -0.125, 1000.0, 9.81)


OMEGA, WATER, GRAVITY = 2.0, 1000.0, 9.81
THETA = 2.0 * math.pi / 72 * np.arange(72)


def kochin_functions():
    """Smooth ones (12, 72) and (6, 72)."""
    draw = np.random.default_rng(4).normal(0.0, 0.3, (18, 7, 2))
    orders = np.exp(1j * np.arange(-3, 4)[:, None] * THETA)
    found = (draw[..., 0] + 1j * draw[..., 1]) @ orders
    return found[:12], found[12:]


def drift(scattered, radiated, motions):
    """Forces and moment (12, 3)."""
    a, b = mean_drift(OMEGA, scattered, radiated, WATER, GRAVITY)
    return (a[:, :, 0] + a[:, :, 1:] @ motions).real + np.einsum("i,cij,j->c", motions.conj(), b, motions).real


MOTIONS = np.array([0.3 + 0.2j, -0.1j, 0.8 + 0.4j, 0.2, 0.1 - 0.3j, 0.05j])


def test_mean_drift_is_that_of_the_sum_of_all_waves():
    scattered, radiated = kochin_functions()
    total = scattered + MOTIONS @ radiated
    together = drift(total, 0.0 * radiated, MOTIONS)
    assert drift(scattered, radiated, MOTIONS) == pytest.approx(together, rel=1e-9, abs=1e-9 * np.abs(together).max())
    k, share = OMEGA**2 / GRAVITY, 2.0 * math.pi * WATER
    for index in range(12):
        spread = k**2 * np.mean(np.abs(total[index]) ** 2 * np.exp(1j * THETA)) * 2.0 * math.pi
        force = -share * (OMEGA * np.exp(1j * THETA[6 * index]) * total[index, 6 * index].real + spread)
        assert together[index, :2] == pytest.approx([force.real, force.imag], rel=1e-9)


def test_the_moment_of_mean_drift_is_that_of_its_force_when_the_hull_is_moved():
    """Of a hull at (0.4, -0.7) m the waves that meet it, and those that it throws back, have other phases."""
    scattered, radiated = kochin_functions()
    way, place = np.exp(1j * THETA), 0.4 - 0.7j
    path = OMEGA**2 / GRAVITY * (way.conj() * place).real
    moved = scattered * np.exp(1j * (path[::6, None] - path))
    none = np.zeros(6)
    here, there = (drift(own, radiated, none) for own in (scattered, moved))
    assert there[:, :2] == pytest.approx(here[:, :2], rel=1e-9)
    assert there[:, 2] == pytest.approx(here[:, 2] + 0.4 * here[:, 1] + 0.7 * here[:, 0], rel=1e-6)


LOGGING = """
import logging, warnings
warnings.simplefilter("ignore")
import numpy as np
from vrx_mj.adapters.hydro import hydro_of_hull
def seen():
    root = logging.getLogger()
    return root.handlers[:], root.level, logging.getLogger("capytaine").level
before = seen()
try:
    hydro_of_hull(np.ones((4, 3, 3)), 0.0, (0, 0, 0), density=1000.0, gravity=9.81)
except Exception as error:
    print(error)
assert seen() == before, (before, seen())
"""


@needs(CAPYTAINE)
@pytest.mark.slow
def test_a_program_s_logging_stays_as_it_was():
    """Importing Capytaine gives the root logger a handler of its own."""
    done = subprocess.run(
        [sys.executable, "-c", LOGGING], env=environment(), capture_output=True, encoding="utf-8", check=False,
        timeout=120,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("no part of the hull is under water")


def test_a_hull_in_the_air_has_no_panels():
    with pytest.raises(VrxError) as error:
        panel_hull(np.add(BOX, (0.0, 0.0, 3.0)), 300)
    assert str(error.value) == "no part of the hull is under water; check --mass, and the mesh's unit (m)"


def test_panels_along_sharp_edges_are_cut_and_stay_on_the_hull():
    """The closed surface and its volume are those before; its smallest panels touch the edges."""
    vertices, faces, _ = panel_hull(BOX, 100)
    cut = _cut_along_edges(BOX, vertices[faces])
    normals = 0.5 * np.cross(cut[:, 1] - cut[:, 0], cut[:, 2] - cut[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    assert areas.sum() == pytest.approx(28.0)
    assert (normals * cut.mean(axis=1)).sum() / 3.0 == pytest.approx(8.0)
    ratio = np.abs(cut) / (2.0, 1.0, 0.5)
    on_edges = (np.isclose(ratio, 1.0).sum(axis=2) >= 2).sum(axis=1) >= 2
    assert areas[on_edges].max() < 0.2 * np.linalg.norm(
        np.cross(*np.moveaxis(np.diff(vertices[faces], axis=1), 1, 0)), axis=1
    ).max()  # fmt: skip
    assert len(cut) > len(faces) + on_edges.sum()


def test_a_smooth_hull_is_not_cut():
    assert np.array_equal(_cut_along_edges(SPHERE, SPHERE), SPHERE)


class _Coarse:
    """A solver whose error falls as the edge of its panels, from 24 % with 100 on."""

    def __init__(self, panels):
        if panels > 4000:
            raise VrxError("too many")
        self.panels = panels

    def forces(self, frequencies):
        return np.full((len(frequencies), 2, 6), 1.0 + 2.4 / math.sqrt(self.panels))


@pytest.mark.parametrize(("tolerance", "panels", "change"), [(0.15, 100, 0.12), (0.07, 400, 0.06), (0.01, 1600, 0.06)])
def test_panels_are_halved_until_little_changes(tolerance, panels, change):
    """Or until there would be too many: then the change is that which the finest came from."""
    solver, found = _fine_solver(_Coarse, 100, tolerance, [1.0])
    assert (solver.panels, found) == (panels, pytest.approx(change, rel=0.15))


@needs(CAPYTAINE)
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_panels_of_a_box_are_halved_until_its_forces_stay():
    """Roll in beam waves of 2 rad/s is 1816.9 N m/m with 1920 panels, and 3 % off with 368 of one size."""
    capytaine = pytest.importorskip("capytaine")

    def solver(count, *, clustered=True):
        return _Solver(capytaine, _wet_mesh(capytaine, BOX, count, clustered=clustered), np.zeros(3), 1025.0, 9.81)

    def roll(found):
        return np.abs(found.forces([2.0])).max(axis=(0, 1))[3]

    found, change = _fine_solver(solver, 150, 0.1, [2.0])
    assert found.panels == 592
    assert change == pytest.approx(0.0725, abs=0.003)  # of roll, with its phase
    assert roll(found) == pytest.approx(1816.9, rel=0.01)
    assert roll(solver(150, clustered=False)) > 1.03 * 1816.9


@needs(CAPYTAINE)
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_hemisphere(tmp_path, monkeypatch):
    """Added mass 0.831 and 0.5 of the displaced mass (Hulme, 1982); Haskind's relation of damping and forces."""
    monkeypatch.chdir(tmp_path)
    found = hydro_of_hull(
        SPHERE, 0.0, (0, 0, 0), density=1000.0, gravity=9.81, frequencies=20, panels=150, tolerance=None, angles=8
    )
    displaced = 1000.0 * 2.0 / 3.0 * math.pi
    assert found["added_mass_zero"][2][2] / displaced == pytest.approx(0.831, rel=0.03)
    assert found["added_mass_infinite"][2][2] / displaced == pytest.approx(0.5, rel=0.03)
    (tmp_path / "sphere.json").write_text(json.dumps(found), encoding="utf-8")
    table = read_hydro("sphere.json", tmp_path)
    assert table.fit_error < 0.03
    omega, forces = np.array(table.frequencies), np.array(table.diffraction)[:, 0, 2] @ (1.0, 1j)
    k = omega**2 / 9.81
    # Froude-Krylov on a hemisphere in heave, by quadrature over rings of its surface
    polar = (np.arange(400) + 0.5) * math.pi / 800
    rings = np.array([_ring(kk, polar) for kk in k])
    excited = np.abs(1000.0 * 9.81 * rings + forces)
    haskind = k * excited**2 / (4.0 * 1000.0 * 9.81 * (9.81 / omega / 2.0) * 1.0)
    assert np.array(table.damping)[3:12, 2, 2] == pytest.approx(haskind[3:12], rel=0.03)


def _ring(k, polar):
    """Integral of e^(k z) cos(k x) n_z over a hemisphere of 1 m."""
    azimuth = (np.arange(64) + 0.5) * 2.0 * math.pi / 64
    x = np.sin(polar)[:, None] * np.cos(azimuth)
    z = -np.cos(polar)[:, None]
    weight = (np.cos(polar) * np.sin(polar))[:, None] * (math.pi / 800) * (2.0 * math.pi / 64)
    return float((np.exp(k * z) * np.cos(k * x) * weight).sum())
