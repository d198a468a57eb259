"""Propellers and rudders: lag, losses, energy and four quadrants; the WAM-V 16, the Heron and the Otter under way."""

import math

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.case import (
    GRAVITY,
    Comparison,
    Outcome,
    case,
    folder,
    marine_simulation,
    one_boat,
    only_boat,
    packaged_simulation,
    record,
    rows,
)

_TANK = "propeller_tank"
_FULL, _DIAMETER, _VANISHING, _LAG, _POWER = 80.0, 0.2, 4.0, 0.5, 900.0
"""Thrust of full command [N], diameter [m], speed without thrust [m/s], time constant [s] and power [W]."""
_DRAG = 12.0, 18.0
"""Linear and quadratic drag ahead of the boat [N s/m, N s2/m2]."""
_DEPTH = 0.3
"""Depth of the propeller under the boat's origin [m]."""
_COMMANDS = {1.0: 80.0, 0.5: 20.0}
"""Thrust at rest by command [N]: numbers of the boat's file."""
_RATE = 25.0
"""Rate of the shaft at full thrust [1/s]; the thrust does not depend on which it is."""
_DENSITY = 1025.0
_FILES = ("physics/thrust.py", "runtime/loop.py")
_ADVANCES = {0.0: (0.4547, 0.06754), 0.2: (0.3919, 0.05942), 0.4: (0.3142, 0.04921), 0.6: (0.2256, 0.03727),
             0.8: (0.1297, 0.02397), 1.0: (0.0307, 0.00969)}  # fmt: skip
"""K_T and K_Q of B4-70 with a pitch ratio of 1 over the advance ratio, by the polynomials of the series."""
_QUADRANTS = {"robot": "propeller_boat/b4_70.yaml", "pose": [0] * 6, "sensors": "none"}
_HELD = {1.0: -0.772, -1.0: 0.695}
"""C_T* of a held one at 90 and at -90 degrees, by the sign of the speed: sums of the series' harmonics."""
_STREAM = 0.5, 0.64
"""Velocity of the stream [m/s]."""
_TOWARD = math.degrees(math.atan2(_STREAM[1], _STREAM[0]))
_SLOWEST, _FASTEST = 1.597, 1.667
"""Top speeds of the published model with 22 and with 24 N a side [m/s]."""
_DAMPING = 17.257603
"""Quadratic damping in surge of that model [N s2/m2]."""
_THRUSTS = {0.7: 16.0, 0.8: 19.5, 0.95: 23.0}
"""Thrust a side [N] at some commands, in assets/robots/heron/robot.yaml."""
_TOP = 0.95
"""The command of the thrust in the middle of those of the top speeds."""
_TABLE = [0.6, 1.2], [12.0, 39.0]
"""Speeds [m/s] and the resistance there [N] in the last two rows of heron_resistance."""
_MEASURED = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
_PULLS = (9.0, 53.0, 85.0, 120.0, 157.0, 182.0, 219.0, 240.0)
"""Measured bollard pull of a propeller at those commands [N]."""
_LAST = 0.3
"""Share of a run over which its speed is the mean."""
_KINGFISHERS = {
    "fitted to the odd runs": "kingfisher",
    "published bollard pull": str(folder() / "worlds" / "kingfisher_nps" / "robot.yaml"),
}
_THRUST = 0.02216 / 2.0
"""k of the thrust k n^2 of a propeller [N s2/rad2]."""
_FULL_THRUST = 119.682
"""Thrust of a propeller at full command [N], in assets/robots/otter/robot.yaml."""
_OTTER_TANK = "otter_tank"
_OTTER_FILES = ("mjcf/hulls.py", "physics/drag.py", "physics/vessel.py", "runtime/loop.py")
_SURGE_DAMPING = 24.4 * GRAVITY / (6.0 * 0.5144)
"""|X_u| [N s/m]: 24.4 kg of bollard pull at 6 knots."""
_PERIODS = {"heave": 0.680, "roll": 0.975, "pitch": 1.149}
"""Damped periods [s] of his M, D and G, the shortest first: make_otter.py has 0.6798, 0.9750 and 1.1486."""


def _thrust_at(sim: Simulation, command: float, *, height: float = 0.0, speed: float = 0.0) -> float:
    """Thrust [N] after one step of a boat that is put at a height [m] with a speed ahead [m/s]."""
    (boat,) = sim.boats
    sim.set_boat(boat, pose=(0.0, 0.0, height, 0.0, 0.0, 0.0), velocity=(speed, 0.0, 0.0, 0.0, 0.0, 0.0))
    sim.step({boat: {"propeller": command}}, duration=sim.timestep)
    return sim.thrust(boat)["propeller"]


def _run_with_thrust(command: float, **keys: object) -> Simulation:
    """A run whose propeller has got to the thrust of a command: within 2e-6."""
    sim = packaged_simulation(_TANK, **keys)
    sim.step({sim.boats[0]: {"propeller": command}}, duration=13.0 * _LAG)
    return sim


@case(*_FILES)
def propeller_lag() -> Outcome:
    """A propeller's lag and energy.

    assets/validation/worlds/propeller_tank.yaml: a boat that is reset before every step, with full command from
    time 0. Its propeller has 80 N at rest, a time constant of 0.5 s and 900 W.

    Reference: T (1 - e^(-t / tau)), and the integral of P (T / T_full)^1.5 by quadrature: power is proportional to the
    cube of the shaft speed, thrust to its square. Both sides use the numbers of the boat's file: the rows show
    that they act, not that a real propeller has them.
    """
    sim, until = packaged_simulation(_TANK), 4.0 * _LAG
    thrusts = [_thrust_at(sim, 1.0) for _ in range(round(until / sim.timestep))]
    for share in (0.5, 1.0, 2.0, 4.0):
        found = thrusts[round(share * _LAG / sim.timestep) - 1]
        yield Comparison(f"thrust after {share:g} time constants", "N", _FULL * -math.expm1(-share), found)
    energy = _POWER * quad(lambda t: (-math.expm1(-t / _LAG)) ** 1.5, 0.0, until)[0]
    yield Comparison("energy after 4 time constants", "J", energy, sim.energy(sim.boats[0]))
    times = sim.timestep * np.arange(1, len(thrusts) + 1)
    closed = Series("closed form", times, -_FULL * np.expm1(-times / _LAG), reference=True)
    lines = closed, Series("ours", times, thrusts)
    yield Chart("Thrust at rest after full command", "time [s]", "thrust [N]", lines)


def _open_water(thrust: float, speed: float) -> float:
    """Thrust [N] of rho D^4 n^2 (a - b J) at a speed [m/s], at the rate that gives a thrust [N] at rest."""
    a = _FULL / (_DENSITY * _DIAMETER**4 * _RATE**2)
    b = a * _RATE * _DIAMETER / _VANISHING
    rate = _RATE * math.sqrt(thrust / _FULL)
    return _DENSITY * _DIAMETER**4 * rate**2 * (a - b * speed / (rate * _DIAMETER))


@case("physics/conditions.py", *_FILES)
def propeller_speed() -> Outcome:
    """A propeller's thrust at speed.

    assets/validation/worlds/propeller_tank.yaml at full and at half command: reset to speeds of 0 to 1.5 m/s,
    and at rest in a current from ahead; then free in still water for 30 s.

    Reference: Open-water line T = rho D^4 n^2 (a - b J), J = u / (n D), with a and b of 80 N at rest and none at 4 m/s;
    the speed at which it equals the drag, 12 u + 18 u^2. Both sides use the numbers of the boat's file: the rows show
    that they act, not that a real propeller has them.
    """
    series, speeds = [], (0.0, 0.5, 1.0, 1.5)
    for command, thrust in _COMMANDS.items():
        still, stream = _run_with_thrust(command), _run_with_thrust(command, current={"speed": 1.0, "direction": 180.0})
        pulls = [_thrust_at(still, command, speed=each) for each in speeds]
        for each, pull in zip(speeds, pulls, strict=True):
            yield Comparison(f"thrust at {each:g} m/s, {thrust:g} N at rest", "N", _open_water(thrust, each), pull)
        name = f"thrust in a current of 1 m/s from ahead, {thrust:g} N at rest"
        yield Comparison(name, "N", _open_water(thrust, 1.0), _thrust_at(stream, command))
        series.append(Series("open-water line", speeds, [_open_water(thrust, each) for each in speeds], reference=True))
        series.append(Series(f"{thrust:g} N at rest", speeds, pulls, kind="points"))
    for command, thrust in _COMMANDS.items():
        root = brentq(lambda u, t=thrust: _open_water(t, u) - _DRAG[0] * u - _DRAG[1] * u * u, 0.0, _VANISHING)
        name = f"speed of the boat, {thrust:g} N at rest"
        sim = packaged_simulation(_TANK)
        sim.step({sim.boats[0]: {"propeller": command}}, duration=30.0)
        yield Comparison(name, "m/s", root, only_boat(sim).velocity[0])
    yield Chart("Thrust of the propeller", "speed through the water [m/s]", "thrust [N]", series)


def _wet_share(depth: float) -> float:
    """Share of a disc of radius 1 under water, its centre at a depth: the sum of its chords."""
    chords = quad(lambda z: 2.0 * math.sqrt(1.0 - z * z), -1.0, min(max(depth, -1.0), 1.0))[0]
    return float(chords) / math.pi


@case(*_FILES)
def propeller_ventilation() -> Outcome:
    """A propeller that comes out of the water.

    assets/validation/worlds/propeller_tank.yaml: the boat held at heights at which the propeller's centre is
    between 1.25 radii under the surface and as much above it, at full command.

    Reference: The submerged fraction of the disc, by quadrature of its chords. A real propeller draws down air, and
    so loses more thrust, and earlier.
    """
    sim, depths = _run_with_thrust(1.0), np.linspace(-1.25, 1.25, 11)
    shares = [_thrust_at(sim, 1.0, height=_DEPTH - 0.5 * _DIAMETER * depth) / _FULL for depth in depths.tolist()]
    for depth, share in zip(depths.tolist(), shares, strict=True):
        yield Comparison(f"share of the thrust, centre {depth:g} radii deep", "", _wet_share(depth), share)
    fine = np.linspace(-1.25, 1.25, 101)
    lines = (
        Series("chords of the disc", fine, [_wet_share(depth) for depth in fine.tolist()], reference=True),
        Series("ours", depths, shares, kind="points"),
    )
    yield Chart("Thrust of a propeller at the surface", "depth of its centre / radius", "share of the thrust", lines)


@case(*_FILES, "config/propellers.json")
def propeller_quadrants() -> Outcome:
    """A propeller in four quadrants.

    assets/validation/worlds/propeller_tank.yaml with propeller_boat/b4_70.yaml: a boat reset to speeds ahead, with a
    propeller of 80 N at rest and 900 W, 0.2 m across, with `four_quadrant: wageningen_b4_70`. Its shaft turns at the
    speed that gives 80 N. At advance ratios of 0 to 1: thrust and power, as K_T and K_Q; without a command, with the
    shaft locked, its drag at 2 m/s ahead and astern; and with full command in water from behind, J = -0.4, the thrust
    over that at rest.

    Reference: Ahead, the polynomials of the B series (Oosterveld, M. W. C., van Oossanen, P., 1975, Further
    computer-analyzed data of the Wageningen B-screw series, ISP 22, no. 251), another fit of the same tank's tests than
    the file's Fourier series (Roddy, R. F., Hess, D. E., Faller, W., 2006, NSWCCD-50-TR-2006/004). The others are
    sums of that series.
    """
    sim = _run_with_thrust(1.0, spawn=_QUADRANTS)
    density = sim.world.parameters.sea.density
    rest = _thrust_at(sim, 1.0)
    ratio = _ADVANCES[0.0][0] / rest
    rate = math.sqrt(rest / (0.4499 * density * _DIAMETER**4))
    (boat,), found = sim.boats, []
    for advance, (thrust, torque) in _ADVANCES.items():
        before = sim.energy(boat)
        pull = _thrust_at(sim, 1.0, speed=advance * rate * _DIAMETER)
        found.append(ratio * pull)
        power = (sim.energy(boat) - before) / sim.timestep / _POWER * _ADVANCES[0.0][1]
        yield Comparison(f"K_T at J = {advance:g}", "", thrust, found[-1])
        yield Comparison(f"10 K_Q at J = {advance:g}", "", 10.0 * torque, 10.0 * power)
    behind = _thrust_at(sim, 1.0, speed=-0.4 * rate * _DIAMETER) / rest
    yield Comparison("thrust at J = -0.4 over that at rest", "", 0.865, behind)
    still = packaged_simulation(_TANK, spawn=_QUADRANTS)
    head = 0.5 * density * 4.0 * math.pi * (0.5 * _DIAMETER) ** 2
    for way, coefficient in _HELD.items():
        name = f"C_T* of the held propeller, {'ahead' if way > 0.0 else 'astern'}"
        yield Comparison(name, "", coefficient, _thrust_at(still, 0.0, speed=2.0 * way) / head)
    thrusts = [thrust for thrust, _ in _ADVANCES.values()]
    lines = Series("polynomials", list(_ADVANCES), thrusts, reference=True), Series("ours", list(_ADVANCES), found)
    yield Chart("K_T of B4-70, pitch ratio 1", "J", "K_T", lines)


@case("physics/thrust.py", "physics/conditions.py", "runtime/effects.py")
def rudder_stream() -> Outcome:
    """A rudder in a stream.

    Robot skiff at 1 m/s through the water, its propeller at 0.6 and its rudder at 0.3 rad, for 60 s: in still water,
    and in a current of 0.81 m/s, which carries it along. Then its rudder over the water.

    Reference: Galileo's principle: the motion through the water is the same, and the paths differ by that of the
    stream. In air the water exerts no force on a rudder.
    """
    paths, fleet = [], one_boat("skiff")
    currents = {(0.0, 0.0): {"speed": 0.0}, _STREAM: {"speed": math.hypot(*_STREAM), "direction": _TOWARD}}
    sims = {velocity: marine_simulation(fleet, current=current) for velocity, current in currents.items()}
    for (east, north), sim in sims.items():
        sim.set_boat("a", velocity=(1.0 + east, north, 0.0, 0.0, 0.0, 0.0))
        times, places = record(sim, lambda sim: only_boat(sim).position[:2], 60, 1.0, propeller=0.6, rudder_angle=0.3)
        paths.append(places - np.outer(times, (east, north)))
    (still, stream), sim = paths, sims[_STREAM]
    yield Comparison("distance between the paths, less the stream's", "m", None, np.abs(stream - still).max())
    sim.set_boat("a", pose=(0.0, 0.0, 3.0, 0.0, 0.0, 0.0), velocity=(2.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    sim.step(duration=sim.timestep)
    yield Comparison("force of the rudder 3 m over the water", "N", 0.0, abs(sim.thrust("a")["rudder"]))
    lines = (
        Series("still water", still[:, 0], still[:, 1], reference=True),
        Series("in the stream", stream[:, 0], stream[:, 1]),
    )
    yield Chart("Path through the water", "x [m]", "y [m]", lines)


@case("physics/thrust.py", "physics/vessel.py", "runtime/loop.py")
def heron_speed() -> Outcome:
    """Speed of the Heron.

    Robot heron in still water and still air, from rest, with both jets at three commands for 10 s.

    Reference: Batista, L. F. W. et al. (2024), A Deep Reinforcement Learning Framework and Methodology for Reducing
    the Sim-to-Real Gap in ASV Navigation, IROS: the identified damping in surge, with which 22 to 24 N a side give
    1.597 to 1.667 m/s; below that 2 T = d u^2. The robot's file has that model's damping and thrusts: the rows show
    that it moves accordingly. They are not measured speeds.
    """
    sim = marine_simulation(one_boat("heron"))
    edges = [Series("published top speeds", [0.0, 10.0], [speed] * 2, reference=True) for speed in (_SLOWEST, _FASTEST)]
    series = []
    for command, thrust in _THRUSTS.items():
        sim.reset()
        times, speeds = record(sim, lambda sim: only_boat(sim).velocity[0], 100, 0.1, left=command, right=command)
        if command == _TOP:
            yield Comparison(f"top speed, {thrust:g} N a side", "m/s", None, speeds[-1])
        else:
            reference = math.sqrt(2.0 * thrust / _DAMPING)
            yield Comparison(f"speed, {thrust:g} N a side", "m/s", reference, speeds[-1])
        series.append(Series(f"{thrust:g} N a side", times, speeds))
    yield Chart("Speed of the Heron", "time [s]", "speed [m/s]", (*edges, *series))


@case("physics/drag.py", "physics/vessel.py", "runtime/loop.py")
def hull_resistance() -> Outcome:
    """Speed of a hull with a table of resistance.

    assets/validation/worlds/heron_resistance: robot heron with `resistance` in place of its damping in surge, in still
    water and still air, from rest, with both jets at three commands for 30 s.

    Reference: The speed at which the table's resistance equals the thrust of both jets, interpolated linearly, and
    beyond the last row proportional to the square of the speed.
    """
    sim = marine_simulation(one_boat(str(folder() / "worlds" / "heron_resistance" / "robot.yaml")))
    for command, thrust in _THRUSTS.items():
        sim.reset()
        sim.step({"a": {"left": command, "right": command}}, duration=30.0)
        beyond = max(2.0 * thrust / _TABLE[1][-1], 1.0)
        speed = np.interp(2.0 * thrust, *_TABLE[::-1]) * math.sqrt(beyond)
        yield Comparison(f"speed, {thrust:g} N a side", "m/s", speed, only_boat(sim).velocity[0])


def _pull(sim: Simulation, command: float) -> float:
    """Half the force ahead [N] that both propellers put on a boat at rest, by how its centre of mass is accelerated."""
    sim.reset()
    sim.step({}, duration=20.0)
    pose = sim.data.qpos[:3].tolist()
    seen = only_boat(sim)
    sim.set_boat(sim.boats[0], pose=[*pose, seen.roll, seen.pitch, seen.heading], velocity=[0.0] * 6)
    sim.step({sim.boats[0]: {"left": command, "right": command}}, duration=sim.timestep)
    hull, after = sim.world.parameters.hulls[0], only_boat(sim)
    assert hull.vessel is not None
    center = np.cross(after.angular_velocity, hull.body_com) + after.velocity
    whole = float(sim.model.body_subtreemass[sim.model.body(hull.body).id]) + hull.vessel.added_mass[0][0]
    return 0.5 * whole * float(center[0]) / sim.timestep


@case("physics/thrust.py", "runtime/loop.py", "mjcf/hulls.py")
def wamv_bollard() -> Outcome:
    """Bollard pull of the WAM-V 16.

    Robot wamv floats in still water for 20 s, and is then set to rest; both propellers get a command for one step. The
    pull is its mass with added mass times the acceleration of its centre of mass. The robot's table of
    thrust consists of these measurements: the rows show that they act on the boat.

    Reference: Sarda, E. I., Qu, H., Bertaska, I. R., von Ellenrieder, K. D. (2016), Station-keeping control of an
    unmanned surface vehicle exposed to current and wind disturbances, Ocean Engineering 127: one propeller.
    """
    sim = marine_simulation(one_boat("wamv"))
    ours = [_pull(sim, command) for command in _MEASURED]
    for command, pull, own in zip(_MEASURED, _PULLS, ours, strict=True):
        yield Comparison(f"pull at command {command:g}", "N", pull, own)
    lines = Series("measured", _MEASURED, _PULLS, reference=True), Series("ours", _MEASURED, ours)
    yield Chart("Bollard pull of a WAM-V 16", "command", "pull of a propeller [N]", lines)


@case("physics/thrust.py", "physics/vessel.py", "runtime/loop.py", table="lake_runs")
def heron_lake() -> Outcome:
    """Speeds of a Kingfisher on a lake.

    Robot kingfisher in still water and still air: each run starts at its measured speed and has its final commands,
    for the same time; the speed is the mean of the last 30 %. Its thrust is fitted to the odd runs, and tested on the
    even ones. For comparison the same boat with the published thrust, not fitted to any run.

    Reference: How commands changed within a run is not known, so times to 63 % of a change are not compared.
    """
    measured = [row["speed_end_m_s"] for row in rows("lake_runs")]
    commands = [row["port_command_end"] for row in rows("lake_runs")]
    series = [Series("measured, odd runs", commands[::2], measured[::2], kind="points", reference=True)]
    series.append(Series("measured, even runs", commands[1::2], measured[1::2], kind="points", reference=True))
    for name, robot in _KINGFISHERS.items():
        speeds = _lake_speeds(robot)
        even = np.subtract(speeds, measured)[1::2]
        yield Comparison(
            f"speed, root mean square difference, even runs, {name}", "m/s", None, np.sqrt(np.mean(even**2))
        )
        for run in range(1, len(measured), 2) if robot == "kingfisher" else ():
            yield Comparison(f"speed of run {run + 1}", "m/s", measured[run], speeds[run])
        series.append(Series(name, commands, speeds, kind="points"))
    yield Chart("Speeds on the lake", "command", "speed [m/s]", series)


def _lake_speeds(robot: str) -> list[float]:
    """Speed over the last part of each run [m/s]."""
    sim = marine_simulation(one_boat(robot, sensors="none"))
    found = []
    for row in rows("lake_runs"):
        sim.reset()
        sim.set_boat("a", velocity=(row["speed_at_start_m_s"], 0.0, 0.0, 0.0, 0.0, 0.0))
        command = {"left": row["port_command_end"], "right": row["starboard_command_end"]}
        sim.step({"a": command}, duration=(1.0 - _LAST) * row["duration_s"])
        begin = only_boat(sim).position[0]
        sim.step({"a": command}, duration=_LAST * row["duration_s"])
        found.append(float(only_boat(sim).position[0] - begin) / (_LAST * row["duration_s"]))
    return found


def _periods(stiffness: FloatArray, damping: FloatArray) -> list[float]:
    """Damped periods [s] of accelerations by pose (6, 6) and by velocity (6, 6), the shortest first."""
    system = np.block([[np.zeros((6, 6)), np.eye(6)], [stiffness, damping]])
    return sorted(math.tau / value.imag for value in np.linalg.eigvals(system) if value.imag > 1e-3)


def _accelerations(sim: Simulation, pose: FloatArray, velocity: FloatArray) -> FloatArray:
    """Accelerations (6,) of the boat's own velocities in one step."""
    sim.reset()
    sim.set_boat(sim.boats[0], pose=pose.tolist(), velocity=velocity.tolist())
    sim.advance(1)
    seen = only_boat(sim)
    return (np.concatenate((seen.velocity, seen.angular_velocity)) - velocity) / sim.timestep


@case(*_OTTER_FILES)
def otter_periods() -> Outcome:
    """Free motions of the Otter.

    Robot otter in assets/validation/worlds/otter_tank.yaml, a hull of matrices (hydrostatics: matrix) at rest.
    Accelerations in one step from poses 0.1 mm or mrad aside and from velocities of 0.1 mm/s or mrad/s make the
    linear system; its damped periods are those of its eigenvalues: of heave and pitch coupled with surge, and of
    roll coupled with sway and yaw.

    Reference: Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, and his otter.py of the Python
    Vehicle Simulator (commit 61a8f41): mass, added mass, damping and stiffness by its formulas, computed independently.
    Eigenvalues of M, D and G about rest without trim, with the payload 0.05 m ahead of midships and a time constant of
    1 s in sway. Earlier versions of it have the payload amidships and no damping in sway: 0.681, 0.975 and 1.136 s.
    """
    sim, step, still = packaged_simulation(_OTTER_TANK), 1e-4, np.zeros(6)
    by_pose, by_velocity = np.zeros((6, 6)), np.zeros((6, 6))
    for axis in range(6):
        aside = step * np.eye(6)[axis]
        by_pose[:, axis] = (_accelerations(sim, aside, still) - _accelerations(sim, -aside, still)) / (2.0 * step)
        by_velocity[:, axis] = (_accelerations(sim, still, aside) - _accelerations(sim, still, -aside)) / (2.0 * step)
    ours = _periods(by_pose, by_velocity)
    ours += [math.nan] * (len(_PERIODS) - len(ours))
    for (motion, reference), value in zip(_PERIODS.items(), ours, strict=False):
        yield Comparison(f"damped period of {motion}", "s", reference, value)


def _command(rate: float) -> float:
    """The command of the shipped robot that has the thrust k n^2 of a propeller at a rate n [rad/s]."""
    return _THRUST * rate**2 / _FULL_THRUST


@case(*_OTTER_FILES)
def otter_surge() -> Outcome:
    """Speeds of the Otter.

    Robot otter in assets/validation/worlds/otter_tank.yaml with both propellers at 60, 80 and 100 rad/s, 20 s from
    rest. The weight of the payload as an external force, with which the file trims the boat and pushes it ahead
    (1.118 m/s instead of 1.029), is left out: mass and stiffness have it already.

    Reference: Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, and his otter.py of the
    Python Vehicle Simulator (commit 61a8f41): mass, added mass, damping and stiffness by its formulas, computed
    independently. 2 k n^2 = |X_u| u.
    """
    sim, series = packaged_simulation(_OTTER_TANK), []
    for rate in (60.0, 80.0, 100.0):
        sim.reset()
        command = _command(rate)
        times, speeds = record(sim, lambda sim: only_boat(sim).velocity[0], 100, 0.2, left=command, right=command)
        reference = 2.0 * _THRUST * rate**2 / _SURGE_DAMPING
        yield Comparison(f"speed at {rate:g} rad/s", "m/s", reference, speeds[-1])
        series.append(Series("closed form", times[[0, -1]], [reference] * 2, reference=True))
        series.append(Series(f"{rate:g} rad/s", times, speeds))
    yield Chart("Speed of the Otter", "time [s]", "speed [m/s]", series)


@case("physics/drag.py", *_OTTER_FILES, table="otter_turn")
def otter_turn() -> Outcome:
    """Turn of the Otter.

    Robot otter in assets/validation/worlds/otter_tank.yaml from rest with its left propeller at 100 rad/s and its
    right one at 80, 60 s, without that external force and without the lag of propellers.
    """
    theirs = {column: np.array([row[column] for row in rows("otter_turn")]) for column in ("x", "y", "u", "v", "r")}
    sim = packaged_simulation(_OTTER_TANK)
    commands = {"left": _command(100.0), "right": _command(80.0)}
    _, path = record(sim, lambda sim: only_boat(sim).position * (1.0, -1.0, 1.0), 60, 1.0, **commands)
    seen, (u, v, r) = only_boat(sim), (theirs[column][-1] for column in "uvr")
    ours = seen.velocity[0], -seen.velocity[1], -seen.angular_velocity[2]
    yield Comparison("speed ahead", "m/s", u, ours[0])
    yield Comparison("speed to starboard", "m/s", v, ours[1])
    yield Comparison("rate of turn to starboard", "rad/s", r, ours[2])
    yield Comparison("radius", "m", math.hypot(u, v) / r, math.hypot(*ours[:2]) / ours[2])
    yield Comparison("farthest ahead", "m", theirs["x"].max(), path[:, 0].max())
    yield Comparison("farthest to starboard", "m", theirs["y"].max(), path[:, 1].max())
    lines = (
        Series("his equations", theirs["y"], theirs["x"], reference=True),
        Series("ours", path[:, 1], path[:, 0]),
    )
    yield Chart("Turn of the Otter", "transfer to starboard [m]", "advance [m]", lines)
