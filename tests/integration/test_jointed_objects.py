"""Objects with joints in whole runs: closed forms, at rest, and all that is done to objects."""

import copy
import math

import mujoco
import numpy as np
import pytest

import vrx_mj
from integration.jointed import DRAG, PENDULUM, RAFT, angle, place, simulation_of, write
from vrx_mj.constants import WATER_DENSITY
from vrx_mj.frames import quaternion_product, rotation_matrix
from vrx_mj.recording.motion_chunks import part_poses
from vrx_mj.recording.simulation_scene import scene_of

HERE = (5.0, 0.0, 0.0, 0.0, 0.0, 0.0)
G = 9.8
SEA = {"model": "pms", "gain": 0.2, "period": 5.0, "scale": 1.5, "direction": [1.0, 0.3], "tau": 2.0}


def swung(sim, joint, start, seconds, step=0.02):
    """Angle of a joint that is let go at `start` [rad], every `step` [s]."""
    sim.data.qpos[sim.model.joint(joint).qposadr[0]] = start
    out = []
    for _ in range(round(seconds / step)):
        sim.step(duration=step)
        out.append(angle(sim, joint))
    return np.array(out)


def own_period(angles, step=0.02):
    """Mean time between the downward passages of zero [s]."""
    down = np.flatnonzero((angles[:-1] > 0.0) & (angles[1:] <= 0.0))
    exact = down + angles[down] / (angles[down] - angles[down + 1])
    return float(np.mean(np.diff(exact))) * step


@pytest.mark.parametrize("profile", ["vrx", "vrx3", "marine"])
def test_a_pendulum_in_the_air_has_its_period(tmp_path, profile):
    sim = simulation_of(tmp_path, physics={"profile": profile}, crane=(PENDULUM, HERE))
    found = own_period(swung(sim, "crane/swing/axis", 0.05, 12.5))
    expected = 2 * math.pi * math.sqrt((0.1 + 2.0 * 1.0**2) / (2.0 * G * 1.0))
    assert found == pytest.approx(expected * (1 + 0.05**2 / 16), rel=5e-4)  # of steps of up to 20 ms: (omega dt)^2 / 24


@pytest.mark.parametrize("profile", ["vrx", "vrx3", "marine"])
def test_a_pendulum_under_water_is_as_slow_as_its_weight_there(tmp_path, profile):
    """Half of its weight is carried by a ball at its centre of mass, 5 m under the surface."""
    radius = (0.75 * 1.0 / WATER_DENSITY / math.pi) ** (1 / 3)
    wet = copy.deepcopy(PENDULUM)
    ball = {"type": "sphere", "radius": radius, "pose": [0, 0, -1, 0, 0, 0]}
    wet["links"][0]["buoyancy"] = {
        "fluid_density": WATER_DENSITY,
        "linear_drag": 0.0,
        "angular_drag": 0.0,
        "elements": [ball],
    }
    sim = simulation_of(tmp_path, physics={"profile": profile}, crane=(wet, (5, 0, -8, 0, 0, 0)))
    found = own_period(swung(sim, "crane/swing/axis", 0.05, 12.5))
    assert found == pytest.approx(2 * math.pi * math.sqrt(2.1 / (1.0 * G)), rel=5e-4)


def test_drag_damps_a_pendulum_under_water_as_a_closed_form_says(tmp_path):
    """I theta'' = -m g l theta - kappa theta', kappa = c_ang m L^2 with the mean extent L of a whole element.

    VRX's drag of velocity is that of the link's origin, which here is on the hinge.
    """
    wet = copy.deepcopy(PENDULUM)
    element = {"type": "box", "size": [0.1, 0.1, 0.1], "pose": [0, 0, -1, 0, 0, 0]}
    wet["links"][0]["buoyancy"] = {"linear_drag": 9.0, "angular_drag": 20.0, "elements": [element]}
    sim = simulation_of(tmp_path, physics={"timestep": 0.002}, crane=(wet, (5, 0, -8, 0, 0, 0)))
    angles = swung(sim, "crane/swing/axis", 0.05, 10.0)
    t = 0.02 * np.arange(1, len(angles) + 1)
    inertia, weight, kappa = 2.1, (2.0 - WATER_DENSITY * 0.001) * G, 20.0 * 2.0 * 0.1**2
    decay = kappa / (2 * inertia)
    omega = math.sqrt(weight / inertia - decay**2)
    expected = 0.05 * np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    assert np.abs(angles - expected).max() < 2e-4  # 0.4 % of the start: the sine of the angle, and the step


def test_a_slide_falls_to_its_limit_and_rests_there(tmp_path):
    lift = copy.deepcopy(PENDULUM)
    axis = {"xyz": [0, 0, 1], "limits": [-1.5, 0.0]}
    lift["joints"] = [{"name": "rail", "type": "prismatic", "parent": "tower", "child": "arm", "axis": axis}]
    sim = simulation_of(tmp_path, crane=(lift, HERE))
    dt = sim.timestep
    sim.step(duration=0.5)
    assert angle(sim, "crane/rail/axis") == pytest.approx(-0.5 * G * 0.5 * (0.5 + dt))  # semi-implicit Euler
    sim.step(duration=4.5)
    assert angle(sim, "crane/rail/axis") == pytest.approx(-1.5, abs=0.01)  # limits are soft
    assert abs(sim.data.qvel[-1]) < 1e-6
    assert place(sim, "crane/arm")[2] == pytest.approx(2.5, abs=0.01)


def test_a_spring_holds_an_arm_where_its_torque_is_that_of_the_weight(tmp_path):
    sprung = copy.deepcopy(PENDULUM)
    sprung["joints"][0]["axis"] |= {"stiffness": 30.0, "spring_reference": 1.2, "damping": 8.0}
    sim = simulation_of(tmp_path, crane=(sprung, HERE))
    sim.step(duration=20.0)
    theta = angle(sim, "crane/swing/axis")
    assert 30.0 * (1.2 - theta) == pytest.approx(2.0 * G * 1.0 * math.sin(theta), abs=1e-6)


def test_friction_holds_an_arm_up_to_its_torque(tmp_path):
    stuck = copy.deepcopy(PENDULUM)
    stuck["joints"][0]["axis"] |= {"friction": 15.0}
    sim = simulation_of(tmp_path, crane=(stuck, HERE))
    below, above = (math.asin(torque / (2.0 * G)) for torque in (14.5, 15.5))
    assert swung(sim, "crane/swing/axis", below, 2.0)[-1] == pytest.approx(below, abs=0.02)
    assert swung(sim, "crane/swing/axis", above, 2.0)[-1] < above - 0.05


@pytest.mark.parametrize("profile", ["vrx", "vrx3", "marine"])
def test_a_raft_of_links_rests_where_archimedes_says(tmp_path, profile):
    """Three boxes of 1 m2 carry 90 kg; the hinges let each of them find its own draft only as far as they allow."""
    sim = simulation_of(tmp_path, physics={"profile": profile}, raft=(RAFT, HERE))
    sim.step(duration=60.0)
    heights = [place(sim, f"raft/{link}")[2] for link in ("base", "left", "right")]
    wet = sum(0.2 - height for height in heights)  # floors of the boxes under water, level as they are
    density = 997.0 if profile == "vrx3" else WATER_DENSITY
    assert wet == pytest.approx(90.0 / density, rel=0.03)  # the outer boxes lean by about 0.03 rad
    raft = sim.model.body("raft/base").dofadr[0]
    assert np.abs(sim.data.qvel[raft + 2 : raft + 9]).max() < 2e-3


def test_wind_pushes_the_links_that_it_is_given_for(tmp_path):
    even = copy.deepcopy(RAFT)
    even["joints"][1] = even["joints"][0] | {"name": "other", "child": "right", "pose": [0, 0.6, 0, 0, 0, 0]}

    def final(size, link=None):
        pushed = {"model": "raft", "coefficients": [size, size, 0.0]} | ({"link": link} if link else {})
        wind = {"direction": 0, "mean_velocity": 10.0, "objects": [pushed]}
        sim = simulation_of(tmp_path, wind=wind, raft=(even, HERE))
        sim.step(duration=5.0)
        return place(sim, "raft/base")[0], sim.observe_object("raft").angular_velocity[2]

    still, pushed, turned = final(0.0), final(3.0), final(3.0, "left")
    assert pushed[0] > still[0] + 0.1
    assert abs(pushed[1]) < 1e-3 < abs(turned[1])


# All that is done to objects


def two_rafts(folder, **other):
    """A simulation with two rafts in waves."""
    return simulation_of(folder, sea=SEA, first=(RAFT, HERE), second=(RAFT, (-12.0, 4.0, 0.0, 0.0, 0.0, 1.0)), **other)


def tree(sim, name):
    """Positions and velocities of all that moves of an object."""
    model, root = sim.model, sim.model.body(f"{name}/base").rootid[0]
    joints = [index for index in range(model.njnt) if model.body_rootid[model.jnt_bodyid[index]] == root]
    ends = np.append(model.jnt_qposadr, model.nq)
    dofs = model.body_rootid[model.dof_bodyid] == root
    return np.concatenate([*(sim.data.qpos[ends[j] : ends[j + 1]] for j in joints), sim.data.qvel[dofs]])


def test_a_state_is_taken_up_to_the_last_bit(tmp_path):
    sim = two_rafts(tmp_path)
    sim.step(duration=3.0)
    state = sim.get_state()
    sim.step(duration=3.0)
    after = sim.get_state()
    sim.set_state(state)
    sim.step(duration=3.0)
    assert sim.get_state().sha256 == after.sha256
    again = two_rafts(tmp_path)
    again.set_state(state)
    again.step(duration=3.0)
    assert again.get_state().sha256 == after.sha256


def test_a_saved_world_moves_as_the_one_that_was_saved(tmp_path):
    world = two_rafts(tmp_path).world
    world.save(tmp_path / "saved")
    loaded = vrx_mj.World.load(tmp_path / "saved")
    assert loaded.sha256 == world.sha256
    ends = []
    for one in (world, loaded):
        sim = vrx_mj.Simulation(one)
        sim.reset(seed=5)
        sim.step(duration=3.0)
        ends.append(sim.get_state().sha256)
    assert ends[0] == ends[1]


def test_what_comes_and_goes_changes_nothing_of_the_others(tmp_path):
    alone, joined = two_rafts(tmp_path), two_rafts(tmp_path)
    for sim in (alone, joined):
        sim.step(duration=2.0)
    joined.spawn_object("third", model=tmp_path / "first.yaml", pose=[30, 0, 0, 0, 0, 0])
    for sim in (alone, joined):
        sim.step(duration=2.0)
    assert np.array_equal(tree(alone, "first"), tree(joined, "first"))
    assert np.array_equal(tree(alone, "second"), tree(joined, "second"))
    joined.remove("first")
    for sim in (alone, joined):
        sim.step(duration=2.0)
    assert np.array_equal(tree(alone, "second"), tree(joined, "second"))
    assert np.abs(tree(joined, "third")).max() < 100.0


WET_CRANE = copy.deepcopy(PENDULUM)
WET_CRANE["links"][0]["buoyancy"] = {
    **DRAG,
    "elements": [{"type": "box", "size": [0.1, 0.1, 0.1], "pose": [0.5, 0, -1, 0, 0, 0]}],
}


@pytest.mark.parametrize(("content", "height"), [(RAFT, 0.0), (WET_CRANE, -6.0)])
def test_what_is_spawned_meets_the_water_as_it_is_then(tmp_path, content, height):
    """Else the water would seem to rise to its links within one step, and throw them."""
    stiff = copy.deepcopy(content)
    for part in (stiff, *stiff["links"]):
        if "buoyancy" in part:
            part["buoyancy"]["linear_drag"] = 100.0
    sim = simulation_of(tmp_path, sea=SEA | {"gain": 1.6})
    sim.step(duration=7.0)
    x = max(np.arange(0.0, 30.0), key=lambda x: float(sim.sea.height(x, 0.0, sim.time)))
    level = float(sim.sea.height(x, 0.0, sim.time))
    assert level > 0.3  # [m]: 30 m/s, if it rose in a step of 10 ms
    sim.spawn_object("new", model=write(tmp_path, "new", stiff), pose=[x, 0, height + level, 0, 0, 0])
    sim.step()
    assert np.abs(sim.data.qvel[6:]).max() < 1.0  # at most 10 g for a step


def test_a_moved_object_takes_its_links_along(tmp_path):
    """As in Gazebo: joints keep their angles, and a velocity is that of all links."""
    sim = two_rafts(tmp_path)
    sim.step(duration=4.0)
    hinges = ("first/port_hinge/axis", "first/starboard_hinge/axis")
    angles = [angle(sim, name) for name in hinges]
    assert min(map(abs, angles)) > 1e-4
    sim.set_object("first", pose=[60.0, 10.0, 0.2, 0.0, 0.0, 0.0], velocity=[1.0, 0, 0, 0, 0, 0])
    assert [angle(sim, name) for name in hinges] == angles
    assert place(sim, "first/base") == pytest.approx([60.0, 10.0, 0.2])
    left = 1.2 - 0.6 + 0.6 * math.cos(angles[0]), 0.6 * math.sin(angles[0])  # of the hinge and half a float
    assert place(sim, "first/left") == pytest.approx([60.0, 10.0 + left[0], 0.2 + left[1]])
    for link in ("base", "left", "right"):
        velocity, body = np.zeros(6), sim.model.body(f"first/{link}").id
        mujoco.mj_objectVelocity(sim.model, sim.data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, 0)
        assert velocity == pytest.approx([0, 0, 0, 1, 0, 0], abs=1e-12)


def test_each_row_of_a_batch_moves_as_a_simulation(tmp_path):
    world = two_rafts(tmp_path, fleet={"boats": [{"name": "wamv", "pose": [-50, 0, 0, 0, 0, 0]}]}).world
    batch = vrx_mj.Batch(world, 2)
    batch.reset(seed=[5, 6])
    batch.step(duration=2.0)
    for row, seed in enumerate((5, 6)):
        sim = vrx_mj.Simulation(world)
        sim.reset(seed=seed)
        sim.step(duration=2.0)
        assert np.array_equal(batch.qpos[row], sim.data.qpos)


def test_links_bump_into_boats_and_not_into_each_other(tmp_path):
    folded = copy.deepcopy(RAFT)
    folded["links"][0]["pose"] = [0, 0.3, 0, 0, 0, 0]  # inside the middle
    sim = simulation_of(tmp_path, raft=(folded, HERE))
    sim.step(duration=1.0)
    assert sim.data.ncon == 0
    sim.set_boat("wamv", pose=[6.0, -3.2, 0, 0, 0, math.pi / 2])
    owners = set()
    for _ in range(10):
        sim.step(duration=0.05)
        geoms = [geom for contact in sim.data.contact for geom in contact.geom]
        owners |= {sim.model.body(sim.model.geom_bodyid[geom]).name for geom in geoms}
    assert "raft/right" in owners


def test_every_link_moves_in_a_recording(tmp_path):
    """Poses of the entities, one on another, against those of MuJoCo's bodies; with joints of all types."""
    mixed = copy.deepcopy(RAFT)
    for name, kind, parent in (("tip", "ball", "left"), ("rail", "prismatic", "right")):
        mixed["links"].append({"name": name, "pose": [0.2, 0.1, 1.0, 0.3, 0.2, 0.1], "mass": 1.0, "inertia": [1, 1, 1]})
        ends = {"parent": parent, "child": name}
        mixed["joints"].append({"name": name, "type": kind, **ends, "pose": [0, 0, -0.5, 0, 1, 0]})
    sim = simulation_of(tmp_path, sea=SEA, raft=(mixed, HERE), crane=(PENDULUM, (20, 0, 0, 0, 0, 0.5)))
    sim.data.qpos[:] += 0.2
    sim.step(duration=1.0)
    scene = scene_of(sim)
    mujoco.mj_kinematics(sim.model, sim.data)
    place = {}
    for body in scene.bodies:
        numbers = sim.data.qpos[body.free.qpos : body.free.qpos + 7] if body.free else body.pose
        place[body.path] = np.array(numbers[:3]), np.array(numbers[3:])
    for part in scene.parts:
        (position,), (turn,) = part_poses(part, sim.data.qpos[None])
        outer, around = place[part.path.rpartition("/links/")[0]]
        place[part.path] = outer + rotation_matrix(around) @ position, quaternion_product(around, turn)
        name = part.path.removeprefix("/world/objects/").partition("/")[0] + "/" + part.path.rpartition("/")[2]
        body = sim.data.body(name)
        assert place[part.path][0] == pytest.approx(body.xpos, abs=1e-9)
        assert rotation_matrix(place[part.path][1]) == pytest.approx(body.xmat.reshape(3, 3), abs=1e-9)
    assert [part.path.removeprefix("/world/objects/") for part in scene.parts] == [
        "raft/links/left", "raft/links/right", "raft/links/left/links/tip", "raft/links/right/links/rail",
        "crane/links/arm",
    ]  # fmt: skip


@pytest.mark.parametrize("left", ["crane", "raft"])
def test_a_recording_gives_its_run_back_where_objects_came_and_went(tmp_path, left):
    """What hangs on a fixed object has no free joint before it: its columns come first, or after those of another."""
    places = {"raft": (RAFT, (20, 0, 0, 0, 0, 0)), "crane": (PENDULUM, HERE), "third": (RAFT, (60, 0, 0, 0, 0, 0))}
    sim = simulation_of(tmp_path, sea=SEA, **places)
    with vrx_mj.record(sim, tmp_path / "run.rrd"):
        sim.step(duration=1.0)
        sim.spawn_object("second", model=tmp_path / "raft.yaml", pose=[40, 0, 0, 0, 0, 0])
        sim.step(duration=1.0)
        sim.remove(left)
        sim.step(duration=1.0)
    record = vrx_mj.read_record(tmp_path / "run.rrd")
    for name in ("second", "third"):
        (body,) = [one for one in record.layout.bodies if one.name == name]
        seen, start = sim.observe_object(name), record.layout.pose(body).start
        assert record.rows[-1, start : start + 3] == pytest.approx(seen.position)
        assert record.rows[-1, start + 7] == pytest.approx(angle(sim, f"{name}/port_hinge/axis"))


def test_a_world_of_nothing_but_a_crane_is_recorded(tmp_path):
    sim = simulation_of(tmp_path, fleet={"boats": []}, crane=(PENDULUM, HERE))
    with vrx_mj.record(sim, tmp_path / "run.rrd"):
        swung(sim, "crane/swing/axis", 0.3, 1.0)
    record = vrx_mj.read_record(tmp_path / "run.rrd")
    assert record.rows[-1, record.layout.qpos] == pytest.approx(sim.data.qpos)
