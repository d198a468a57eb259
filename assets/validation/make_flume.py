"""Makes the section of the report's flume, its radiation and diffraction, and flume.csv, which has what was measured.

    python assets/validation/make_flume.py DATA

DATA is the folder of the runs as CSV, or CSV.gz: `data` at commit 2465cee (CC0, K. R. Sundsdal, NTNU) of
github.com/KRSundsdal1/2D-ship-cross-section-in-regular-waves; Sundsdal, Greco, Hanssen and Lugni (2025).

Measured: a run begins when the first harmonic at probe 1 would have been half of the wave's amplitude, less half of the
ramp of five periods and the way from the wavemaker at the group's speed. The window is whole periods, ten at most, that
end when the wave reflected by the beach comes back to the model, after the ramp has reached it. The wave's amplitude is
the mean of probes 4 and 6 without the model. Scatter is the root of the sum of squares of half the difference of these
probes, half the range of repetitions, of the halves of the window, and of the camera and the accelerometers. Roll is
over the wave's slope, moments are about the centre of gravity, LEVER below the transducer, and the mean force, that on
the rig, is over rho g a^2 L / 2.

Theory: linear, in two dimensions and 1 m of water. Green's theorem with sources ln r and their images in the bottom, on
panels of the section, of the water's surface and of two walls, through which waves leave.
"""

import csv
import gzip
import json
import math
import sys
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh

from vrx_mj.adapters.hydro import FORMAT, _complex_lists, _memory, _nested_lists
from vrx_mj.adapters.pole_fit import fitted_memory

FOLDER = Path(__file__).parent
ROBOT = FOLDER / "worlds" / "flume_section"
FloatArray, ComplexArray = npt.NDArray[np.float64], npt.NDArray[np.complex128]

GRAVITY, DENSITY, WATER = 9.81, 1000.0, 1.0
LENGTH, BEAM, DEPTH, BILGE = 0.586, 0.40, 0.256, 0.0512
MASS, GYRATION, CENTER = 46.8, 0.144, 0.106  # [kg], [m], height of the centre of gravity over the keel [m]
DRAFT = (MASS / (DENSITY * LENGTH) + (2.0 - 0.5 * math.pi) * BILGE**2) / BEAM  # 2.6 mm more than was measured
RIG_MASS, RIG_DAMPING, SPRINGS = 0.303, 8.70, 59.4  # in sway; damping in heave, too
ROLL_DAMPING = 0.15  # fitted to the roll that was measured at 1.238 s
PERIODS = (1.516, 1.269, 1.238, 1.210, 1.183, 1.158, 1.113, 1.072, 1.036, 0.897, 0.802, 0.733, 0.678, 0.634)
HEIGHTS = {1: 0.024, 2: 0.04}
SEEN = 1e-4  # least motion of a run that the camera saw [m], [rad]
WAY = 12.0  # of the wave that the beach reflects, from the model back to it [m]
ARM = 0.130  # of the accelerometers of heave off the centre line [m]
UNIT = 0.5 * DENSITY * GRAVITY * LENGTH
LEVER = (
    0.2236  # of the transducer over the centre of gravity: median, 0.2231 to 0.2255, of moment over force less theory's
)
FREQUENCIES, ANGLES, TOWARD, AGAINST = np.linspace(3.5, 14.0, 22), 8, 2, 6
MOTIONS = [1, 2, 3]  # sway, heave and roll among the six
URDF = """<robot name="{name}">
  <link name="base_link">
    <inertial><mass value="{mass}"/><inertia ixx="{0:.6g}" iyy="{1:g}" izz="{2:g}" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision name="hull"><geometry><mesh filename="section.obj"/></geometry></collision>
  </link>
  <link name="sway_link"/>
  <joint name="sway_joint" type="fixed">
    <origin rpy="0 0 1.5707963"/><parent link="base_link"/><child link="sway_link"/>
  </joint>
  <link name="heave_link"/>
  <joint name="heave_joint" type="fixed">
    <origin rpy="0 -1.5707963 0"/><parent link="base_link"/><child link="heave_link"/>
  </joint>
</robot>
"""


def wavenumber(omega: float) -> float:
    """Of waves of a frequency [rad/s] in the flume's water [1/m]."""
    k = omega**2 / GRAVITY
    for _ in range(50):
        tanh = math.tanh(k * WATER)
        k -= (GRAVITY * k * tanh - omega**2) / (GRAVITY * (tanh + k * WATER * (1.0 - tanh**2)))
    return k


def group_speed(omega: float) -> float:
    """Of waves of a frequency [m/s]."""
    k = wavenumber(omega)
    return 0.5 * omega / k * (1.0 + 2.0 * k * WATER / math.sinh(2.0 * k * WATER))


def outline(top: float, points: int) -> FloatArray:
    """Corners (n, 2) of the section below `top` [m], y and z over the water, from its right edge to its left one."""
    side, keel = 0.5 * BEAM, -DRAFT
    turn = np.linspace(0.0, 0.5 * math.pi, points // 2 + 1)[1:-1]
    arc = np.stack((side - BILGE + BILGE * np.cos(turn), keel + BILGE - BILGE * np.sin(turn)), axis=1)
    down = np.linspace((side, top), (side, keel + BILGE), points)
    half = np.concatenate((down, arc, np.linspace((side - BILGE, keel), (0.0, keel), points)))
    return np.concatenate((half, half[-2::-1] * (-1.0, 1.0)))


class Section:
    """The section between walls through which waves leave."""

    def __init__(self, points: int = 30, far: float = 3.0, surface: int = 300, wall: int = 40) -> None:
        """Panels of each half of a side and of the keel, distance of the walls [m], panels of each surface and wall."""
        depths = WATER * np.linspace(1.0, 0.0, wall + 1) ** 2
        body, up = outline(0.0, points), np.stack((np.full(wall + 1, far), -depths), axis=1)
        free = np.linspace((far, 0.0), (0.5 * BEAM, 0.0), surface + 1)
        mirrored = np.array((-1.0, 1.0))
        lines = up, free, body, free[::-1] * mirrored, up[::-1] * mirrored
        start, end = (np.concatenate([line[part] for line in lines]) for part in (slice(-1), slice(1, None)))
        kind = np.repeat(np.arange(5), [len(line) - 1 for line in lines])
        self.wall, self.surface, self.body = np.isin(kind, (0, 4)), np.isin(kind, (1, 3)), kind == 2
        self.middle, image = 0.5 * (start + end), np.array((1.0, -1.0))
        own, mirror = (
            self._integrals(start, end),
            self._integrals(*(each * image - (0, 2 * WATER) for each in (end, start))),
        )
        np.fill_diagonal(own[1], 0.0)
        self.source, self.dipole = own[0] + mirror[0], own[1] + mirror[1]
        along = (end - start)[self.body]
        self.width = np.linalg.norm(along, axis=1)
        y, z = self.middle[self.body].T
        ny, nz = -along[:, 1] / self.width, along[:, 0] / self.width  # into the water
        self.modes = np.stack((ny, nz, y * nz - (z - CENTER + DRAFT) * ny), axis=1)

    def _integrals(self, start: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Integrals (n, m) of ln r / 2 pi over panels, and of its derivative along their outward normals."""
        length = np.linalg.norm(end - start, axis=1)
        along = (end - start) / length[:, None]
        arm = self.middle[:, None] - start
        x, y = (arm * along).sum(axis=-1), arm[..., 0] * along[:, 1] - arm[..., 1] * along[:, 0]
        left, turn = x - length, np.arctan2(y, x - length) - np.arctan2(y, x)
        logs = 0.5 * (x * np.log(x**2 + y**2) - left * np.log(left**2 + y**2))
        return (logs - length + y * turn) / (2.0 * math.pi), -turn / (2.0 * math.pi)

    def potentials(self, omega: float, velocities: ComplexArray) -> ComplexArray:
        """Potentials (panels, n) of normal velocities (body's panels, n) of the section, in e^(-i omega t)."""
        system = 0.5 * np.eye(len(self.middle)) - self.dipole + 0.0j
        if math.isinf(omega):
            system[:, self.surface] = self.source[:, self.surface]
        else:
            system[:, self.surface] += self.source[:, self.surface] * omega**2 / GRAVITY
            system[:, self.wall] += self.source[:, self.wall] * 1j * wavenumber(omega)
        return np.asarray(np.linalg.solve(system, self.source[:, self.body] @ velocities), np.complex128)

    def loads(self, potentials: ComplexArray) -> ComplexArray:
        """Integrals (3, n) of potentials at the section's panels over sway, heave and roll, times -rho."""
        return np.asarray(-DENSITY * (self.modes * self.width[:, None]).T @ potentials, np.complex128)

    def far(self, omega: float, potentials: ComplexArray, velocities: ComplexArray) -> ComplexArray:
        """Complex amplitudes (2, n) of the waves that leave to the right and to the left, by Green's theorem."""
        found = []
        for sign in (1.0, -1.0):
            back, slope = self.wave(omega, -sign)
            flux = self.width @ (potentials[self.body] * slope[:, None] - back[:, None] * velocities)
            found.append(-0.5j * omega / (GRAVITY * group_speed(omega)) * flux)
        return np.array(found)

    def wave(self, omega: float, sign: float) -> tuple[ComplexArray, ComplexArray]:
        """Potential on the section, and its slope into the water, of a wave of 1 m to the right (1) or left (-1)."""
        k, (y, z) = wavenumber(omega), self.middle[self.body].T
        value = -1j * GRAVITY / omega * np.cosh(k * (z + WATER)) / math.cosh(k * WATER) * np.exp(1j * sign * k * y)
        slope = 1j * sign * k * self.modes[:, 0] * value + k * np.tanh(k * (z + WATER)) * self.modes[:, 1] * value
        return value, slope

    def forces(self, omega: float) -> tuple[FloatArray, FloatArray, ComplexArray, ComplexArray, ComplexArray]:
        """Forces per metre of length, and the waves to the right and to the left.

        Returns:
            Added mass and damping (3, 3); of a wave of 1 m to the right its undisturbed pressure and what it scatters
            (2, 3); waves (2, 3) that unit motions make, and (2,) that the wave and what it scatters are.
        """
        moved = self.modes + 0.0j
        made = self.potentials(omega, moved)
        force = 1j * omega * self.loads(made[self.body])
        value, slope = self.wave(omega, 1.0)
        scattered = self.potentials(omega, -slope[:, None])
        waves = 1j * omega * self.loads(np.stack((value, scattered[self.body, 0]), axis=1))
        passing = self.far(omega, scattered, -slope[:, None])[:, 0] + (1.0, 0.0)
        symmetric = 0.5 * (force + force.T)
        return symmetric.imag / omega, -symmetric.real, waves.T, -1j * omega * self.far(omega, made, moved), passing


def mean_force(omega: float, made: ComplexArray, passing: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Coefficients a (4,) and b (3, 3) of the mean sway force, as `vrx_mj.adapters.hydro.mean_drift` has them."""
    size = LENGTH * DENSITY * GRAVITY * group_speed(omega) * wavenumber(omega) / (2.0 * omega)
    (right, left), (through, back) = made, passing
    linear = 2.0 * (back.conjugate() * left - through.conjugate() * right)
    steady = 1.0 + abs(back) ** 2 - abs(through) ** 2
    return size * np.array([steady, *linear]), size * (np.outer(left.conj(), left) - np.outer(right.conj(), right))


def table(section: Section) -> dict[str, object]:
    """The content of the robot's file; waves along the flume alone are in it."""
    n = len(FREQUENCIES)
    added, damping, forces = np.zeros((n, 6, 6)), np.zeros((n, 6, 6)), np.zeros((n, ANGLES, 6), np.complex128)
    linear, quadratic = np.zeros((n, ANGLES, 3, 7), np.complex128), np.zeros((n, 3, 6, 6), np.complex128)
    own, mirror = np.ix_(MOTIONS, MOTIONS), np.array((-1.0, 1.0, -1.0))
    for index, omega in enumerate(FREQUENCIES.tolist()):
        a, b, waves, made, passing = section.forces(omega)
        added[index][own], damping[index][own], waves = LENGTH * a, LENGTH * b, LENGTH * waves
        forces[index, TOWARD, MOTIONS], forces[index, AGAINST, MOTIONS] = waves[1], waves[1] * mirror
        drift, quadratic[index, 1][own] = mean_force(omega, made, passing)
        linear[index, TOWARD, 1, [0, *(1 + np.array(MOTIONS))]] = drift
        linear[index, AGAINST, 1, [0, *(1 + np.array(MOTIONS))]] = drift * (-1.0, *-mirror)
    added[:, 1, 1] += RIG_MASS
    infinite = np.zeros((6, 6))
    infinite[own] = section.loads(section.potentials(math.inf, section.modes + 0.0j)[section.body]).real
    infinite = LENGTH * 0.5 * (infinite + infinite.T)
    infinite[1, 1] += RIG_MASS
    return {
        "format": FORMAT,
        "program": "assets/validation/make_flume.py",
        "density": DENSITY,
        "gravity": GRAVITY,
        "point": [0.0, 0.0, 0.0],
        "displacement": MASS,
        "waterline": DRAFT - CENTER,
        "frequencies": FREQUENCIES.tolist(),
        "added_mass": _nested_lists(added),
        "damping": _nested_lists(damping),
        "added_mass_infinite": _nested_lists(infinite),
        **_memory(fitted_memory(FREQUENCIES, added, damping, infinite)),
        "diffraction": _complex_lists(forces),
        "drift_scattered": _complex_lists(linear),
        "drift_radiated": _complex_lists(quadratic),
    }


def write_robot(section: Section) -> None:
    """Write the section's mesh, its file, and what it weighs, free and with its roll held."""
    ROBOT.mkdir(exist_ok=True)
    (ROBOT / "hydro.json").write_text(json.dumps(table(section)) + "\n", encoding="utf-8")
    ring = np.add(outline(DEPTH - DRAFT, 8), (0.0, DRAFT - CENTER))
    n, ends = len(ring), (0.5 * LENGTH, -0.5 * LENGTH)
    points = [(x, y, z) for x in ends for y, z in (*ring, (0.0, ring[0, 1] - 0.1))]
    faces = []
    for i, j in ((i, (i + 1) % n) for i in range(n)):
        faces += [(j, i, n), (i, j, i + n + 1), (j, j + n + 1, i + n + 1), (i + n + 1, j + n + 1, 2 * n + 1)]
    mesh = trimesh.Trimesh(points, faces, process=False)
    mesh.fix_normals()
    lines = [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in mesh.vertices] + [
        f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces
    ]
    (ROBOT / "section.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
    for name, inertia in (("section", (MASS * GYRATION**2, 1.6, 1.9)), ("held", (1e5, 1e5, 1e5))):
        (ROBOT / f"{name}.urdf").write_text(URDF.format(*inertia, name=name, mass=MASS), encoding="utf-8")


def theory(section: Section, omega: float, *, held: bool) -> tuple[FloatArray, float]:
    """Sizes (6,) of the forces of a wave of 1 m on the fixed section and of its motions on the rig; the mean force."""
    added, damping, waves, made, passing = section.forces(omega)
    area = MASS / (DENSITY * LENGTH)
    corner = (1.0 - 0.25 * math.pi) * BILGE**2, (0.5 - math.pi / 4.0 + 1.0 / 3.0) * BILGE**3  # cut off, and its moment
    buoyancy = (0.5 * BEAM * DRAFT**2 - 2.0 * corner[1]) / area
    metacentric = buoyancy + BEAM**3 / (12.0 * area) - CENTER
    inertia = np.diag((MASS + RIG_MASS, MASS, 1e9 if held else MASS * GYRATION**2)) + LENGTH * added
    stiffness = np.diag((SPRINGS, DENSITY * GRAVITY * LENGTH * BEAM, MASS * GRAVITY * metacentric))
    resisted = LENGTH * damping + np.diag((RIG_DAMPING, RIG_DAMPING, ROLL_DAMPING))
    force = LENGTH * waves.sum(axis=0)
    motions = np.linalg.solve(stiffness - omega**2 * inertia - 1j * omega * resisted, force)
    linear, quadratic = mean_force(omega, made, passing)
    mean = (linear @ np.array([1.0, *motions]) + motions.conj() @ quadratic @ motions).real
    sizes = np.abs(np.concatenate((force, motions)))
    sizes[5] /= wavenumber(omega)
    return sizes, float(mean) / UNIT


def fixed_mean(section: Section, omega: float) -> float:
    """The mean force on the fixed section."""
    return float(mean_force(omega, *section.forces(omega)[3:])[0][0].real) / UNIT


class Run:
    """A run: its columns, wave, and windows."""

    def __init__(self, path: Path) -> None:
        raw = path.read_bytes()
        head, *rows = csv.reader((gzip.decompress(raw) if path.suffix == ".gz" else raw).decode().splitlines())
        self.name = path.name.split(".")[0]
        self.series, self.number, self.height = self.name[0], int(self.name[1:3]), HEIGHTS[int(self.name[3])]
        self.columns = dict(zip((each.split(" [")[0] for each in head), np.array(rows, float).T, strict=True))
        self.period = PERIODS[self.number - 1]
        self.omega, self.times = 2.0 * math.pi / self.period, self.columns["Time"]
        self.speed = group_speed(self.omega)
        begins = self._start() + 7.0 / self.speed
        self.until = begins + WAY / self.speed
        self.count = min(max(int((self.until - begins) / self.period - 5.0), 1), 10)
        self.rest = self.times < begins - 6.0 / self.speed

    def _start(self) -> float:
        """When the wavemaker starts [s]."""
        middles = np.arange(self.times[0] + self.period, self.times[-1] - self.period, 0.1)
        sizes = [abs(self._fit("WP_1", middle + 0.5 * self.period, 1)[1]) for middle in middles.tolist()]
        after = int(np.argmax(np.array(sizes) > 0.25 * self.height))
        share = (0.25 * self.height - sizes[after - 1]) / (sizes[after] - sizes[after - 1])
        return float(middles[after - 1] + 0.1 * share - 2.5 * self.period - 3.0 / self.speed)

    def _fit(self, column: str, until: float, periods: int) -> tuple[float, complex]:
        """Mean and first harmonic in e^(-i omega t) of a column over periods."""
        chosen = (self.times >= until - periods * self.period) & (self.times < until)
        phase = self.omega * self.times[chosen]
        basis = [np.ones(phase.size), phase - phase.mean(), *(f(n * phase) for n in (1, 2) for f in (np.cos, np.sin))]
        found = np.linalg.lstsq(np.stack(basis, axis=1), self.columns[column][chosen], rcond=None)[0]
        return float(found[0]), complex(found[2], found[3])

    def windows(self) -> Iterator[tuple[float, int]]:
        """End and number of periods of the window, and of its halves."""
        half = self.count // 2
        yield self.until, self.count
        if half:
            yield from ((self.until - half * self.period, half), (self.until, half))

    def harmonic(self, kind: str, until: float, periods: int) -> list[complex]:
        """Complex amplitude of a quantity over the window, or parts of it, by each instrument."""
        sides = ("ACC_Heave_SB", "ACC_HEAVE_PS", "ACC_SWAY")
        starboard, port, across = (self._fit(side, until, periods)[1] / -(self.omega**2) for side in sides)
        by_camera = self._fit(kind.capitalize(), until, periods)[1]
        found = [by_camera] if abs(by_camera) > SEEN else []
        if kind == "heave":
            found.append(0.5 * (starboard + port))
        elif kind == "roll":
            found.append((starboard - port) / (2.0 * ARM))
        elif self.series == "4":
            found.append(across)  # it feels roll as well
        return found

    def mean(self, column: str, until: float, periods: int) -> float:
        """Mean of a column over periods, less that before the waves came."""
        return self._fit(column, until, periods)[0] - float(self.columns[column][self.rest].mean())

    def values(self, kind: str, amplitude: float) -> list[list[float]]:
        """A quantity by each instrument, over the window and its halves, over the wave's amplitude [m]."""
        found = []
        for until, periods in self.windows():
            if kind == "mean force":
                column = "Fy" if self.series == "2" else "Force_Sway"
                sign = 1.0 if self.series == "2" else -1.0
                found.append([sign * self.mean(column, until, periods) / (UNIT * amplitude**2)])
            elif self.series == "2":
                sway, heave, moment = (self._fit(column, until, periods)[1] for column in ("Fy", "Fz", "Mx"))
                force = {"sway": sway, "heave": heave, "roll": moment - LEVER * sway}[kind]
                found.append([abs(force) / amplitude])
            else:
                slope = wavenumber(self.omega) if kind == "roll" else 1.0
                found.append([abs(each) / (slope * amplitude) for each in self.harmonic(kind, until, periods)])
        return found


def wave_amplitudes(runs: list[Run]) -> dict[tuple[int, float], tuple[float, float]]:
    """Amplitude [m] at the model by period and height, and half the difference of its probes as a share."""
    found = {}
    for run in runs:
        probes = [abs(run._fit(probe, run.until, run.count)[1]) for probe in ("WP_4", "WP_6")]
        mean = 0.5 * sum(probes)
        found[run.number, run.height] = mean, 0.5 * abs(probes[0] - probes[1]) / mean
    return found


def measured(runs: list[Run], kind: str, amplitude: float, uncertain: float) -> tuple[float, float]:
    """Mean of a quantity over repetitions and instruments, and its scatter."""
    by_run = [values for run in runs if (values := run.values(kind, amplitude))[0]]
    wholes = [each for values in by_run for each in values[0]]
    value = float(np.mean(wholes))
    halves = [np.ptp([np.mean(part) for part in values[1:]]) for values in by_run if len(values) > 1]
    repeated = np.ptp([np.mean(values[0]) for values in by_run])
    apart = max(np.ptp(values[0]) for values in by_run)
    wave = uncertain * abs(value) * (2.0 if kind == "mean force" else 1.0)
    scatter = math.hypot(wave, 0.5 * repeated, 0.5 * max(halves, default=0.0), 0.5 * apart)
    return value, scatter


HEAD = """\
# A section of a ship in beam waves of a flume: amplitudes of forces [N, N m] on it while it is held, per metre of the
# wave's amplitude, and of motions over that, of roll over the wave's slope; mean force over rho g a^2 L / 2. Sets:
# fixed, free in sway, heave and roll, roll_held. Measured by K. R. Sundsdal, NTNU, in {runs} runs, over `periods` up
# to `until` [s] after the waves have come; a band is twice the scatter to either side. Theory is linear, in two
# dimensions, steady. From github.com/KRSundsdal1/2D-ship-cross-section-in-regular-waves, commit 2465cee (CC0).
# Made by make_flume.py, which says how.
"""
SETS = {"2": "fixed", "3": "free", "4": "roll_held"}


def rows(section: Section, runs: list[Run]) -> Iterator[tuple[object, ...]]:
    """The rows of the table."""
    waves = wave_amplitudes([run for run in runs if run.series == "1"])
    others = sorted((run for run in runs if run.series in SETS), key=_condition)
    for (series, number, height), group in groupby(others, key=_condition):
        own = list(group)
        amplitude, uncertain = waves[number, height]
        sizes, mean = theory(section, own[0].omega, held=series == "4")
        if series == "2":
            mean = fixed_mean(section, own[0].omega)
        known = [*(sizes[:3] if series == "2" else sizes[3:]).tolist(), mean]
        for index, kind in enumerate(("sway", "heave", "roll", "mean force")):
            if (series, kind) != ("4", "roll"):
                value, scatter = measured(own, kind, amplitude, uncertain)
                figures = (f"{each:.4g}" for each in (value, scatter, known[index]))
                times = own[0].count, round(WAY / own[0].speed, 3), round(wavenumber(own[0].omega), 4)
                yield SETS[series], own[0].period, height, len(own), *times, f"{amplitude:.5f}", kind, *figures


def _condition(run: Run) -> tuple[str, int, float]:
    return run.series, run.number, run.height


def main(data: Path) -> None:
    """Write the robot, its table, and what was measured."""
    section = Section()
    write_robot(section)
    runs = [Run(path) for path in sorted(data.rglob("[1-4]*.csv*")) if path.name[3] in "12"]
    with (FOLDER / "flume.csv").open("w", encoding="utf-8", newline="") as file:
        file.write(HEAD.format(runs=len([run for run in runs if run.series in SETS])))
        writer = csv.writer(file, lineterminator="\n")
        columns = (
            "set",
            "period",
            "height",
            "runs",
            "periods",
            "until",
            "wavenumber",
            "amplitude",
            "quantity",
            "measured",
            "scatter",
            "theory",
        )
        writer.writerow(columns)
        writer.writerows(rows(section, runs))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
