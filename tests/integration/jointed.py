"""Objects whose links move against each other, for tests of whole runs."""

import yaml

import vrx_mj

CALM = {"model": "none"}
BOX = {"type": "box", "size": [1.0, 1.0, 0.4]}
DRAG = {"linear_drag": 5.0, "angular_drag": 2.0}

PENDULUM = {
    "static": True,
    "link": "tower",
    "visuals": [{"type": "box", "size": [0.2, 0.2, 4.0], "pose": [0, 0, 2, 0, 0, 0]}],
    "links": [
        {
            "name": "arm",
            "pose": [0, 0, 4, 0, 0, 0],
            "mass": 2.0,
            "center_of_mass": [0, 0, -1],
            "inertia": [0.1, 0.1, 0.1],
            "visuals": [{"type": "cylinder", "radius": 0.05, "length": 2.0, "pose": [0, 0, -1, 0, 0, 0]}],
        }
    ],
    "joints": [{"name": "swing", "type": "revolute", "parent": "tower", "child": "arm", "axis": {"xyz": [0, 1, 0]}}],
}
"""A tower from whose top an arm hangs."""


def float_of(name, y, color):
    """A float beside the middle of a raft."""
    return {
        "name": name,
        "pose": [0, y, 0, 0, 0, 0],
        "mass": 20.0,
        "inertia": [2, 2, 2],
        "collisions": [BOX],
        "visuals": [{**BOX, "color": color}],
        "buoyancy": {**DRAG, "elements": [BOX]},
    }


RAFT = {
    "link": "base",
    "mass": 50.0,
    "inertia": [5, 5, 8],
    "collisions": [BOX],
    "visuals": [BOX],
    "buoyancy": {**DRAG, "elements": [BOX]},
    "links": [float_of("left", 1.2, "red"), float_of("right", -1.2, "green")],
    "joints": [
        {
            "name": "port_hinge",
            "type": "revolute",
            "parent": "base",
            "child": "left",
            "pose": [0, -0.6, 0, 0, 0, 0],
            "axis": {"xyz": [1, 0, 0], "limits": [-1.0, 1.0], "damping": 2.0},
        },
        {
            "name": "starboard_hinge",
            "type": "universal",
            "parent": "base",
            "child": "right",
            "pose": [0, 0.6, 0, 0, 0, 0],
            "axis": {"xyz": [1, 0, 0]},
            "axis2": {"xyz": [0, 1, 0]},
        },
    ],
}
"""A raft with a float on a hinge and another on a universal joint."""


def write(folder, name, content):
    """The path of an object's file, which is written."""
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(content), "utf-8")
    return path


def world_of(folder, *, physics=None, sea=CALM, wind=None, fleet=None, **objects):
    """A compiled world with objects, each given as (content of its file, pose)."""
    items = []
    for name, (content, pose) in objects.items():
        write(folder, name, content)
        items.append({"name": name, "model": f"./{name}.yaml", "pose": list(pose)})
    file = folder / "world.yaml"
    spawn = {"pose": [-50, -50, 0, 0, 0, 0]}
    content = {"physics": physics or {"profile": "vrx"}, "sea": sea, "objects": items, "spawn": spawn}
    file.write_text(yaml.safe_dump({**content, **({"wind": wind} if wind else {})}), "utf-8")
    return vrx_mj.compile_world(file, fleet=fleet)


def simulation_of(folder, **given):
    """A simulation of such a world, at its start."""
    sim = vrx_mj.Simulation(world_of(folder, **given))
    sim.reset(seed=3)
    return sim


def angle(sim, name):
    """Angle [rad] or position [m] of an axis of a joint, by the name of its joint in the MJCF."""
    return float(sim.data.qpos[sim.model.joint(name).qposadr[0]])


def place(sim, body):
    """Where a link is [m], by the name of its body in the MJCF."""
    return sim.data.body(body).xpos.copy()
