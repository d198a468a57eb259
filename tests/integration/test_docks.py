"""Docks in whole runs: afloat in calm water and waves, pushed by boats, moored, recorded."""

import mujoco
import numpy as np
import pytest

import vrx_mj
from integration.sailing import CALM, GUSTY, ROUGH, boats, simulation
from vrx_mj.model.world import tree_of
from vrx_mj.recording.motion_chunks import part_poses
from vrx_mj.recording.simulation_scene import scene_of

ROUGHEST = {"model": "pms", "gain": 0.7, "period": 3.0}  # of VRX 2019's worlds
AFAR = boats((-60.0, 0.0, 0.0))
AHEAD = {"a": {"left": 1.0, "right": 1.0}}
REST = 0.0914389618  # of VRX's dock_block_4x4_dynamic in calm water [m]
THRUST = 500.0  # of the boat at full power, both engines [N]


def dock(model="dock_2018_dynamic", **keys):
    return {"name": "o", "model": model, "pose": [0, 0, 0, 0, 0, 0], **keys}


def drawn(layout, **keys):
    return {"name": "d", "dynamic": True, "pose": [0, 0, 0, 0, 0, 0], "layout": layout, **keys}


def blocks_of(sim):
    """Heights of the blocks' middles [m]."""
    mujoco.mj_kinematics(sim.model, sim.data)
    return sim.data.xipos[sim._live.arrays.blocks["body"], 2]


def gap(sim):
    """Farthest distance between two points that a loop keeps together [m]."""
    model, data = sim.model, sim.data
    mujoco.mj_kinematics(model, data)

    def places(bodies, points):
        turns = data.xmat[bodies].reshape(-1, 3, 3)
        return data.xpos[bodies] + np.einsum("nij,nj->ni", turns, points)

    first, second = places(model.eq_obj1id, model.eq_data[:, :3]), places(model.eq_obj2id, model.eq_data[:, 3:6])
    return float(np.linalg.norm(first - second, axis=1).max())


def angles(sim):
    """Of the hinges between blocks [rad]."""
    rows = sim._live.arrays.blocks
    return sim.data.qpos[rows["qpos"][rows["parent"] >= 0]]


@pytest.mark.parametrize("name", ["dock_2016", "dock_2018", "dock_2022"])
@pytest.mark.parametrize("timestep", [0.004, 0.01])
def test_a_bare_dock_comes_to_rest_where_a_block_does(name, timestep):
    sim = simulation(AFAR, sea=CALM, wind=None, timestep=timestep, objects=[dock(f"{name}_base_dynamic")])
    sim.step(duration=40.0)
    assert blocks_of(sim) == pytest.approx(REST, abs=1e-5)
    assert np.abs(angles(sim)).max() < 1e-6
    own = sim._live.arrays.blocks["dof"]
    assert np.abs(sim.data.qvel[own.min() : own.max() + 1]).max() < 1e-4


@pytest.mark.parametrize("edge", [(0.5, 0.375183360), (1.0, 0.36), (1.5, 0.36), (2.0, REST)])
def test_a_block_of_any_size_floats_as_high_as_vrx_has_it(edge):
    sim = simulation(AFAR, sea=CALM, wind=None, docks=[drawn("XX", block=edge[0])])
    sim.step(duration=40.0)
    assert blocks_of(sim) == pytest.approx(edge[1], abs=1e-5)


@pytest.mark.parametrize("sea", [CALM, ROUGHEST], ids=["calm", "rough"])
@pytest.mark.parametrize("timestep", [0.004, 0.01, 0.02])
def test_one_block_moves_as_the_free_body_that_it_is(sea, timestep):
    """The kernel of floating objects is the second implementation; they differ in the turning drag's share of heave."""
    tilted = [5, 3, 0.25, 0.05, 0, 0]
    alone = {"name": "f", "model": "dock_block_4x4_dynamic", "pose": tilted}
    free = simulation(AFAR, sea=sea, wind=None, timestep=timestep, objects=[alone])
    tied = simulation(AFAR, sea=sea, wind=None, timestep=timestep, docks=[drawn("X", pose=[5, 3, 0, 0.05, 0, 0])])
    apart = []
    for _ in range(150):
        free.step(duration=0.1)
        tied.step(duration=0.1)
        apart.append(free.observe_object("f").position[2] - blocks_of(tied)[0])
    assert np.abs(apart).max() < 2e-3  # the middle of a tilted block starts 0.3 mm lower
    assert free.observe_object("f").roll == pytest.approx(tied.observe_object("d").roll, abs=1e-4)


@pytest.mark.parametrize("timestep", [0.004, 0.01])
def test_the_loops_stay_closed_in_the_roughest_sea(timestep):
    sim = simulation(AFAR, sea=ROUGHEST, wind=None, timestep=timestep, objects=[dock()])
    widest, steepest = 0.0, 0.0
    for _ in range(300):
        sim.step(duration=0.2)
        widest, steepest = max(widest, gap(sim)), max(steepest, float(np.abs(angles(sim)).max()))
    assert widest < 0.002
    assert 0.05 < steepest < 0.105  # the limits, 0.1 rad, are soft
    assert abs(sim.observe_object("o/base").position[:2]).max() < 0.1


def test_blocks_follow_the_water_each_at_its_own_place():
    sim = simulation(
        AFAR, sea={"model": "pms", "gain": 0.5, "period": 8.0}, wind=None, objects=[dock("dock_2022_base_dynamic")]
    )
    sim.step(duration=20.0)
    for _ in range(20):
        sim.step(duration=0.5)
        heights = blocks_of(sim)
        places = sim.data.xipos[sim._live.arrays.blocks["body"]]
        water = np.array([float(sim.sea.height(x, y, sim.time)) for x, y, _ in places])
        assert np.corrcoef(heights, water)[0, 1] > 0.9
        assert np.abs(heights - water - REST).max() < 0.15


@pytest.mark.parametrize("timestep", [0.004, 0.01, 0.02])
def test_a_dock_that_is_thrown_about_comes_to_rest(timestep):
    """Energy goes out only: hinges, constraints and stiff drag feed none in, however long the step."""
    sim = simulation(AFAR, sea=CALM, wind=None, timestep=timestep, objects=[dock("dock_2018_base_dynamic")])
    sim.step(duration=30.0)
    sim.set_object("o/base", velocity=(2.0, -1.0, 0.0, 0.1, -0.1, 0.5))
    mujoco.mj_energyVel(sim.model, sim.data)
    energy = [float(sim.data.energy[1])]
    for _ in range(100):
        sim.step()
        mujoco.mj_energyVel(sim.model, sim.data)
        energy.append(float(sim.data.energy[1]))
    assert energy[0] > 6000.0
    assert max(np.diff(energy)) < 1e-3 * energy[0]
    assert energy[-1] < 1e-3 * energy[0]


@pytest.mark.parametrize("name", ["dock_2018", "dock_2022"])
def test_a_fixed_dock_stops_a_boat(name):
    y = 3.0 if name == "dock_2018" else 9.0
    sim = simulation(boats((-15.0, y, 0.0)), sea=CALM, wind=None, objects=[dock(name)])
    fastest, bow = 0.0, 0.0
    for _ in range(150):
        boat = sim.step(AHEAD, duration=0.2)["a"]
        fastest, bow = max(fastest, boat.velocity[0]), max(bow, boat.position[0] + 2.4)
    assert fastest > 2.0
    assert np.abs(boat.velocity).max() < 0.02
    assert 4.5 < bow < 5.2  # the face of the dock is at x = 5
    assert sim.data.ncon > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dock_2018_dynamic", "dock_2022_dynamic"])
@pytest.mark.parametrize("timestep", [0.004, 0.01])
def test_a_boat_pushes_a_floating_dock_at_the_speed_that_its_drag_allows(name, timestep):
    y = 3.0 if name.startswith("dock_2018") else 9.0
    sim = simulation(boats((-8.0, y, 0.0)), sea=CALM, wind=None, timestep=timestep, objects=[dock(name)])
    sim.step(AHEAD, duration=100.0)  # the bow rides up on the edge, which sinks for a minute
    before = sim.observe_object("o/base").position[0]
    boat = sim.step(AHEAD, duration=20.0)["a"]
    after = sim.observe_object("o/base").position[0]
    mass = sum(float(row["mass"]) for row in sim._live.arrays.blocks) + sum(
        "placard" in sim.model.body(i).name for i in range(sim.model.nbody)
    )
    drag = 1000.0 * mass * 0.1  # [N s/m]: VRX's 1000 1/s, and blocks of 100 kg/m3 are a tenth under water
    assert (after - before) / 20.0 == pytest.approx(THRUST / drag, rel=0.1)
    assert boat.position[0] < 5.2
    assert np.isfinite(sim.data.qpos).all()


def test_a_collision_hands_its_momentum_to_the_dock():
    """Without water and drag, what the boat of 258 kg loses the dock gets, but for the step's error of what turns."""

    def dry(parameters):
        for row in (*parameters["hulls"], *parameters["blocks"]):
            row["density"] = 0.0
            row["gravity"] = 0.0
        for hull in parameters["hulls"]:
            hull.update(drag_linear=[0.0] * 6, drag_quadratic=[0.0] * 6, added_mass=[0.0] * 6)
        for row in parameters["blocks"]:
            row.update(linear_drag=0.0, angular_drag=0.0)

    still = {"profile": "vrx", "timestep": 0.01, "gravity": 0.0}
    sim = simulation(
        boats((-6.0, 0.0, 0.0)),
        sea=CALM,
        wind=None,
        edit=dry,
        physics=still,
        docks=[drawn("X\nX", pose=[0, 0, -0.3, 0, 0, 0])],
    )
    sim.set_boat("a", velocity=(2.0, 0, 0, 0, 0, 0))

    def momentum(name):
        mujoco.mj_forward(sim.model, sim.data)
        mujoco.mj_subtreeVel(sim.model, sim.data)
        body = sim.model.body(name)
        return float(body.subtreemass[0]) * sim.data.subtree_linvel[body.id]

    boat = tree_of(sim.world.parameters)["hulls"][0]["body"]
    total = momentum(boat) + momentum("d/dock")
    sim.step(duration=3.0)
    assert momentum("d/dock")[0] > 100.0
    assert momentum(boat) + momentum("d/dock") == pytest.approx(total, abs=2e-3 * total[0])


def test_a_moored_dock_comes_back_and_a_free_one_does_not():
    home = {}
    for mooring in (None, {"stiffness": 40000.0, "damping": 5000.0}):
        keys = {"mooring": mooring} if mooring else {}
        sim = simulation(AFAR, sea=CALM, wind=None, docks=[drawn("X X\nXXX", **keys)])
        sim.step(duration=10.0)
        sim.set_object("d", pose=(1.0, 0.5, sim.observe_object("d").position[2], 0, 0, 0.2))
        sim.step(duration=30.0)
        home[mooring is not None] = np.hypot(*sim.observe_object("d").position[:2])
    assert home[True] < 0.05
    assert home[False] > 1.0


def test_a_world_with_docks_runs_the_same_twice_and_from_any_moment():
    world = {"sea": ROUGH, "wind": GUSTY, "objects": [dock("dock_2018_dynamic")]}
    sim = simulation(boats((-4.0, 3.0, 0.0)), **world)
    sim.step(AHEAD, duration=4.0)
    middle = sim.get_state()
    sim.step(AHEAD, duration=4.0)
    end = sim.get_state().sha256
    sim.set_state(middle)
    sim.step(AHEAD, duration=4.0)
    assert sim.get_state().sha256 == end
    sim.reset()
    for _ in range(2):
        sim.step(AHEAD, duration=4.0)
    assert sim.get_state().sha256 == end


def test_a_boat_far_off_does_not_feel_a_dock():
    alone = simulation(boats((0.0, 60.0, 0.3)), sea=ROUGH)
    beside = simulation(boats((0.0, 60.0, 0.3)), sea=ROUGH, objects=[dock("dock_2022_dynamic")])
    for sim in (alone, beside):
        sim.step(AHEAD, duration=5.0)
    ends = [sim.observe()["a"] for sim in (alone, beside)]
    assert np.array_equal(ends[0].position, ends[1].position)
    assert np.array_equal(ends[0].velocity, ends[1].velocity)


def test_every_block_and_placard_moves_in_a_recording():
    sim = simulation(AFAR, sea=ROUGHEST, wind=None, objects=[dock("dock_2018_dynamic")])
    sim.step(duration=7.0)
    scene = scene_of(sim)
    place = {body.path: np.eye(4) for body in scene.bodies}
    (root,) = [body for body in scene.bodies if body.kind == "dock"]
    free = sim.data.qpos[root.free.qpos : root.free.qpos + 7]
    place[root.path] = matrix(free[:3], free[3:])
    mujoco.mj_kinematics(sim.model, sim.data)
    for part in scene.parts:
        if not part.joints:
            own = matrix(part.pose[:3], part.pose[3:])
        else:
            position, turn = part_poses(part, sim.data.qpos[None])
            own = matrix(position[0], turn[0])
        place[part.path] = place[part.path.rpartition("/")[0]] @ own
        name = part.path.rpartition("/")[2]
        body = sim.data.body(f"o/{name}/link" if "placard" in name else f"o/base/{name}")
        assert place[part.path][:3, 3] == pytest.approx(body.xpos, abs=1e-9)
        assert place[part.path][:3, :3] == pytest.approx(body.xmat.reshape(3, 3), abs=1e-9)
        assert part.surfaces
    assert len(scene.parts) == 19 + 2
    assert np.abs(angles(sim)).max() > 0.01


def test_a_floating_dock_is_recorded_and_read_back(tmp_path):
    sim = simulation(AFAR, sea=ROUGH, objects=[dock("dock_2018_dynamic")])
    with vrx_mj.record(sim, tmp_path / "run.rrd"):
        sim.step(duration=2.0)
    record = vrx_mj.read_record(tmp_path / "run.rrd")
    assert record.rows[-1, record.layout.qpos][: sim.model.nq] == pytest.approx(sim.data.qpos)


def matrix(position, quaternion):
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, np.array(quaternion, np.float64))
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = turn.reshape(3, 3), position
    return whole
