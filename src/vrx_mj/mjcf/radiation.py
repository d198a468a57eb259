"""The radiation and diffraction of a file, about the link's origin and in water of a density, as the loop has them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.config.hydro import Hydro
from vrx_mj.model.boats import Diffraction, Memory

_NIL = 1e-9
"""Share of the largest residue [SI] below which all of a motion's at a pole are left out."""


def about_origin(matrix: FloatArray, point: Sequence[float] | FloatArray) -> FloatArray:
    """A (6, 6) matrix of forces over motions of a point [m], as one of those of the origin.

    The point moves with v_p = v + w x p, and its force has the torque p x f about the origin: T' M T.
    """
    transform = _transform(point)
    moved: FloatArray = transform.T @ matrix @ transform
    return moved


def _transform(point: Sequence[float] | FloatArray) -> FloatArray:
    """The (6, 6) that takes motions of the origin to those of a point."""
    x, y, z = point
    transform = np.eye(6)
    transform[:3, 3:] = -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return transform


def memory_of(hydro: Hydro, density: float) -> tuple[Memory, ...]:
    """The memory of a hull in water of a density [kg/m3]: for each pole, that of each motion that makes waves."""
    share, rows = density / hydro.density, list[Memory]()
    residues = np.array(hydro.residues)
    least = _NIL * float(np.abs(residues).max(initial=0.0))
    for pole, residue in zip(hydro.poles, residues, strict=True):
        a, b = (share * about_origin(residue[..., part], hydro.point) for part in (0, 1))
        rows += [
            Memory(
                motion=motion, pole=pole, residue=nested_tuples(of_real), residue_imaginary=nested_tuples(of_imaginary)
            )
            for motion, (of_real, of_imaginary) in enumerate(zip(a.T, b.T, strict=True))
            if max(np.abs(of_real).max(), np.abs(of_imaginary).max()) > least
        ]
    return tuple(rows)


def diffraction_of(hydro: Hydro, density: float) -> Diffraction | None:
    """The diffraction of a hull in water of a density [kg/m3], at even frequencies from 0 on, where it is none."""
    if not hydro.diffraction:
        return None
    diffraction = np.array(hydro.diffraction)
    n, angles = diffraction.shape[:2]
    at_origin = np.einsum("ji,nmjc->nmci", _transform(hydro.point), diffraction).reshape(n, -1)
    frequencies = np.concatenate(([0.0], hydro.frequencies))
    forces = np.concatenate((np.zeros((1, at_origin.shape[1])), at_origin)) * density / hydro.density
    step = float(frequencies[-1]) / n
    even = np.stack([np.interp(step * np.arange(n + 1), frequencies, column) for column in forces.T], axis=1)
    return Diffraction(step=step, forces=nested_tuples(even.reshape(n + 1, angles, 12)))


def nested_tuples(values: npt.NDArray[Any]) -> Any:
    """Numbers of an array as tuples in each other, as records have them."""
    return tuple(map(nested_tuples, values)) if values.ndim > 1 else tuple(values.tolist())
