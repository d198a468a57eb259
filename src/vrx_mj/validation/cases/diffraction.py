"""Forces of waves that a fixed hull scatters, in any heading."""

import math

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.reference import rows as table_rows
from vrx_mj.validation.rows import Outcome, at_most, case, near
from vrx_mj.validation.setups import packaged_simulation

_Amplitudes = npt.NDArray[np.complex128]
_PERIOD, _AMPLITUDE, _PHASES = 3.0, 0.01, 60
_PLACE = 1.7, -0.9
"""Place of the hull's origin [m]."""
_CENTER = -0.1
"""Place of its centre of mass, ahead of its origin [m]."""
_MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
_KINDS = ("diffraction", "froude_krylov")
_TURNS = np.exp(2j * math.pi * np.arange(_PHASES) / _PHASES)


def _reference() -> dict[tuple[float, float], _Amplitudes]:
    """Complex amplitudes (kinds, motions) by heading and by where the wave goes [degrees]."""
    found: dict[tuple[float, float], _Amplitudes] = {}
    for row in table_rows("diffraction"):
        course = row["heading"], row["toward"]
        forces = found.setdefault(course, np.zeros((len(_KINDS), len(_MOTIONS)), np.complex128))
        value = complex(row["real"], row["imaginary"])
        forces[_KINDS.index(row["kind"]), _MOTIONS.index(row["motion"])] = value
    return found


def _forces(heading: float, toward: float) -> FloatArray:
    """Forces (samples, kinds, motions) over a period on the hull, held, and as a third kind the wave's height."""
    along = [math.cos(math.radians(toward)), math.sin(math.radians(toward))]
    sea = {"model": "regular", "height": 2.0 * _AMPLITUDE, "period": _PERIOD, "direction": along, "density": 1025.0}
    sim, turn = packaged_simulation("bowed_box", sea=sea), math.radians(heading)
    (boat,) = sim.boats
    pose = [*_PLACE, 0.0, 0.0, 0.0, turn]
    found = np.zeros((_PHASES, 3, len(_MOTIONS)))
    for sample in range(_PHASES):
        sim.set_boat(boat, pose=pose, velocity=[0.0] * 6)
        forces = sim.forces(boat)
        found[sample, :2] = forces["diffraction"], forces["hydrostatics"]
        found[sample, 2] = _crest(sim, turn)
        sim.step(duration=_PERIOD / _PHASES)
    return found


def _crest(sim: Simulation, turn: float) -> float:
    """Height of the wave at the centre of mass, at the end of the step [m]."""
    x, y = _PLACE[0] + _CENTER * math.cos(turn), _PLACE[1] + _CENTER * math.sin(turn)
    return float(sim.sea.height(x, y, sim.time + sim.timestep))


@case("physics/radiation.py", "physics/vessel.py", "physics/panels.py", "adapters/hydro.py", table="diffraction")
def diffraction_headings() -> Outcome:
    """Diffraction forces on a fixed hull.

    assets/validation/worlds/bowed_box.yaml: a box with a bow, 4.5 m long, with its file of 36 directions and 12
    frequencies, in a regular wave of 3 s and 1 cm; the hull is put back before each of 60 samples over a period.
    First harmonics per metre of wave, in world axes about the centre of mass: amplitudes of what is above a tenth
    of the whole force or moment, and the difference of all three with their phases.
    """
    for (heading, toward), theirs in _reference().items():
        samples = _forces(heading, toward)
        swings = np.tensordot(_TURNS, samples, 1)  # of e^(-i omega t)
        ours = swings[:2] / swings[2, 0]
        course = f"heading {heading:g}, wave toward {toward:g} degrees"
        size = np.repeat([np.linalg.norm(theirs[0, :3]), np.linalg.norm(theirs[0, 3:])], 3)
        yield from (
            near(f"{motion}, {course}", "N/m" if i < 3 else "N m/m", abs(theirs[0, i]), abs(ours[0, i]), relative=0.02)
            for i, motion in enumerate(_MOTIONS)
            if abs(theirs[0, i]) > 0.1 * size[i]
        )
        for kind, label in enumerate(("diffraction", "Froude-Krylov")):
            for half, name in ((slice(0, 3), "force"), (slice(3, 6), "moment")):
                apart = np.linalg.norm(ours[kind, half] - theirs[kind, half]) / np.linalg.norm(theirs[kind, half])
                quantity = f"{label}, difference of the {name} over its size, with phase, {course}"
                yield at_most(quantity, "", 0.02, apart)
        if heading == 60.0:
            yield _chart(samples, theirs[0], course)


def _chart(samples: FloatArray, theirs: _Amplitudes, course: str) -> Chart:
    """Diffraction over a period, from the passage of a crest on."""
    first = int(samples[:, 2, 0].argmax())
    times = _PERIOD / _PHASES * np.arange(_PHASES)
    turn = np.exp(-2j * math.pi / _PERIOD * times)
    series: list[Series] = []
    for i in range(3):
        series.append(Series("Capytaine", times, _AMPLITUDE * (theirs[i] * turn).real, reference=True))
        series.append(Series(_MOTIONS[i], times, np.roll(samples[:, 0, i], -first)))
    return Chart(f"Diffraction of a wave of 1 cm, {course}", "time [s]", "force [N]", series)
