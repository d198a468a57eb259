"""Waves that hulls make and scatter, in whole simulations: against the equation of motion in frequency."""

import json
import math

import numpy as np
import pytest

from vrx_mj import Batch, Simulation, compile_world
from vrx_mj.config.dynamics import read_hydro
from vrx_mj.errors import ConfigError, VrxError, VrxWarning
from vrx_mj.mjcf.hulls import diffraction_of

G, RHO, MASS = 9.80665, 1025.0, 4100.0
URDF = f"""<robot name="barge"><link name="base_link">
<inertial><mass value="{MASS}"/><inertia ixx="1500" iyy="6000" izz="7000" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="4 2 1"/></geometry></collision></link></robot>"""
POLE, SHARE = -0.8 + 1.7j, 5000.0
"""Memory of heave: a s / ((s - p) (s - p*)), whose residue is a p / (i Im p)."""
INFINITE = np.diag((400.0, 1500.0, 3000.0, 900.0, 2500.0, 1800.0))
DRAG = 3000.0
"""Linear damping in heave [N s/m]."""
FORCE = -900.0 - 1400.0j
"""Diffraction in heave [N/m] at every frequency and angle."""
STEPS = 24
"""Frequencies of the file: 0.2 to 4.8 rad/s."""
QUIET = pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")


@pytest.fixture(autouse=True)
def _in_its_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def content(**changes):
    residue = SHARE * POLE / (1j * POLE.imag)
    residues = np.zeros((1, 6, 6, 2))
    residues[0, 2, 2] = residue.real, residue.imag
    forces = np.zeros((STEPS, 12, 6, 2))
    forces[:, :, 2] = FORCE.real, FORCE.imag
    none = np.zeros((STEPS, 6, 6)).tolist()
    return {
        "format": 1, "program": "by hand", "density": RHO, "gravity": G, "point": [0.0, 0.0, 0.0],
        "frequencies": (0.2 * np.arange(1, STEPS + 1)).tolist(), "added_mass": none, "damping": none,
        "added_mass_infinite": INFINITE.tolist(), "poles": [[POLE.real, POLE.imag]], "residues": residues.tolist(),
        "fit_error": 0.0, "diffraction": forces.tolist(),
    } | changes  # fmt: skip


def barge(folder, scatters=True, **changes):
    none = "[0, 0, 0, 0, 0, 0]"
    keys = f"hydro: barge.json, diffraction: {str(scatters).lower()}, damping_linear: [0, 0, {DRAG}, 0, 0, 0]"
    (folder / "barge.json").write_text(json.dumps(content(**changes)), encoding="utf-8")
    (folder / "barge.urdf").write_text(URDF, encoding="utf-8")
    (folder / "barge.yaml").write_text(
        f"urdf: barge.urdf\nhull: {{{keys}, damping_quadratic: {none}}}\n", encoding="utf-8"
    )
    return "./barge.urdf"


def bay(robot, **keys):
    sea = keys.pop("sea", {"model": "none"})
    return compile_world(
        {"name": "bay", "physics": {"profile": "marine"}, "sea": sea, "spawn": {"robot": robot}} | keys
    )


def heave(sim, seconds):
    found = []
    for _ in range(round(seconds / 0.05)):
        sim.step(duration=0.05)
        found.append((sim.time, sim.data.qpos[0], sim.data.qpos[2]))
    return np.array(found).T


def kernel(omega):
    at = 1j * omega
    return SHARE * at / ((at - POLE) * (at - POLE.conjugate()))


@QUIET
@pytest.mark.slow
@pytest.mark.parametrize("diffraction", [True, False])
def test_heave_in_regular_waves_is_that_of_the_equation_in_frequency(tmp_path, diffraction, subtests):
    """(C - w2 (m + A) + i w (K + D)) z = FK + F_D + i w D z_w; without F_D, (-w2 A + i w K) z_w takes its place.

    z_w is the water's heave at the depth of the centre of buoyancy, in the mean over the waterplane. With waves of
    e^(i (k x - w t)) i w is -i w, K its conjugate.
    """
    for period in (2.6, 3.4, 5.0):
        with subtests.test(period=period):
            height, omega = 0.02, 2.0 * math.pi / period
            sea = {"model": "regular", "height": height, "period": period}
            sim = Simulation(bay(barge(tmp_path, diffraction), sea=sea))
            times, along, found = heave(sim, 16.0 * period)
            late = slice(-round(4.0 * period / 0.05), None)
            k = omega**2 / G
            moving = np.exp(1j * (omega * times - k * along))  # it drifts a little
            z = 2.0 * np.mean((found * moving)[late]) / (0.5 * height)
            mean = math.sin(2.0 * k) / (2.0 * k)
            krylov = RHO * G * 8.0 * math.exp(-0.5 * k) * mean
            inert = -(omega**2) * INFINITE[2, 2] - 1j * omega * kernel(omega).conjugate()
            drag = -1j * omega * DRAG
            moved = FORCE if diffraction else inert * math.exp(-0.25 * k) * mean
            pushed = krylov + moved + drag * math.exp(-0.25 * k) * mean
            expected = pushed / (RHO * G * 8.0 - omega**2 * MASS + inert + drag)
            # forces are of the time at which a step ends, the pose of its start
            ahead = np.exp(-1j * omega * sim.timestep)
            # half a step's lag of the memory, and the box of waves is met within (k a)^5 / 1057: 0.2 % with 2.6 s
            assert z == pytest.approx(expected * ahead, abs=0.01 * abs(expected))


@QUIET
def test_a_state_remembers_the_waves_that_a_hull_made(tmp_path):
    sim = Simulation(bay(barge(tmp_path)))
    (boat,) = sim.boats
    sim.set_boat(boat, pose=(0, 0, 0.2, 0, 0, 0))
    sim.step(duration=1.0)
    state = sim.get_state()
    assert np.abs(sim.forces(boat)["radiation"][2]) > 100.0
    sim.step(duration=1.0)
    after = sim.get_state().sha256
    sim.set_state(state)
    sim.step(duration=1.0)
    assert sim.get_state().sha256 == after


@QUIET
def test_a_hull_that_is_put_elsewhere_has_made_no_waves(tmp_path):
    sim = Simulation(bay(barge(tmp_path)))
    (boat,) = sim.boats
    sim.step(duration=0.5)
    sim.set_boat(boat, velocity=(0, 0, 1.0, 0, 0, 0))
    sim.step(duration=1.0)
    sim.set_boat(boat, pose=(0, 0, 0, 0, 0, 0), velocity=(0,) * 6)
    assert sim.forces(boat)["radiation"] == pytest.approx(np.zeros(6), abs=1e-9)


@QUIET
def test_others_keep_their_memory_when_boats_come_and_go(tmp_path):
    robot = barge(tmp_path)
    sim = Simulation(bay(robot))
    (first,) = sim.boats
    sim.spawn("other", robot=robot, pose=(30, 0, 0, 0, 0, 0))
    sim.spawn("third", robot=robot, pose=(60, 0, 0, 0, 0, 0))
    for name, height in ((first, 0.1), ("other", 0.2), ("third", -0.1)):
        x, y = sim.observe()[name].position[:2]
        sim.set_boat(name, pose=(x, y, height, 0, 0, 0))
    sim.step(duration=0.8)
    before = sim.forces("third")["radiation"]
    sim.remove("other")
    assert sim.forces("third")["radiation"] == pytest.approx(before, rel=1e-12)


@QUIET
def test_batch_simulation_and_saved_world_are_bit_equal(tmp_path):
    sea = {"model": "jonswap", "significant_height": 0.2, "peak_period": 3.0, "components": 20}
    world = bay(barge(tmp_path), sea=sea, current={"speed": 0.2})
    batch, single = Batch(world, 2), Simulation(world)
    batch.reset(seed=4)
    batch.step(duration=1.0)
    single.reset(5)
    single.step(duration=1.0)
    assert batch.get_state(1).sha256 == single.get_state().sha256
    again = type(world).load(world.save(tmp_path / "bay"))
    assert again.parameters.hulls == world.parameters.hulls
    assert again.sha256 == world.sha256


@QUIET
def test_the_file_s_point_and_density_are_those_of_its_matrices(tmp_path):
    moved = bay(barge(tmp_path, point=[0.5, 0.0, -0.2], density=2050.0)).parameters.hulls[0].vessel
    a = np.array(moved.added_mass)
    assert np.diag(a)[:3] == pytest.approx(0.5 * np.diag(INFINITE)[:3])
    assert a[2, 4] == pytest.approx(-0.5 * 0.5 * 3000.0)  # pitching down lifts what is ahead: v_z = -q x
    heaving, pitching = moved.memory
    assert (heaving.motion, pitching.motion) == (2, 4)
    assert heaving.residue[4] == pytest.approx(-0.5 * heaving.residue[2])
    assert moved.diffraction.step == pytest.approx(0.1)
    first = moved.diffraction.forces[6][2]
    assert (first[2], first[8]) == pytest.approx((0.5 * FORCE.real, 0.5 * FORCE.imag))
    assert first[4] == pytest.approx(-0.5 * 0.5 * FORCE.real)
    assert moved.diffraction.forces[0] == ((0.0,) * 12,) * 12


@QUIET
@pytest.mark.parametrize("length", [3.2, 2.8])
def test_waves_shorter_than_the_box_push_as_they_do_at_each_point(tmp_path, length):
    """Pressure on a barge held in head waves shorter than its 4 m, which fade in the box: rho g B e^(-k T) sin(k L / 2)
    / (k / 2) in heave, in phase with the wave in the middle."""
    k = 2.0 * math.pi / length
    omega = math.sqrt(G * k)
    sea = {"model": "regular", "height": 0.02, "period": 2.0 * math.pi / omega}
    robot = barge(tmp_path, diffraction=np.zeros((STEPS, 12, 6, 2)).tolist())
    sim = Simulation(bay(robot, sea=sea))
    (boat,) = sim.boats
    sim.set_boat(boat, pose=(0, 0, 0, 0, 0, 0), velocity=(0,) * 6)
    forces, time = sim.forces(boat), sim.time + sim.timestep
    swing = 0.01 * math.cos(omega * time)
    expected = RHO * G * 2.0 * math.exp(-0.5 * k) * math.sin(2.0 * k) / (0.5 * k) * swing
    lifted = forces["hydrostatics"][2] + forces["diffraction"][2] - MASS * G
    # straight lines between the table's frequencies and angles, and on triangles of 0.5 m
    assert lifted == pytest.approx(expected, abs=0.02 * RHO * G * 8.0 * math.exp(-0.5 * k) * 0.01)


def test_diffraction_has_frequencies_of_its_own(tmp_path):
    barge(tmp_path, wave_frequencies=[1.0, 2.0, 3.0], diffraction=content()["diffraction"][:3])
    table = diffraction_of(read_hydro("barge.json", tmp_path), RHO)
    assert (table.step, len(table.forces)) == (pytest.approx(3.0 / 48), 49)


def test_diffraction_is_smooth_between_the_frequencies_of_a_file(tmp_path):
    """A force that turns by 0.6 rad at each of them: straight lines are 4.4 % off between."""
    omega = 0.2 * np.arange(1, STEPS + 1)
    force = omega**2 * np.exp(3j * omega)
    forces = np.zeros((STEPS, 12, 6, 2))
    forces[:, :, 2, 0], forces[:, :, 2, 1] = force.real[:, None], force.imag[:, None]
    barge(tmp_path, diffraction=forces.tolist())
    table = diffraction_of(read_hydro("barge.json", tmp_path), RHO)
    between = table.step * np.arange(2 * STEPS + 1)
    ours = np.array(table.forces)[:, 0, [2, 8]] @ (1.0, 1j)
    assert ours == pytest.approx(between**2 * np.exp(3j * between), abs=0.01 * 4.8**2)


@QUIET
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"displacement": 3000.0}, "displaces 3000 kg, but the boat has 4100 kg: more than 20% apart; "),
        ({"waterline": 0.15}, "the water at z = 0.15 m, but the boat's is at 0 m, with a draft of 0.5 m: "),
    ],
)
def test_a_file_of_another_hull_is_refused_with_both_numbers(tmp_path, changes, message):
    with pytest.raises(VrxError) as error:
        bay(barge(tmp_path, **changes))
    assert message in str(error.value)
    bay(barge(tmp_path, displacement=4000.0, waterline=0.02))


NO_DRIFT = np.zeros((3, 7, 2)).tolist()
NO_MOTION = np.zeros((3, 6, 6, 2)).tolist()
HOLES = content()["diffraction"]
HOLES[7][3][2][0] = None
ODD = INFINITE.copy()
ODD[0, 4] = 50.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"poles": [[0.1, 1.0]]}, "poles[0]: its real part must be below 0, or the memory grows; got 0.1+1i"),
        ({"diffraction": HOLES}, "diffraction[7][3][2][0]: expected a number, got nothing"),
        (
            {"diffraction": content()["diffraction"][:-1]},
            "diffraction: 24 frequencies of 8 angles or more are needed, got 23 of 12",
        ),
        (
            {"frequencies": [0.5, *content()["frequencies"][1:]]},
            "frequencies[1]: a frequency above 0.5 rad/s, that of the previous row, is needed, got 0.4",
        ),
        ({"frequencies": [0.0, *content()["frequencies"][1:]]}, "frequencies[0]: must be above 0, got 0"),
        (
            {"wave_frequencies": [0.5, *content()["frequencies"][1:]]},
            "wave_frequencies[1]: a frequency above 0.5 rad/s, that of the previous row, is needed, got 0.4",
        ),
        (
            {"wave_frequencies": [0.4, 0.5]},
            "diffraction: 2 frequencies of 8 angles or more are needed, got 24 of 12",
        ),
        (
            {"added_mass_infinite": ODD.tolist()},
            "added_mass_infinite: must be symmetric: [0][4] and [4][0] differ by 50",
        ),
        ({"poles": [[-2e6, 0.0]]}, "poles[0]: each part must be at most 1e+06 1/s in magnitude, got -2e+06+0i"),
        ({"density": 0.0}, "density: must be at least 1, got 0"),
        ({"gravity": "9,81"}, "gravity: expected a number, got '9,81'"),
        ({"format": 2}, "format: must be 1, got 2; `vrx-mj robot hydro --bem` writes such files"),
        ({"residues": [[1.0]]}, "residues[0][0]: expected a list, got 1"),
        ({"residues": []}, "residues: 1 are needed, got 0"),
        ({"point": "here"}, "point: expected a list, got 'here'"),
        (
            {"drift_scattered": [[NO_DRIFT] * 8] * STEPS, "drift_radiated": [NO_MOTION] * STEPS},
            "drift_scattered: 24 of 12 angles are needed, got 24 of 8",
        ),
        (
            {"drift_scattered": [[NO_DRIFT] * 12] * STEPS, "drift_radiated": [NO_MOTION]},
            "drift_radiated: 24 are needed, got 1",
        ),
    ],
)
def test_files_that_cannot_be(tmp_path, changes, message):
    with pytest.raises(ConfigError) as error:
        bay(barge(tmp_path, **changes))
    assert str(error.value).endswith(f"hull.hydro: hydro 'barge.json': {message}")


@QUIET
@pytest.mark.parametrize("diffraction", [True, False])
def test_damping_turns_with_the_water_only_without_diffraction(tmp_path, diffraction):
    robot = barge(tmp_path, diffraction)
    path = tmp_path / "barge.yaml"
    path.write_text(path.read_text(encoding="utf-8").replace(f"{DRAG}, 0, 0, 0]", "0, 800, 0, 0]"), encoding="utf-8")
    sea = {"model": "regular", "height": 0.4, "period": 4.0, "direction": [0, 1]}
    sim = Simulation(bay(robot, sea=sea))
    sim.step(duration=sim.timestep)
    assert (abs(sim.forces(sim.boats[0])["drag"][3]) < 1.0) == diffraction


@QUIET
@pytest.mark.parametrize(
    ("residue", "message"),
    [
        (-40_000.0, ("robot ./barge.urdf is unstable: a small motion about equilibrium grows at 0.145 1/s, with "
        "a period "
         "of 2.45 s; its wave memory adds energy: check the poles and residues of `hydro`")),
        (5e11, ("robot ./barge.urdf: its fastest motion about equilibrium is 8.39e+03 rad/s, which needs steps of "
         "2e-05 s; check the units of its hull, and the mass and inertia of its links")),
    ],
)  # fmt: skip
def test_memories_that_cannot_be(tmp_path, residue, message):
    """A kernel K = r e^(p t) with r < 0 gains energy; with a huge r the boat hangs on a spring of r."""
    residues = np.zeros((1, 6, 6, 2))
    residues[0, 2, 2, 0] = residue
    with pytest.raises(VrxError) as error:
        bay(barge(tmp_path, poles=[[-1.0, 0.0]], residues=residues.tolist()))
    assert str(error.value) == message


def lost(warned):
    """What is said of a file, not of a hull without one."""
    said = map(str, (warning.message for warning in warned))
    return [text for text in said if "of the sea's energy" in text and "waves shorter" not in text]


def test_a_sea_beyond_the_file_s_frequencies_is_said_once(tmp_path):
    """Of the components of equal energy, those from 4.8 rad/s on; once for boats of one kind, again for a newcomer."""
    sea = {"model": "jonswap", "significant_height": 0.2, "peak_period": 2.0, "components": 50}
    fleet = {"robot": barge(tmp_path), "usv_count": 2, "layout": "line", "spacing": 20}
    world = {"name": "bay", "physics": {"profile": "marine"}, "sea": sea, "spawn": {"robot": "./barge.urdf"}}
    with pytest.warns(VrxWarning) as warned:
        compiled = compile_world(world, fleet=fleet)
    share = np.mean([wave.frequency >= 4.8 for wave in compiled.parameters.sea.waves])
    assert 0.05 < share < 0.3
    message = (
        f"robot ./barge.urdf: {100.0 * share:.3g} % of the sea's energy is in waves beyond 4.8 rad/s, the last "
        "frequency of its `hydro`, shorter than 1.31 s: they are not scattered; compute it to higher frequencies, with "
        "more `--panels`"
    )
    assert lost(warned) == [message]
    sim = Simulation(compiled)
    with pytest.warns(VrxWarning) as warned:
        sim.spawn("late", robot="./barge.urdf", pose=(60, 0, 0, 0, 0, 0))
    assert lost(warned) == [message]


@pytest.mark.parametrize(("period", "count"), [(1.0, 1), (5.0, 0)])
def test_a_regular_wave_is_inside_or_outside(tmp_path, period, count):
    sea = {"model": "regular", "height": 0.05, "period": period}
    with pytest.warns(VrxWarning) as warned:
        bay(barge(tmp_path), sea=sea)
    assert [text.partition("%")[0] for text in lost(warned)] == ["robot ./barge.urdf: 100 "] * count
    with pytest.warns(VrxWarning) as warned:
        bay(barge(tmp_path, scatters=False), sea=sea)
    assert lost(warned) == []


@QUIET
@pytest.mark.slow
def test_a_long_swell_carries_a_hull_along_whose_waterplane_is_not_over_its_buoyancy():
    """Its trim in waves is that of the stiffness with which the missing mean was found: Stokes' drift is left."""
    spawn = {"robot": "wamv_hydro", "sensors": "none"}
    sim = Simulation(bay("wamv_hydro", sea={"model": "regular", "height": 2.48, "period": 20.0}, spawn=spawn))
    sim.step(duration=200.0)
    start = sim.data.qpos[0]
    sim.step(duration=400.0)
    omega = 2.0 * math.pi / 20.0
    assert (sim.data.qpos[0] - start) / 400.0 == pytest.approx(omega * omega**2 / G * 1.24**2, rel=0.3)
