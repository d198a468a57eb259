"""What is written of a hull whose radiation and diffraction a stand-in for Capytaine makes up: numbers of before."""

import math
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from fingerprints import check
from unit.adapters.test_hydro import BOX
from unit.adapters.test_pole_fit import INFINITE, POLES, RESIDUES
from vrx_mj.adapters.hydro import hydro_of_hull
from vrx_mj.adapters.pole_fit import fitted_memory, kernel_of
from vrx_mj.errors import VrxError

MOTIONS = ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")
LID = 3
"""Panels of the lid, which no integral over the hull counts."""


class Mesh:
    """Triangles, with what Capytaine knows of them."""

    def __init__(self, vertices, faces):
        self.corners = vertices[faces]
        self.nb_faces = len(faces)

    def immersed_part(self):
        wet = self.corners[self.corners[..., 2].max(axis=1) < 1e-9]
        return Mesh(wet.reshape(-1, 3), np.arange(3 * len(wet)).reshape(-1, 3))

    def generate_lid(self):
        return "lid"

    @property
    def faces_centers(self):
        return self.corners.mean(axis=1)

    @property
    def _across(self):
        return np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])

    @property
    def faces_areas(self):
        return 0.5 * np.linalg.norm(self._across, axis=1)

    @property
    def faces_normals(self):
        return self._across / np.linalg.norm(self._across, axis=1)[:, None]


class Problem:
    """A problem of one motion, or of waves from one direction, with smooth values on the hull and on its lid."""

    def __init__(self, omega, body, rho, g, radiating_dof="", wave_direction=0.0):
        assert (body["lid_mesh"], body["name"]) == ("lid", "hull")
        self.omega, self.mesh, self.motion, self.direction = omega, body["mesh"], radiating_dof, wave_direction
        self.size = rho * g * (1.0 + body["dofs"])
        kind = 1.0 + MOTIONS.index(self.motion) if self.motion else math.cos(self.direction)
        x, y, z = self.mesh.faces_centers.T
        on_hull = np.exp(0.3 * z + 1j * (kind * x - 0.7 * y)) if omega < math.inf else 0.0 * x
        self.boundary_condition = np.concatenate([on_hull, [9.0] * LID])


class Solver:
    """Solves none of it: memory of known poles, and forces that a finer mesh makes smaller."""

    def __init__(self, method):
        assert method == "direct"

    def solve(self, problem):
        omega, rough = problem.omega, 1.0 + 4.0 / problem.mesh.nb_faces
        at = min(max(omega, 1e-4), 1e4)
        kernel = kernel_of(np.array(POLES), np.array(RESIDUES), np.array([at]))[0]
        added, damping = INFINITE + kernel.imag / at, kernel.real
        added = added + 0.03 * (
            np.triu(np.ones((6, 6))) - np.tril(np.ones((6, 6)))
        )  # as far from symmetric as numerical ones are
        j = MOTIONS.index(problem.motion) if problem.motion else 0
        return SimpleNamespace(
            added_masses=dict(zip(MOTIONS, rough * added[:, j], strict=True)),
            radiation_dampings=dict(zip(MOTIONS, rough * damping[:, j], strict=True)),
            forces={
                motion: problem.size * rough * (1.0 + number) * np.exp(1j * (problem.direction + number) - 0.2 * at)
                for number, motion in enumerate(MOTIONS)
            },
            potential=0.3j * problem.boundary_condition,
        )


@pytest.fixture
def _capytaine(monkeypatch):
    made = SimpleNamespace(
        __version__="2.0",
        Mesh=Mesh,
        rigid_body_dofs=lambda rotation_center: float(np.sum(rotation_center)),
        FloatingBody=dict,
        RadiationProblem=Problem,
        DiffractionProblem=Problem,
        BEMSolver=Solver,
    )
    monkeypatch.setitem(sys.modules, "capytaine", made)


@pytest.mark.usefixtures("_capytaine")
@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("halved", {"panels": 24, "waves": (0.5, 1.5)}),
        ("coarse", {"panels": 24, "tolerance": None}),
        ("as asked", {"panels": 40, "tolerance": 0.5, "highest": 3.0, "waves": (1.0,)}),
    ],
)
def test_a_file_of_a_hull_has_the_numbers_that_it_had(name, options):
    done = []
    found = hydro_of_hull(
        BOX, 0.1, (0.3, 0.1, 0.2), density=1000.0, gravity=9.81, frequencies=12, angles=6,
        progress=lambda *counts: done.append(counts), **options,
    )  # fmt: skip
    program = found.pop("program")
    assert program.startswith("Capytaine 2.0, ")
    check("hydro", name, found=found, program=[*map(int, program.split()[2:3])], done=done, rounding=1e-6)


@pytest.mark.usefixtures("_capytaine")
def test_a_hull_of_too_many_panels_is_refused():
    with pytest.raises(VrxError) as caught:
        hydro_of_hull(BOX, 0.0, (0, 0, 0), density=1e3, gravity=9.81, frequencies=12, panels=4500, tolerance=None)
    count, _, rest = str(caught.value).partition(" ")
    assert int(count.replace(",", "")) > 4000
    assert rest == "wet panels, more than 4,000: simplify the mesh"


def test_memories_of_known_poles_are_fitted_as_they_were():
    """Of one motion, of two that are coupled beside another, and of all six."""
    frequencies, found = np.linspace(0.1, 6.0, 20), []
    whole = np.eye(6) + 0.1 * np.cos(np.arange(6)[:, None] + np.arange(6))
    for shape in (np.diag((0.0, 0.0, 3.0, 0.0, 0.0, 0.0)), RESIDUES[0].imag + np.diag((0.0, 90.0, 0, 0, 0, 0)), whole):
        residues = np.array(
            [(1.0 + 0.4 * number) * shape * pole / (1j * pole.imag) for number, pole in enumerate(POLES)]
        )
        kernel = kernel_of(np.array(POLES), residues, frequencies)
        added = INFINITE + kernel.imag / frequencies[:, None, None]
        memory = fitted_memory(frequencies, added, kernel.real, INFINITE)
        order = np.lexsort((memory.poles.imag.round(6), memory.poles.real.round(6)))
        poles, residues = memory.poles[order], memory.residues[order].round(5)
        found.append(
            [poles.real, poles.imag, residues.real, residues.imag, memory.error < 1e-6, memory.damping > -1e-6]
        )
    check("hydro", "memories", rounding=1e-6, found=found)
