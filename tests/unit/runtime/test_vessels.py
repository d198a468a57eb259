"""Hulls with a model of their own, in worlds of profile `marine`: closed forms of a barge, and bad input."""

import math

import numpy as np
import pytest
import trimesh

from vrx_mj import Batch, Simulation, compile_world
from vrx_mj.errors import ConfigError, VrxError, VrxWarning

G, RHO = 9.80665, 1025.0
URDF = """<robot name="barge"><link name="base_link">
<inertial><origin xyz="0 0 {kg}"/><mass value="{mass}"/>
<inertia ixx="1500" iyy="6000" izz="7000" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="4 2 1"/></geometry></collision></link></robot>"""
NONE = "[0, 0, 0, 0, 0, 0]"
STILL = f"{{added_mass: {NONE}, damping_linear: {NONE}, damping_quadratic: {NONE}}}"


@pytest.fixture(autouse=True)
def _in_its_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def barge(folder, hull=STILL, mass=4100.0, kg=0.0):
    """A barge 4 x 2 x 1 m whose origin is its middle, at the waterline with 4100 kg; KG is 0.5 m over its keel."""
    (folder / "barge.urdf").write_text(URDF.format(mass=mass, kg=kg), encoding="utf-8")
    (folder / "barge.yaml").write_text(f"urdf: barge.urdf\nhull: {hull}\n", encoding="utf-8")
    return "./barge.urdf"


def world_of(robot, profile="marine", **keys):
    sea = keys.pop("sea", {"model": "none"})
    return compile_world({"name": "bay", "physics": {"profile": profile}, "sea": sea, "spawn": {"robot": robot}} | keys)


def loads(sim, pose, names=("hydrostatics",)):
    (boat,) = sim.boats
    sim.set_boat(boat, pose=pose)
    forces = sim.forces(boat)
    return np.sum([forces[name] for name in names], axis=0)


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
class TestMesh:
    def test_the_stiffness_of_a_barge(self, tmp_path):
        """C33 = rho g A, C44 = rho g (I_T + V (z_B - z_G)), C55 = rho g (I_L + V (z_B - z_G)), at KG 0.5 m."""
        sim = Simulation(world_of(barge(tmp_path)))
        step = 1e-3
        rates = [
            -(loads(sim, step * axis)[i] - loads(sim, -step * axis)[i]) / (2.0 * step)
            for i, axis in zip((2, 3, 4), np.eye(6)[2:5], strict=True)
        ]
        stiffness = 8.0, 8.0 * 4.0 / 12.0 - 4.0 * 0.25, 8.0 * 16.0 / 12.0 - 4.0 * 0.25
        assert rates == pytest.approx([RHO * G * value for value in stiffness], rel=1e-3)
        assert loads(sim, np.zeros(6)) == pytest.approx((0, 0, 4100.0 * G, 0, 0, 0), abs=1e-6)

    @pytest.mark.parametrize(
        ("direction", "force", "side"), [((1.0, 0.0), 14_052.0, 0), ((0.0, 1.0), None, 1), ((0.0, -1.0), None, 1)]
    )
    def test_froude_krylov_forces_on_a_fixed_barge(self, tmp_path, direction, force, side):
        """Per metre of a wave of 3 s: heave rho g A e^(-k d) sinc(k l / 2), and the ends' pressure (Airy)."""
        height, k = 0.02, (2.0 * math.pi / 3.0) ** 2 / G
        sea = {"model": "regular", "height": height, "period": 3.0, "direction": direction}
        sim = Simulation(world_of(barge(tmp_path), sea=sea))
        (boat,) = sim.boats
        found = []
        for _ in range(60):
            sim.set_boat(boat, pose=(0, 0, 0, 0, 0, 0))
            found.append(sim.forces(boat)["hydrostatics"])
            sim.step(duration=0.05)
        turn = np.exp(2j * math.pi * np.arange(60) / 60)
        per_metre = 2.0 / 60.0 * np.abs(turn @ np.array(found)) / (height / 2.0)
        long, wide = (4.0, 2.0) if direction[0] else (2.0, 4.0)
        heave = RHO * G * 8.0 * math.exp(-0.5 * k) * math.sin(0.5 * k * long) / (0.5 * k * long)
        push = 2.0 * RHO * G * wide * math.sin(0.5 * k * long) * (1.0 - math.exp(-0.5 * k)) / k
        assert heave == pytest.approx(56_088.0 if direction[0] else 62_204.0, rel=1e-3)
        assert per_metre[2] == pytest.approx(heave, rel=5e-3)
        assert per_metre[side] == pytest.approx(push, rel=5e-3)
        if force:
            assert push == pytest.approx(force, rel=1e-3)

    def test_a_barge_heaves_with_its_period(self, tmp_path):
        """2 pi sqrt((m + A33) / C33) of small heave without damping, which keeps its height."""
        hull = f"{{added_mass: [0, 0, 3000, 0, 0, 0], damping_linear: {NONE}, damping_quadratic: {NONE}}}"
        sim = Simulation(world_of(barge(tmp_path, hull)))
        (boat,) = sim.boats
        sim.set_boat(boat, pose=(0, 0, 0.05, 0, 0, 0))
        heights = []
        for _ in range(2000):
            sim.step(duration=0.01)
            heights.append(sim.data.qpos[2])
        heights = np.array(heights)
        up = np.flatnonzero((heights[:-1] < 0.0) & (heights[1:] >= 0.0))
        crossings = 0.01 * (up - heights[up] / (heights[up + 1] - heights[up]))
        period = 2.0 * math.pi * math.sqrt(7100.0 / (RHO * G * 8.0))
        assert np.diff(crossings).mean() == pytest.approx(period, rel=2e-3)
        assert heights[-200:].max() == pytest.approx(0.05, rel=0.02)

    @pytest.mark.parametrize("strips", [1, 20])
    def test_drag_across_slows_a_boat(self, tmp_path, strips):
        """(m + A22) v' = -k v|v| with k = rho / 2 C_d T L: v = v0 / (1 + k v0 t / (m + A22))."""
        across = f"crossflow: {{stern: -2, bow: 2, draft: 0.5, coefficient: 0.9, strips: {strips}, height: 0}}"
        hull = f"{{added_mass: [0, 3000, 0, 0, 0, 0], damping_linear: {NONE}, damping_quadratic: {NONE}, {across}}}"
        sim = Simulation(world_of(barge(tmp_path, hull)))
        (boat,) = sim.boats
        sim.set_boat(boat, pose=(0, 0, 0, 0, 0, 0), velocity=(0, 1.2, 0, 0, 0, 0))
        sim.step(duration=5.0)
        k = 0.5 * RHO * 0.9 * 0.5 * 4.0
        assert sim.data.qvel[1] == pytest.approx(1.2 / (1.0 + k * 1.2 * 5.0 / 7100.0), rel=2e-3)
        assert sim.data.qvel[[0, 5]] == pytest.approx(0.0, abs=1e-9)

    def test_a_skeg_is_a_wing_in_the_stream(self, tmp_path):
        """A boat held in 0.5 m/s from the quarter: rho / 2 A 6.13 L / (L + 2.25) U2 sin at 45 degrees, at its place."""
        hull = f"{{damping_linear: {NONE}, skegs: [{{x: -1.5, z: -0.3, area: 0.2, aspect_ratio: 0.5}}]}}"
        sim = Simulation(world_of(barge(tmp_path, hull), current={"speed": 0.5, "direction": 45.0}))
        found = loads(sim, (0, 0, 0, 0, 0, 0), ("drag",))
        force = 0.5 * RHO * 0.2 * 6.13 * 0.5 / 2.75 * 0.25 * math.sqrt(0.5)
        assert (found[1], found[5]) == pytest.approx((force, -1.5 * force))

    def test_drag_across_takes_the_current_and_its_place_in_the_water(self, tmp_path):
        """A boat held in a current of 0.5 m/s from the side; at half the draft under the water at rest by default."""
        across = "crossflow: {stern: -1, bow: 2, draft: [0.2, 0.4], coefficient: [1.0, 2.0, 1.0]}"
        hull = f"{{damping_linear: {NONE}, {across}}}"
        world = world_of(barge(tmp_path, hull), current={"speed": 0.5, "direction": 90.0})
        vessel = world.parameters.hulls[0].vessel
        assert vessel.damping_quadratic[1] == vessel.damping_quadratic[5] == 0.0
        assert [strip.z for strip in vessel.strips] == pytest.approx([-0.15] * 20)
        x = np.array([strip.x for strip in vessel.strips])
        drag = 0.5 * RHO * 3.0 / 20 * (0.2 + 0.2 * (x + 1.0) / 3.0) * (2.0 - np.abs(x - 0.5) / 1.5)
        assert [strip.drag for strip in vessel.strips] == pytest.approx(drag)
        sim = Simulation(world)
        found = loads(sim, (0, 0, 0, 0, 0, 0), ("drag",))
        assert found[1] == pytest.approx(0.25 * drag.sum())
        assert found[5] == pytest.approx(0.25 * (drag * x).sum())
        assert found[3] == pytest.approx(0.15 * 0.25 * drag.sum())

    def test_out_of_the_water_nothing_holds_it_but_its_added_mass(self, tmp_path):
        """Damping and Coriolis forces go with the lift, from a quarter of the weight on, and memory with them."""
        hull = "{damping_linear: [0, 0, 900, 0, 0, 0], damping_quadratic: [0, 0, 0, 0, 0, 0]}"
        sim = Simulation(world_of(barge(tmp_path, hull)))
        (boat,) = sim.boats
        for height, share in ((0.0, 1.0), (0.374, 1.0), (0.4375, 0.5), (0.5, 0.0), (2.0, 0.0)):
            pose = (0.0, 0.0, height, 0.0, 0.0, 0.0)
            sim.set_boat(boat, pose=pose, velocity=(0.0, 0.0, -1.0, 0.0, 0.0, 0.0))
            assert sim.forces(boat)["drag"][2] == pytest.approx(900.0 * share, abs=1e-6)

    def test_an_undamped_boat_keeps_its_speed(self, tmp_path):
        hull = f"{{added_mass: [900, 0, 0, 0, 0, 0], damping_linear: {NONE}, damping_quadratic: {NONE}}}"
        sim = Simulation(world_of(barge(tmp_path, hull)))
        (boat,) = sim.boats
        sim.set_boat(boat, pose=(0, 0, 0, 0, 0, 0), velocity=(1.0, 0, 0, 0, 0, 0))
        sim.step(duration=5.0)
        assert sim.data.qvel[0] == pytest.approx(1.0, abs=1e-9)  # nothing slows it

    def test_a_boat_adrift_goes_with_the_current(self, tmp_path):
        hull = "{added_mass: [400, 2000, 3000, 500, 3000, 2000], damping_linear: [200, 800, 900, 500, 900, 900]}"
        sim = Simulation(world_of(barge(tmp_path, hull), current={"speed": 0.5, "direction": 30.0}))
        sim.step(duration=300.0)
        assert np.hypot(*sim.data.qvel[:2]) == pytest.approx(0.5, abs=1e-3)
        assert math.degrees(math.atan2(sim.data.qvel[1], sim.data.qvel[0])) == pytest.approx(30.0, abs=0.1)

    def test_batch_simulation_and_saved_world_are_bit_equal(self, tmp_path):
        sea = {"model": "jonswap", "significant_height": 0.2, "peak_period": 3.0, "components": 20}
        world = world_of(barge(tmp_path, "{munk: false}"), sea=sea, current={"speed": 0.2})
        batch, single = Batch(world, 2), Simulation(world)
        batch.reset(seed=4)
        batch.step(duration=1.0)
        single.reset(5)
        single.step(duration=1.0)
        assert batch.get_state(1).sha256 == single.get_state().sha256
        again = type(world).load(world.save(tmp_path / "bay"))
        assert again.parameters.hulls == world.parameters.hulls
        assert again.sha256 == world.sha256

    def test_vrx_s_profiles_have_none(self, tmp_path):
        for profile in ("vrx", "vrx3"):
            assert world_of(barge(tmp_path), profile).parameters.hulls[0].vessel is None

    def test_forces_add_up_to_the_acceleration(self, tmp_path):
        """What `forces` names is the whole: (m + M_A) a = the sum."""
        sea = {"model": "regular", "height": 0.2, "period": 3.0}
        hull = "{added_mass: [400, 2000, 3000, 500, 3000, 2000]}"
        sim = Simulation(world_of(barge(tmp_path, hull), sea=sea, current={"speed": 0.2}))
        sim.step(duration=2.0)
        (boat,) = sim.boats
        outside = sim.forces(boat).total
        sim.step(duration=sim.timestep)
        inertial = sim.forces(boat).inertial["added_mass"]
        assert 4100.0 * sim.data.qacc[:3] == pytest.approx((outside + inertial)[:3], rel=0.05, abs=30.0)


MATRIX = "{hydrostatics: matrix, restoring: [0, 0, 2000, 300, 900, 0], added_mass: [0, 0, 50, 0, 0, 0], "
MATRIX += f"damping_linear: {NONE}, damping_quadratic: {NONE}, displacement: 100, waterline: 0.1}}"


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
class TestMatrix:
    def test_it_rests_at_its_waterline_and_heels_with_its_stiffness(self, tmp_path):
        sim = Simulation(world_of(barge(tmp_path, MATRIX, mass=100.0)))
        at_rest = loads(sim, (0, 0, -0.1, 0, 0, 0))
        assert at_rest == pytest.approx((0, 0, 100.0 * G, 0, 0, 0), abs=1e-9)
        assert loads(sim, (0, 0, -0.09, 0, 0, 0))[2] - at_rest[2] == pytest.approx(-20.0, rel=1e-6)
        assert loads(sim, (0, 0, -0.1, 0.01, 0, 0))[3] == pytest.approx(-3.0, rel=1e-3)
        assert loads(sim, (0, 0, -0.1, 0, 0.01, 0))[4] == pytest.approx(-9.0, rel=1e-3)
        assert loads(sim, (0, 0, -0.1, 0, 0.01, 1.0))[3:5] == pytest.approx(
            (9.0 * math.sin(1.0), -9.0 * math.cos(1.0)), rel=1e-2
        )

    def test_the_water_does_not_pull(self, tmp_path):
        """It lifts 981 N at rest and 2 kN less per metre; its moments fade once half of that is left."""
        sim = Simulation(world_of(barge(tmp_path, MATRIX, mass=100.0)))
        weight = 100.0 * G
        for rise, turn in ((0.2, 1.0), (0.5 * weight / 2000.0, 1.0), (0.3, 2.0 * (weight - 600.0) / weight)):
            found = loads(sim, (0, 0, rise - 0.1, 0.01, 0, 0))
            assert found[2] == pytest.approx(weight - 2000.0 * rise, rel=1e-3)
            assert found[3] == pytest.approx(-3.0 * turn, rel=1e-3)
        for rise in (weight / 2000.0 + 1e-6, 3.0):
            assert loads(sim, (0, 0, rise - 0.1, 0.3, 0.2, 0)) == pytest.approx(np.zeros(6))

    @pytest.mark.parametrize("heading", [0.0, 0.5, math.pi])
    def test_in_a_long_wave_it_pitches_as_its_slope_turns(self, tmp_path, heading):
        """Pitch over the slope: f (C + i w D - w^2 A) / (C + i w D - w^2 (A + I)), f the waterplane's share."""
        c, d, a, inertia, period, height = 90_000.0, 30_000.0, 4000.0, 6000.0, 6.0, 0.02
        hull = f"{{hydrostatics: matrix, restoring: [0, 0, 20000, 20000, {c}, 0], added_mass: [0, 0, 50, 0, {a}, 0], "
        hull += f"damping_linear: [0, 0, 3000, 9000, {d}, 0], damping_quadratic: {NONE}, displacement: 100}}"
        sea = {"model": "regular", "height": height, "period": period}
        pose = [0, 0, 0, 0, 0, heading]
        spawn, physics = {"robot": barge(tmp_path, hull, 100.0), "pose": pose}, {"profile": "marine", "timestep": 0.001}
        sim = Simulation(world_of(None, sea=sea, spawn=spawn, physics=physics))
        (boat,) = sim.boats
        sim.step(duration=10.0 * period)
        seen = []
        for _ in range(300):
            sim.step(duration=period / 300.0)
            place = sim.observe()[boat].position
            seen.append((sim.observe()[boat].pitch, sim.sea.slope(place[0], place[1], sim.time)[0]))
        pitch, slope = np.exp(2j * math.pi * np.arange(300) / 300) @ np.array(seen)
        omega = 2.0 * math.pi / period
        k, cos = omega**2 / G, math.cos(heading)
        spread = 0.3 * k**2 * (c / 20_000.0 * cos**2 + 1.0 * math.sin(heading) ** 2)
        share = 1.0 / (1.0 + spread + 9.0 / 14.0 * spread**2)
        water = -1j * omega * d - omega**2 * a  # e^(-i omega t), as the sums above
        closed = share * (c + water) / (c + water - omega**2 * inertia)
        assert -pitch / (slope * cos) == pytest.approx(closed, rel=2e-3)

    def test_more_mass_sinks_it_by_its_stiffness(self, tmp_path):
        damped = MATRIX.replace(f"damping_linear: {NONE}", "damping_linear: [0, 0, 900, 90, 300, 0]")
        sim = Simulation(world_of(barge(tmp_path, damped, mass=110.0)))
        sim.step(duration=20.0)
        assert sim.data.qpos[2] == pytest.approx(-0.1 - 10.0 * G / 2000.0, abs=1e-4)

    def test_on_a_slope_it_is_pushed_down_and_turned(self, tmp_path):
        sea = {"model": "regular", "height": 0.2, "period": 10.0}
        sim = Simulation(world_of(barge(tmp_path, MATRIX, mass=100.0), sea=sea))
        (boat,) = sim.boats
        sim.step(duration=2.5)
        sim.set_boat(boat, pose=(0, 0, -0.1, 0, 0, 0))
        slope = sim.sea.slope(0.0, 0.0, sim.time)
        found = sim.forces(boat)["hydrostatics"]
        assert found[0] == pytest.approx(-100.0 * G * slope[0], rel=2e-2)
        assert found[4] == pytest.approx(-900.0 * slope[0], rel=2e-2)


@pytest.mark.parametrize(
    ("hull", "message"),
    [
        ("{restoring: [0, 0, 1, 1, 1, 0]}", "hull.restoring: not allowed for `hydrostatics: mesh`; allowed for matrix"),
        ("{hydrostatics: matrix}", "hull.restoring: required for `hydrostatics: matrix`"),
        (
            "{added_mass: [1, 2, 3]}",
            "hull.added_mass: expected six rows of six numbers, or the six of the diagonal, got 3",
        ),
        (
            "{crossflow: {stern: 2, bow: -2, draft: 1, coefficient: 1}}",
            "hull.crossflow.bow: expected a bow ahead of the stern, at 2, got -2",
        ),
        (
            "{crossflow: {stern: -2, bow: 2, draft: [], coefficient: -1, strips: 1000}}",
            (
                "hull.crossflow.draft: must not be empty\n"
                "barge.yaml:2:63: hull.crossflow.coefficient: must be at least 0, got -1\n"
                "barge.yaml:2:75: hull.crossflow.strips: must be at most 200, got 1000"
            ),
        ),
        (
            "{crossflow: {stern: -2, bow: 2, draft: [1, 2, -3], coefficient: x}}",
            (
                "hull.crossflow.draft[2]: must be at least 0, got -3\n"
                "barge.yaml:2:71: hull.crossflow.coefficient: expected a number, or a list of those from stern to bow, "
                "got 'x'"
            ),
        ),
        (
            "{added_mass: [-80, 0, 0, 0, 0, 0]}",
            (
                "hull.added_mass: entry 11 of the diagonal is -80, and 0 or more is needed; if the signs "
                "are those of X_u and X_du (SNAME, Fossen), reverse all of them"
            ),
        ),
        (
            "{damping_linear: [0, 0, 0, 0, 0, -9]}",
            (
                "hull.damping_linear: entry 66 of the diagonal is -9, and 0 or more is needed; if the "
                "signs are those of X_u and X_du (SNAME, Fossen), reverse all of them"
            ),
        ),
        (
            "{hydrostatics: matrix, restoring: [0, 0, -2000, 300, 900, 0]}",
            "hull.restoring: entry 33 is -2000 N/m: above 0 is needed for a boat that floats",
        ),
        ("{hydrostatics: panels}", "hull.hydrostatics: expected mesh or matrix, got 'panels'"),
    ],
)
def test_keys_that_cannot_be(tmp_path, hull, message):
    with pytest.raises(ConfigError) as error:
        world_of(barge(tmp_path, hull))
    assert message in str(error.value)


def write_meshes(folder):
    """A box of no height, a fine ball, and a box of 4 x 2 x 1 m whose one end is turned over."""
    for name, height in (("flat", 0.0), ("twisted", 1.0), ("open", 1.0)):
        box = trimesh.creation.box((4.0, 2.0, height))
        if name == "twisted":
            box.vertices[box.vertices[:, 0] > 0.0] *= (1.0, -1.0, 1.0)
        faces = box.faces[box.face_normals[:, 2] < 0.5] if name == "open" else box.faces
        trimesh.Trimesh(box.vertices, faces, process=False).export(folder / f"{name}.stl")
    trimesh.creation.icosphere(5, 1.2).export(folder / "fine.stl")
    inverted = trimesh.creation.box((4.0, 2.0, 1.0))
    trimesh.Trimesh(inverted.vertices, inverted.faces[:, ::-1], process=False).export(folder / "inverted.stl")


OVERLAPPING = "{shapes: [{type: box, size: [4, 2, 1]}, {type: box, size: [2, 2, 1], pose: [2, 0, 0, 0, 0, 0]}]}"
ROUND = ", ".join(
    ["[900, 0, 0, 0, 0, 0]", "[0, 1, 0, 0, 0, 5000]", *["[0, 0, 9, 0, 0, 0]"] * 3, "[0, 5000, 0, 0, 0, 1]"]
)


@pytest.mark.parametrize(
    ("hull", "kg", "message"),
    [
        ("{shapes: [{type: mesh, file: open.stl}]}", 0.0,
         ": mesh open.stl is open (4 edges without a second triangle): its convex hull is used"),
        ("{shapes: [{type: mesh, file: inverted.stl}]}", 0.0,
         ": mesh inverted.stl is inside out (a volume of -8 m3): its triangles are reversed"),
        (OVERLAPPING, 0.0, (": its surfaces overlap, most of all shapes[0] and shapes[1]: 2.03 of 10 m3 "
         "count twice and add buoyancy; join them to one, for example with Blender's Boolean union")),
        ("{shapes: [{type: box, size: [4, 1, 1.5]}]}", 1.0, (": its centre of mass is 1.25 m above its "
         "centre of buoyancy: the "
         "metacentric height is -1.17 m, and it capsizes")),
        ("{hydrostatics: matrix, restoring: [0, 0, 9e4, -300, 900, 0]}", 0.0,
         ": hull.restoring of roll is -300 N m: it capsizes"),
        (f"{{damping_linear: [{ROUND}]}}", 0.0, (" is unstable: a small motion about equilibrium grows at 0.933 "
         "1/s; check "
         "the entries of `damping_linear`")),
    ],
)  # fmt: skip
def test_hulls_that_are_odd(tmp_path, hull, kg, message):
    write_meshes(tmp_path)
    with pytest.warns(VrxWarning) as warned:
        world_of(barge(tmp_path, hull, kg=kg))
    said = [str(warning.message) for warning in warned]
    assert [text for text in said if message in text] == [f"robot ./barge.urdf{message}"]


ROWS = ["[0, 5, 0, 0, 0, 0]", "[0, 9, 0, 0, 0, 0]", *[NONE] * 4]


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
@pytest.mark.parametrize(
    ("hull", "mass", "message"),
    [
        (
            STILL,
            9000.0,
            (
                "robot ./barge.urdf sinks: its mass is 9000 kg, but its hull's 8 m3 carry 8200 kg; check the "
                "mesh's unit (m) "
                "and that all of the hull is in it, or the mass of the links"
            ),
        ),
        (
            STILL,
            4.0,
            (
                "robot ./barge.urdf hardly touches the water: its mass is 4 kg, but its hull's 8 m3 carry 8200 "
                "kg; check the "
                "mesh's unit (m; `scale: [0.001, 0.001, 0.001]` takes one in mm)"
            ),
        ),
        (
            "{shapes: [{type: mesh, file: flat.stl}]}",
            4100.0,
            "robot ./barge.urdf sinks: its hull has no volume; a closed mesh that is not flat is needed",
        ),
        (
            "{shapes: [{type: mesh, file: fine.stl}]}",
            4100.0,
            (
                "robot ./barge.urdf: its hull has 20,480 triangles, more than 5,000; 100 to 700 are enough, "
                "and every step "
                "visits each: simplify the mesh"
            ),
        ),
        (
            "{shapes: [{type: mesh, file: twisted.stl}]}",
            900.0,
            (
                "robot ./barge.urdf: its surface intersects itself: 2 m3 of 4 m3 are inside out; 2 pairs "
                "of triangles "
                "cross, the first at (0, 0, -0.25) m; repair it, for example with Blender's 3D-Print Toolbox"
            ),
        ),
        (
            f"{{added_mass: [[0, 5000, 0, 0, 0, 0], [5000, 0, 0, 0, 0, 0], {', '.join([NONE] * 4)}]}}",
            4100.0,
            (
                "robot ./barge.urdf: the mass of hull.added_mass and the boat is not positive definite: its "
                "smallest eigenvalue is -900, mostly of surge; check signs and sizes off the diagonal, and `point`"
            ),
        ),
        (
            f"{{added_mass: [{', '.join(ROWS)}]}}",
            4100.0,
            "robot ./barge.urdf: hull.added_mass is not symmetric: A12 is 5, A21 is 0; in an ideal fluid it is",
        ),
    ],
)
def test_hulls_that_cannot_be(tmp_path, hull, mass, message):
    write_meshes(tmp_path)
    with pytest.raises(VrxError) as error:
        world_of(barge(tmp_path, hull, mass))
    assert str(error.value) == message
