"""Boats of profile `marine` whose propellers were measured: closed forms, states, and bad input."""

import json
import math
import re

import numpy as np
import pytest

from integration.sailing import same_bits
from vrx_mj import Batch, Simulation, compile_world
from vrx_mj.config.dynamics import PropellerConfig
from vrx_mj.errors import CommandError, ConfigError, UnknownNameError

URDF = """<robot name="barge"><link name="base_link">
<inertial><origin xyz="0 0 0"/><mass value="{mass}"/>
<inertia ixx="1500" iyy="6000" izz="7000" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="4 2 1"/></geometry></collision></link>
<link name="screw"/><joint name="engine" type="revolute"><parent link="base_link"/><child link="leg"/>
<origin xyz="-2 0.5 0"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="10" velocity="10"/></joint>
<link name="leg"/><joint name="shaft" type="fixed"><parent link="leg"/><child link="screw"/>
<origin xyz="-0.25 0 -0.4"/></joint>
<link name="blade"/><joint name="stock" type="revolute"><parent link="base_link"/><child link="blade"/>
<origin xyz="-2.6 0.5 -0.4"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="10" velocity="10"/></joint>
</robot>"""
CURVE = "[[-1, -100], [-0.4, -20], [0, 0], [0.3, 9], [0.5, 85], [1, 240]]"
PROPELLER = f"thrust: {CURVE}, diameter: 0.3"
BARGE, PLACE = "barge", (-2.25, 0.5, -0.4)
KEYS = ("thrust", "diameter", "vanishing_speed", "four_quadrant", "time_constant", "dead_zone", "power")
STEERED = "thrusters: {main: {mapping: linear, propeller: screw, joint: engine, timeout: 0}}\n"
NONE = "[0, 0, 0, 0, 0, 0]"
STILL = f"{{added_mass: {NONE}, damping_linear: {NONE}, damping_quadratic: {NONE}}}"


@pytest.fixture(autouse=True)
def _in_its_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def barge(tmp_path):
    """Simulations of a barge with an engine that steers; `propeller` are further keys of its propeller."""

    def made(propeller="", *, profile="marine", mass=4100.0, thrusters=STEERED, more="", hull=STILL, **keys):
        propellers = "" if propeller is None else f"propellers: {{main: {{{PROPELLER}{propeller}}}}}\n"
        (tmp_path / "barge.urdf").write_text(URDF.format(mass=mass), encoding="utf-8")
        (tmp_path / "barge.yaml").write_text(
            f"urdf: barge.urdf\nhull: {hull}\n{thrusters}{propellers}{more}", encoding="utf-8"
        )
        fleet = keys.pop("fleet", None)
        world = {"name": "bay", "physics": {"profile": profile}, "sea": {"model": "none"}, "wind": {"objects": []}}
        return Simulation(compile_world(world | {"spawn": {"robot": "./barge.urdf"}} | keys, fleet=fleet))

    return made


pytestmark = pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")


def thrust_of(sim):
    """Thrust that the next step gives, as its force [N]."""
    (boat,) = sim.boats
    return float(np.linalg.norm(sim.forces(boat)["thrust"][:3]))


@pytest.mark.parametrize(("command", "thrust"), [(1.0, 240.0), (0.4, 47.0), (-0.7, -60.0), (0.0, 0.0), (9.0, 240.0)])
def test_a_command_gives_the_measured_thrust(barge, command, thrust):
    sim = barge()
    (boat,) = sim.boats
    sim.step({boat: {"main": command}}, duration=sim.timestep)
    assert sim.thrust(boat)["main"] == pytest.approx(thrust)


def test_the_dead_zone_gives_exactly_nothing(barge):
    sim = barge(", dead_zone: 0.2")
    (boat,) = sim.boats
    for command, pushes in ((0.2, False), (-0.2, False), (0.21, True)):
        sim.step({boat: {"main": command}}, duration=sim.timestep)
        assert (sim.thrust(boat)["main"] != 0.0) == pushes


def test_speed_through_the_water_takes_thrust_in_a_straight_line(barge):
    for stream in (0.0, 0.5):
        sim = barge(", vanishing_speed: 4", current={"speed": stream})
        (boat,) = sim.boats
        sim.command(boat, main=1.0)
        for speed in (0.0, 1.0, 3.9, 5.0):
            sim.set_boat(boat, velocity=(speed, 0, 0, 0, 0, 0))
            assert thrust_of(sim) == pytest.approx(240.0 * np.clip(1.0 - (speed - stream) / 4.0, 0.0, 1.0))


@pytest.mark.parametrize("step", [30, 15, 1])
def test_rows_of_four_quadrants_may_be_as_far_apart_as_is_said(step):
    rows = [[angle, *[0.5 * math.cos(math.radians(angle))] * 2] for angle in range(-180, 181, step)]
    made = PropellerConfig.model_validate({"thrust": [[0, 0], [1, 9]], "diameter": 0.3, "four_quadrant": rows})
    assert len(made.four_quadrant) == 360 / step + 1


def test_a_four_quadrant_propeller_has_drag_at_rest_and_unloads_its_motor_at_speed(barge):
    """Held, C_T* at 90 degrees; at J = 0.5, polynomials of the B series (Oosterveld and van Oossanen, 1975)."""
    sim = barge(", four_quadrant: wageningen_b4_70, power: 2000", sea={"model": "none", "density": 1000.0})
    (boat,) = sim.boats
    sim.set_boat(boat, velocity=(2.0, 0, 0, 0, 0, 0))
    assert sim.forces(boat)["thrust"][0] == pytest.approx(-0.772 * 500.0 * 4.0 * math.pi * 0.15**2, rel=1e-3)
    rate = math.sqrt(240.0 / (0.4499 * 1000.0 * 0.3**4))
    sim.set_boat(boat, velocity=(0.5 * rate * 0.3, 0, 0, 0, 0, 0))
    sim.step({boat: {"main": 1.0}}, duration=sim.timestep)
    assert sim.thrust(boat)["main"] == pytest.approx(240.0 * 0.272 / 0.4547, rel=0.03)
    assert sim.energy(boat) == pytest.approx(2000.0 * sim.timestep * 0.435 / 0.6754, rel=0.05)


def test_the_speed_is_that_along_the_axis_as_it_is_steered(barge):
    sim = barge(", vanishing_speed: 4")
    (boat,) = sim.boats
    sim.step({boat: {"main": 1.0, "main_angle": 0.5}}, duration=3.0)
    angle = sim.steering(boat)["main"]
    sim.set_boat(boat, velocity=(1.0, 0.3, 0, 0, 0, 0.2))
    x, y = -2.0 - 0.25 * math.cos(angle), 0.5 - 0.25 * math.sin(angle)
    u, v = 1.0 - 0.2 * y, 0.3 + 0.2 * x
    advance = u * math.cos(angle) + v * math.sin(angle)
    assert angle == pytest.approx(0.5, abs=0.01)
    assert thrust_of(sim) == pytest.approx(240.0 * (1.0 - advance / 4.0), rel=1e-4)


def test_waves_move_the_water_at_the_propeller_and_over_it(barge):
    """Against the sea's own height and velocity, and the share of a disc under water by a sum over strips."""
    sim = barge(", vanishing_speed: 4", sea={"model": "regular", "height": 0.8, "period": 3.0})
    (boat,) = sim.boats
    sim.command(boat, main=1.0)
    strips = (np.arange(20_000) + 0.5) / 20_000 * 0.3 - 0.15
    widths = np.sqrt(0.15**2 - strips**2)
    seen = set()
    for _ in range(12):
        sim.step(duration=0.25)
        sim.set_boat(boat, pose=(0, 0, 0.25, 0, 0, 0), velocity=NO_VELOCITY)
        x, y, z = PLACE[0], PLACE[1], PLACE[2] + 0.25
        then = sim.time + sim.timestep
        stream = float(sim.sea.velocity(x, y, z, then - 0.5 * sim.timestep)[0])  # as its own velocity is
        depth = float(sim.sea.height(x, y, then)) - z
        wet = widths[strips < depth].sum() / widths.sum()
        assert thrust_of(sim) == pytest.approx(240.0 * wet * min(1.0 + stream / 4.0, 1.0), rel=1e-4, abs=1e-9)
        seen.add(round(wet, 1))
    assert {0.0, 1.0} < seen


NO_VELOCITY = (0.0,) * 6


@pytest.mark.parametrize(("lift", "share"), [(0.0, 1.0), (0.4, 0.5), (0.6, 0.0), (30.0, 0.0)])
def test_out_of_the_water_a_propeller_pushes_and_draws_nothing(barge, lift, share):
    sim = barge(", power: 2000")
    (boat,) = sim.boats
    sim.set_boat(boat, pose=(0, 0, lift, 0, 0, 0))
    sim.step({boat: {"main": 1.0}}, duration=sim.timestep)
    assert sim.thrust(boat)["main"] == pytest.approx(240.0 * share)
    assert sim.energy(boat) == pytest.approx(2000.0 * share * sim.timestep)


def test_thrust_lags_behind_its_command(barge):
    """T (1 - exp(-t / tau)), exact at any step; back at rest it is exactly 0 N in the end."""
    sim = barge(", time_constant: 0.5")
    (boat,) = sim.boats
    for time in (0.5, 1.0, 1.5):
        sim.step({boat: {"main": 1.0}}, duration=0.5)
        assert sim.thrust(boat)["main"] == pytest.approx(240.0 * (1.0 - math.exp(-time / 0.5)))
    sim.step({boat: {"main": 0.0}}, duration=0.5)
    assert sim.thrust(boat)["main"] == pytest.approx(240.0 * (1.0 - math.exp(-3.0)) * math.exp(-1.0))
    sim.step(duration=20.0)
    assert sim.thrust(boat)["main"] == 0.0


def test_energy_is_power_over_time_until_the_reset(barge):
    """At full thrust P, at a share s of it P s^1.5; with a lag the integral of P (1 - exp(-t / tau))^1.5."""
    sim = barge(", power: 2000")
    (boat,) = sim.boats
    sim.step({boat: {"main": 1.0}}, duration=3.0)
    assert sim.energy(boat) == pytest.approx(6000.0)
    sim.step({boat: {"main": 0.5}}, duration=2.0)
    assert sim.energy(boat) == pytest.approx(6000.0 + 4000.0 * (85.0 / 240.0) ** 1.5)
    sim.reset()
    assert sim.energy(boat) == 0.0
    lagging = barge(", power: 2000, time_constant: 0.5")
    lagging.step({boat: {"main": 1.0}}, duration=2.0)
    times = (np.arange(20_000) + 0.5) * 1e-4
    integral = 2000.0 * ((1.0 - np.exp(-times / 0.5)) ** 1.5).sum() * 1e-4
    assert lagging.energy(boat) == pytest.approx(integral, rel=5e-3)  # power at the ends of steps of 10 ms


def test_top_speed_is_where_drag_takes_the_thrust_that_is_left(barge):
    """T (1 - u / u0) = X u."""
    hull = f"{{added_mass: {NONE}, damping_linear: [60, 200, 2000, 2000, 6000, 2000], damping_quadratic: {NONE}}}"
    sim = barge(", vanishing_speed: 4", hull=hull)
    (boat,) = sim.boats
    sim.command(boat, main=1.0)
    sim.set_boat(boat, velocity=(2.0, 0, 0, 0, 0, 0))
    found = sim.forces(boat)
    assert found["thrust"][0] == pytest.approx(120.0, rel=1e-3)
    assert found["thrust"][0] + found["drag"][0] == pytest.approx(0.0, abs=0.1)


RESISTANCE = "[[0, 0], [1, 40], [2, 300], [3, 320]]"


def test_resistance_is_that_of_the_speed_through_the_water(barge):
    """Straight lines, the square beyond the last row, the same astern; no damping in surge besides."""
    hull = f"{{added_mass: {NONE}, resistance: {RESISTANCE}, point: [0, 0, 0]}}"
    sim = barge(hull=hull, current={"speed": 0.5})
    (boat,) = sim.boats
    for speed, force in ((0.0, 0.0), (0.5, 20.0), (1.5, 170.0), (2.5, 310.0), (6.0, 4.0 * 320.0), (-1.5, -170.0)):
        sim.set_boat(boat, velocity=(speed + 0.5, 0, 0, 0, 0, 0))
        drag = sim.forces(boat)["drag"]
        assert drag == pytest.approx([-force, *[0.0] * 5], abs=1e-6)


@pytest.mark.parametrize(
    ("hull", "message"),
    [
        (
            "resistance: [[0, 0], [1, 40], [2, 30]]",
            "resistance[2]: resistance must not decrease with speed, got 40 N at 1 m/s and 30 N at 2 m/s",
        ),
        ("resistance: [[1, 40], [2, 90]]", "resistance: a first row [0, 0] and another one are needed"),
        (
            "resistance: [[0, 0], [2, 40], [1, 90]]",
            "resistance[2]: a speed above 2 m/s, that of the previous row, is needed, got 1",
        ),
        (
            f"resistance: {RESISTANCE}, damping_quadratic: [18, 0, 0, 0, 0, 0]",
            "damping_quadratic: surge must be 0 with `resistance`, got 18",
        ),
    ],
)
def test_what_cannot_be_a_resistance(barge, hull, message):
    with pytest.raises(ConfigError) as error:
        barge(None, hull=f"{{{hull}}}")
    assert str(error.value).partition(": hull.")[2] == message


def test_looking_at_forces_changes_nothing(barge):
    sims = [barge(", time_constant: 0.5, power: 2000, vanishing_speed: 4") for _ in range(2)]
    for sim in sims:
        sim.step({sim.boats[0]: {"main": 1.0}}, duration=0.3)
    before = sims[0].forces(sims[0].boats[0])["thrust"]
    for sim in sims:
        sim.step(duration=sim.timestep)
    assert sims[0].get_state().sha256 == sims[1].get_state().sha256
    assert np.linalg.norm(before[:3]) == pytest.approx(sims[1].thrust(sims[1].boats[0])["main"], rel=1e-6)


def test_a_state_goes_on_to_the_last_bit(barge):
    keys = {"sea": {"model": "jonswap", "sea_state": 2}, "current": {"speed": 0.3, "var_gain": 0.1}}
    sim = barge(", time_constant: 0.5, power: 2000, vanishing_speed: 4", **keys)
    (boat,) = sim.boats
    sim.reset(seed=3)
    sim.step({boat: {"main": 1.0}}, duration=0.7)
    again = Simulation(sim.world)
    again.set_state(sim.get_state())
    assert again.energy(boat) == sim.energy(boat) > 0.0
    for each in (sim, again):
        each.step(duration=1.0)
    assert same_bits(again.data.qpos, sim.data.qpos)
    assert again.energy(boat) == sim.energy(boat)
    assert again.get_state().sha256 == sim.get_state().sha256
    batch = Batch(sim.world, 2)
    batch.reset(seed=2)
    batch.step(np.tile((1.0, 0.0), (2, 1)), duration=0.7)
    batch.step(duration=1.0)
    assert batch.energy(boat).shape == (2,)
    assert batch.energy(boat)[1] == sim.energy(boat)
    assert batch.get_state(1).sha256 == sim.get_state().sha256
    batch.reset([0], seed=5)
    assert (batch.energy(boat) > 0.0).tolist() == [False, True]


def test_a_saved_world_has_its_propellers(barge, tmp_path):
    world = barge(", power: 2000").world
    again = type(world).load(world.save(tmp_path / "bay"))
    assert again.parameters.thrusters == world.parameters.thrusters
    assert again.sha256 == world.sha256


@pytest.mark.parametrize("profile", ["vrx", "vrx3"])
def test_in_vrx_s_profiles_the_thruster_s_own_curve_acts(barge, profile):
    with_propeller, without = barge(", power: 2000", profile=profile).world, barge(None, profile=profile).world
    assert with_propeller.sha256 == without.sha256
    assert with_propeller.parameters.thrusters[0].measured is None


def test_a_boat_that_leaves_takes_only_its_own_propeller(barge):
    sim = barge(", time_constant: 5, power: 2000")
    (boat,) = sim.boats
    sim.spawn("second", pose=(20, 0, 0, 0, 0, 0))
    sim.spawn("third", pose=(40, 0, 0, 0, 0, 0))
    sim.step({"second": {"main": 0.5}, "third": {"main": 1.0}}, duration=0.5)
    before = sim.energy("third"), sim.thrust("third"), sim.energy(boat)
    sim.remove("second")
    assert (sim.energy("third"), sim.thrust("third"), sim.energy(boat)) == before
    assert before[2] == 0.0 < before[0]


def test_controllers_get_the_measured_curve(barge):
    own = next(iter(barge(", dead_zone: 0.1").observe().values())).thrusters["main"]
    assert (own.max_forward, own.max_reverse, own.max_command) == (240.0, -100.0, 1.0)
    assert [own.command(force) for force in (85.0, 0.0, -20.0)] == pytest.approx([0.5, 0.0, -0.4])


def test_energy_needs_a_power(barge):
    sim = barge()
    (boat,) = sim.boats
    message = (
        f"no energy for {boat}: none of its thrusters has a `power`; set it in the robot's `propellers`, which "
        f"only profile marine uses"
    )
    for each in (sim, Batch(sim.world, 2)):
        with pytest.raises(CommandError) as error:
            each.energy(boat)
        assert str(error.value) == message
        with pytest.raises(UnknownNameError) as unknown:
            each.energy("x")
        assert str(unknown.value) == f"no boat named 'x'; known: {boat}"


GAP = json.dumps([[-180, -1, -1], [-160, -1, -1], *([a, 1, 1] for a in range(-100, 180, 20)), [180, -1, -1]])


def quadrants(*rows):
    """A four-quadrant table with some other rows."""
    angles = np.arange(-180, 181, 30)
    own = {int(a): [int(a), *[round(math.cos(math.radians(a)), 3)] * 2] for a in angles}
    return json.dumps(sorted((own | {row[0]: list(row) for row in rows}).values()))


@pytest.mark.parametrize(
    ("propeller", "message"),
    [
        (
            f"{{{PROPELLER}, lag: 1}}",
            f"propellers.main.lag: unknown key 'lag'; allowed: {', '.join(KEYS)}",
        ),
        ("{diameter: 1}", "propellers.main.thrust: required, but missing"),
        ("{thrust: [[0, 0], [1, 9]]}", "propellers.main.diameter: required, but missing"),
        (
            "{thrust: [[0, 0], [0.5, 9], [0.4, 8]], diameter: 1}",
            "propellers.main.thrust[2]: a command above 0.5, that of the previous row, is needed, got 0.4",
        ),
        (
            "{thrust: [[0, 0], [0.5, 9], [0.5, 8]], diameter: 1}",
            "propellers.main.thrust[2]: a command above 0.5, that of the previous row, is needed, got 0.5",
        ),
        (
            "{thrust: [[0, 0], [1.5, 9]], diameter: 1}",
            "propellers.main.thrust[1][0]: must be at most 1, got 1.5",
        ),
        (
            "{thrust: [[0, 0], [0.5, -9]], diameter: 1}",
            "propellers.main.thrust[1]: a thrust of 0 or more is needed at command 0.5, got -9 N",
        ),
        (
            "{thrust: [[-1, 9], [0, 0]], diameter: 1}",
            "propellers.main.thrust[0]: a thrust of 0 or less is needed at command -1, got 9 N",
        ),
        (
            "{thrust: [[0, 3], [1, 9]], diameter: 1}",
            "propellers.main.thrust[0]: a thrust of 0 is needed at command 0, got 3 N",
        ),
        (
            "{thrust: [[0.3, 9], [1, 240]], diameter: 1}",
            "propellers.main.thrust: a row [0, 0] is needed: add it, and rows astern if it can push astern",
        ),
        (
            "{thrust: [[0, 0], [1, 0]], diameter: 1}",
            "propellers.main.thrust: a thrust other than 0 is needed: all are 0 N",
        ),
        ("{thrust: [[0, 0]], diameter: 1}", "propellers.main.thrust: 2 rows or more are needed, got 1"),
        (
            "{thrust: [[0, 0], [1, 9, 9]], diameter: 1}",
            "propellers.main.thrust[1]: expected 2 numbers [command, thrust], got [1, 9, 9]",
        ),
        ("{thrust: [[0, 0], [1, .nan]], diameter: 1}", "propellers.main.thrust[1][1]: must be finite, got nan"),
        (
            "{thrust: [[0, 0], [1, 1.0e+12]], diameter: 1}",
            "propellers.main.thrust[1][1]: must be at most 1000000000, got 1000000000000",
        ),
        (f"{{{PROPELLER}, vanishing_speed: 0}}", "propellers.main.vanishing_speed: must be at least 0.1, got 0"),
        (f"{{{PROPELLER}, time_constant: -1}}", "propellers.main.time_constant: must be at least 0, got -1"),
        (f"{{{PROPELLER}, dead_zone: 1}}", "propellers.main.dead_zone: must be below 1, got 1"),
        (f"{{{PROPELLER}, power: -5}}", "propellers.main.power: must be at least 0, got -5"),
        (
            f"{{{PROPELLER}, vanishing_speed: 4, four_quadrant: wageningen_b4_70}}",
            "propellers.main.four_quadrant: give vanishing_speed or four_quadrant, not both",
        ),
        (
            f"{{{PROPELLER}, four_quadrant: {GAP}}}",
            "propellers.main.four_quadrant[2]: rows at most 30 degrees apart are needed, got -160 and -100",
        ),
        (
            f"{{{PROPELLER}, four_quadrant: [[-90, 0, 0], [90, 0, 0]]}}",
            "propellers.main.four_quadrant: angles from -180 to 180 are needed, got -90 to 90",
        ),
        (
            f"{{{PROPELLER}, four_quadrant: {quadrants((-180, -2, -1))}}}",
            "propellers.main.four_quadrant: the same C_T* at -180 and 180 is needed, got -2 and -1",
        ),
        (
            f"{{{PROPELLER}, four_quadrant: {quadrants((0, -3, 1))}}}",
            "propellers.main.four_quadrant: C_T* above 0 at an angle of 0 and below 0 at 180 is needed, got -3 and -1",
        ),
        ("{thrust: [[0, 0], [1, 9]], diameter: 300}", "propellers.main.diameter: must be at most 20, got 300"),
        ("{thrust: [[0, 0], [1, 9]], diameter: -0.3}", "propellers.main.diameter: must be above 0, got -0.3"),
    ],
)
def test_what_cannot_be_a_propeller(barge, propeller, message):
    with pytest.raises(ConfigError) as error:
        barge(None, more=f"propellers: {{main: {propeller}}}\n")
    assert re.sub(r"^barge.yaml:4:\d+: ", "", str(error.value)) == message


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (f"propellers: {{port: {{{PROPELLER}}}}}\n", "propellers.port: no thruster named 'port'; known: main"),
        (
            f"rudders: {{aft: {{joint: engine, area: 1, aspect_ratio: 1}}}}\npropellers: {{aft: {{{PROPELLER}}}}}\n",
            "propellers.aft: not allowed for a rudder; remove it",
        ),
    ],
)
def test_propellers_of_nothing_that_pushes(barge, more, message):
    with pytest.raises(ConfigError) as error:
        barge(None, more=more)
    assert str(error.value).partition(": ")[2] == message


RUDDER = """rudders: {aft: {joint: stock, area: 0.1, aspect_ratio: 1, propeller: main, propeller_diameter: 0.3}}
thrusters: {main: {mapping: linear, propeller: screw, timeout: 0}}
"""


def test_a_rudder_is_in_the_race_of_the_thrust_that_is_left(barge):
    """Its force follows the measured propeller's: with the lag, and none once the propeller is in the air."""
    sim = barge(", time_constant: 0.5", thrusters="", more=RUDDER)
    (boat,) = sim.boats
    sim.step({boat: {"main": 1.0, "aft_angle": 0.3}}, duration=1.0)
    raced = sim.thrust(boat)
    sim.set_boat(boat, pose=(0, 0, 3.0, 0, 0, 0), velocity=NO_VELOCITY)
    sim.step(duration=sim.timestep)
    assert raced["aft"] > 10.0
    assert sim.thrust(boat) == pytest.approx({"main": 0.0, "aft": 0.0}, abs=0.01)


def test_a_rudder_works_in_the_water_that_carries_the_boat(barge):
    pushes = []
    for stream in (0.0, 0.8):
        sim = barge(thrusters="", more=RUDDER, current={"speed": stream, "direction": 90.0})
        (boat,) = sim.boats
        sim.step({boat: {"aft_angle": 0.3}}, duration=2.0)
        sim.set_boat(boat, pose=NO_VELOCITY, velocity=(1.5, stream, 0, 0, 0, 0))
        sim.step(duration=sim.timestep)
        pushes.append(sim.thrust(boat)["aft"])
    assert pushes[1] == pytest.approx(pushes[0], rel=1e-9)
    assert pushes[0] > 10.0


def test_an_engine_on_a_hinge_is_pushed_by_the_same_thrust(barge, tmp_path):
    (tmp_path / "fleet.yaml").write_text("robot: ./barge.urdf\nengines: hinged\n", encoding="utf-8")
    sim = barge(", vanishing_speed: 4", fleet="fleet.yaml")
    (boat,) = sim.boats
    sim.command(boat, main=1.0)
    sim.set_boat(boat, velocity=(1.0, 0, 0, 0, 0, 0))
    assert thrust_of(sim) == pytest.approx(180.0, rel=1e-6)
    sim.step(duration=sim.timestep)
    assert sim.thrust(boat)["main"] == pytest.approx(180.0, rel=1e-6)


def test_a_row_s_factor_of_thrust_is_of_the_measured_one(barge):
    sim = barge()
    batch = Batch(sim.world, 2)
    batch.vary(thrust=[1.0, 0.5])
    batch.step(np.tile((1.0, 0.0), (2, 1)), duration=0.01)
    ahead, half = batch.qpos[:, 0]
    assert half == pytest.approx(0.5 * ahead, rel=1e-6)
    assert ahead > 1e-6


def test_propellers_of_other_layouts_do_nothing(tmp_path):
    (tmp_path / "own.yaml").write_text(
        f"extends: wamv\npropellers: {{left: {{{PROPELLER}}}, left_front: {{{PROPELLER}}}}}\n", encoding="utf-8"
    )
    world = compile_world({"name": "bay", "physics": {"profile": "marine"}, "spawn": {"robot": "./own.yaml"}})
    measured = {row.name: row.measured for row in world.parameters.thrusters}
    assert set(measured) == {"left", "right", "lateral"}
    assert measured["left"].thrust == tuple(map(tuple, json.loads(CURVE)))
    assert measured["right"] == measured["lateral"] != measured["left"]  # the WAM-V's own
