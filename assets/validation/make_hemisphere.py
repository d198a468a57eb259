"""Make hemisphere.csv and hemisphere_decay.csv: `pip install numpy scipy`, `python make_hemisphere.py`, a minute.

A hemisphere that heaves in deep water, by multipoles (Ursell, 1949; Hulme, 1982, J. Fluid Mech. 121, 443): a source of
waves and wave-free potentials whose normal velocity is that of the motion, by Galerkin's method with Legendre
polynomials of even degree. Then the decay of the sphere of IEA OES by Cummins' equation with the exact kernel.
"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import digamma, eval_legendre, gammaln

RADIUS, DENSITY, GRAVITY, MASS, DROP = 5.0, 1000.0, 9.81, 261.8e3, 1.0
DISPLACED = DENSITY * 2.0 / 3.0 * math.pi * RADIUS**3
POLES, TERMS = 150, 120
"""Wave-free potentials, and terms of the source's series in k a, which is good up to k a = 22."""
NODES, WEIGHTS = (
    0.5 * (array + one) for array, one in zip(np.polynomial.legendre.leggauss(400), (1.0, 0.0), strict=True)
)
LEGENDRE = np.array([eval_legendre(n, NODES) for n in range(2 * POLES + 1)])
LAST, SAMPLES = 6.4, 640
"""Highest frequency [rad/s], at which k a is 21, and how many there are from 0 on."""


def legendre_by_degree() -> np.ndarray:
    """Derivatives of Legendre functions P_nu(x) by nu at nu = 0, 1, ... (Bromwich, 1913)."""
    found = LEGENDRE[:TERMS] * np.log(0.5 * (1.0 + NODES))
    for n in range(TERMS):
        for k in range(n):
            share = 2.0 * (-1) ** (n + k) * (2 * k + 1) / ((n - k) * (n + k + 1))
            found[n] += share * (LEGENDRE[k] - LEGENDRE[n])
    return found


BY_DEGREE = legendre_by_degree()


def radiation(ka: float) -> tuple[float, float]:
    """Added mass over the displaced mass, and damping over that and the frequency."""
    n, j = np.arange(TERMS)[:, None], np.arange(1, POLES + 1)[:, None]
    powers = (-1.0) ** n * np.exp(n * math.log(ka) - gammaln(n + 1))
    series = (1j * math.pi + digamma(n + 1) - math.log(ka)) * LEGENDRE[:TERMS] - BY_DEGREE
    even, odd = LEGENDRE[2::2], LEGENDRE[1::2]
    potential = np.concatenate(([1.0 + ka * (powers * series).sum(0)], even + ka / (2 * j) * odd))
    source = -1.0 + ka * (powers * (n * series - LEGENDRE[:TERMS])).sum(0)
    velocity = np.concatenate(([source], -(2 * j + 1) * even - ka * odd))
    tests = LEGENDRE[0::2] * WEIGHTS
    strengths = np.linalg.solve(tests @ velocity.T, tests @ NODES)
    force = -3.0 * ((strengths @ potential) * NODES * WEIGHTS).sum()
    return float(force.real), abs(float(force.imag))


def memory(times: np.ndarray) -> np.ndarray:
    """The retardation kernel K33 of the sphere [N/m]: 2 / pi times the integral of B(omega) cos(omega t)."""
    omega = np.linspace(0.0, LAST, SAMPLES + 1)
    damping = [0.0, *(DISPLACED * w * radiation(w * w * RADIUS / GRAVITY)[1] for w in omega[1:])]
    fine = np.linspace(0.0, 4.0 * LAST, 100_001)
    beyond = damping[-1] * (np.maximum(fine, LAST) / LAST) ** -7.0  # the damping's asymptote
    every = np.where(fine <= LAST, CubicSpline(omega, damping)(np.minimum(fine, LAST)), beyond)
    return np.array([2.0 / math.pi * np.trapezoid(every * np.cos(fine * t), fine) for t in times])


def decay(kernel: np.ndarray, step: float, restoring: Callable[[float], float]) -> np.ndarray:
    """Heights by the trapezoidal rule, in motion and convolution."""
    inertia, count = MASS + 0.5 * DISPLACED, len(kernel)
    z, v, a = np.zeros((3, count))
    z[0], a[0] = DROP, -restoring(DROP) / inertia
    for i in range(1, count):
        past, speed = step * (kernel[1:i] @ v[i - 1 : 0 : -1]), v[i - 1] + step * a[i - 1]
        for _ in range(6):
            z[i] = z[i - 1] + 0.5 * step * (v[i - 1] + speed)
            a[i] = -(restoring(z[i]) + past + 0.5 * step * kernel[0] * speed) / inertia
            speed = v[i - 1] + 0.5 * step * (a[i - 1] + a[i])
        v[i] = speed
    return z


def extremes(kernel: np.ndarray, step: float, restoring: Callable[[float], float]) -> np.ndarray:
    """Times and heights of the first three, by Richardson's extrapolation."""
    heights = (4.0 * decay(kernel, step, restoring)[::2] - decay(kernel[::2], 2.0 * step, restoring)) / 3.0
    curve = CubicSpline(2.0 * step * np.arange(len(heights)), heights)
    turns = [t for t in curve.derivative().roots(extrapolate=False) if t > step][:3]
    return np.array([turns, curve(turns)]).T


def write(name: str, head: str, columns: str, rows: list[str]) -> None:
    """A table with what it is."""
    lines = [*(f"# {line}" for line in head.splitlines()), columns, *rows]
    (Path(__file__).parent / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def main() -> None:
    """Write both tables."""
    numbers = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.4, 2.0, 2.5, 3.0)
    write(
        "hemisphere",
        "Radiation of a hemisphere that heaves in deep water: wavenumber times radius, added mass over displaced\n"
        "mass, damping over displaced mass and frequency. Multipoles (Hulme, 1982, J. Fluid Mech. 121), converged\n"
        "to 1e-6, with the four digits of his table; made by assets/validation/make_hemisphere.py",
        "ka,added_mass,damping",
        [f"{ka:g},{mass:.6f},{damping:.6f}" for ka in numbers for mass, damping in [radiation(ka)]],
    )
    step = 0.005
    kernel, stiffness = memory(step * np.arange(1401)), math.pi * DENSITY * GRAVITY * RADIUS**2
    theories = {
        "linear": lambda z: stiffness * z,
        "restoring": lambda z: stiffness * (z - z**3 / (3.0 * RADIUS**2)) + (MASS - DISPLACED) * GRAVITY,
    }
    write(
        "hemisphere_decay",
        "Decay of a sphere of radius 5 m, 261.8 t, half in water of 1000 kg/m3, g 9.81 m/s2, from 1 m: extremes,\n"
        "time [s], height [m]. Cummins' equation with the kernel of the damping in hemisphere.csv and A(inf) of half\n"
        "the displaced mass; linear: stiffness rho g pi R^2; restoring: buoyancy of the sphere that is wet. Trapezes\n"
        "and Richardson's extrapolation, to 1e-6 m; made by assets/validation/make_hemisphere.py",
        "theory,extreme,time,height",
        [
            f"{theory},{name},{time:.5f},{height:.6f}"
            for theory, restoring in theories.items()
            for name, (time, height) in zip(
                ("first trough", "first crest", "second trough"), extremes(kernel, step, restoring), strict=True
            )
        ],
    )


if __name__ == "__main__":
    main()
