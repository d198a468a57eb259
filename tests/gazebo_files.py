"""Worlds of Gazebo written from our own, as VRX's macros expand (gazebo_classic) and as its SDF files are (jazzy)."""

import math
from html import escape

from vrx_mj.config.objects import load_object
from vrx_mj.config.world import load_world

__all__ = ["classic_text", "newer_text"]

FUEL = "https://fuel.gazebosim.org/1.0/openrobotics/models/"
TERRAINS = {"sydney_regatta": ("sydney_regatta", "0 0 0.2 0 0 0"), "sand_island": ("sandisland", "0 0 0 0 0 0")}


def tag(name, value, /, **attributes):
    """An element; lists are words, true and false are words."""
    if value is None:
        return ""
    text = " ".join(map(repr, value)) if isinstance(value, list | tuple) else str(value)
    text = text.lower() if isinstance(value, bool) else text
    given = "".join(f' {key}="{escape(str(one))}"' for key, one in attributes.items())
    return f"<{name}{given}>{text}</{name}>\n"


def tags(**values):
    """Several elements."""
    return "".join(tag(name, value) for name, value in values.items())


def plugin(filename, *inside, name="plugin"):
    """A plugin."""
    return tag("plugin", "".join(inside), name=name, filename=filename)


def include(name, uri, pose, *inside):
    """An include."""
    return tag("include", tags(name=name, uri=uri, pose=list(pose)) + "".join(inside))


def place(world):
    """Where a world is on Earth."""
    where = world.georeference
    if where is None:
        return ""
    return tag("spherical_coordinates", tags(
        surface_model="EARTH_WGS84", latitude_deg=where.latitude, longitude_deg=where.longitude,
        elevation=where.elevation, heading_deg=where.heading))  # fmt: skip


def scene(world):
    """Light, sky and fog."""
    found, sky = world.scene, world.scene.sky
    inside = "" if sky is True else tags(time=sky.time, sunrise=sky.sunrise, sunset=sky.sunset) if sky else None
    fog = found.fog and tag("fog", tags(type=found.fog.type, color=list(found.fog.color), start=found.fog.start,
                                        end=found.fog.end, density=found.fog.density))  # fmt: skip
    colors = tags(ambient=found.ambient and list(found.ambient), background=found.background and list(found.background))
    sky_text = "" if inside is None else tag("sky", inside)
    return tag("scene", sky_text + colors + tags(grid=found.grid, origin_visual=found.origin_visual) + (fog or ""))


def waves(sea):
    """The sea of VRX classic, as its macro `ocean_waves` makes it."""
    keys = ("period", "number", "scale", "gain", "angle", "tau", "amplitude", "steepness")
    wave = tag("model", sea.model.upper()) + tag("direction", list(sea.direction))
    wave += "".join(tag(key, getattr(sea, key)) for key in keys)
    return tag("model", tags(static=True) + plugin("libWavefieldModelPlugin.so", tags(static=False, update_rate=30),
                                                   tag("wave", wave)), name="ocean_waves")  # fmt: skip


def published(sea):
    """The sea of VRX 3, as its worlds publish it."""
    numbers = {key: f"type: DOUBLE double_value: {getattr(sea, key)}" for key in
               ("amplitude", "angle", "gain", "period", "scale", "steepness", "tau")}  # fmt: skip
    x, y = sea.direction
    values = numbers | {
        "direction": f"type: DOUBLE double_value: {math.atan2(y, x)!r}",
        "model": f'type: STRING string_value: "{sea.model.upper()}"',
        "number": f"type: INT32 int_value: {sea.number}",
    }
    text = "\n".join(f'params {{\n key: "{key}"\n value {{ {value} }}\n}}' for key, value in values.items())
    topic = "/vrx/wavefield/parameters"
    return plugin("libPublisherPlugin.so", tag("message", text, type="gz.msgs.Param", topic=topic, every="2.0"))


def wind(world, filename):
    """The wind."""
    found = world.wind
    if found is None:
        return ""
    objects = "".join(tag("wind_obj", tags(name=one.model, link_name=f"{one.model}/base_link",
                                           coeff_vector=list(one.coefficients)))
                      for one in found.objects or ())  # fmt: skip
    return plugin(filename, objects, tags(
        wind_direction=found.direction, wind_mean_velocity=found.mean_velocity, var_wind_gain_constants=found.var_gain,
        var_wind_time_constants=found.var_time, random_seed=found.seed, update_rate=found.update_rate))  # fmt: skip


def follower(path, newer):
    """What makes an animal swim."""
    points = path.waypoints and tag("waypoints", "".join(tag("waypoint", list(one)) for one in path.waypoints))
    shapes = "".join(tag(key, "".join(tag(*one) for one in getattr(path, key).model_dump().items()))
                     for key in ("circle", "line") if getattr(path, key))  # fmt: skip
    inside = (points or "") + shapes
    if newer:
        system = "gz::sim::systems::TrajectoryFollower"
        return plugin("gz-sim-trajectory-follower-system", inside, tags(loop=path.loop, force=path.force,
                      torque=path.torque), name=system)  # fmt: skip
    return plugin("libfollow_plugin.so", inside, tags(loop_forever="") if path.loop else "")


def buoyancy(model):
    """VRX 3's buoyancy of an object, which its worlds have in their includes."""
    found = load_object(model).buoyancy
    if found is None:
        return ""
    parts = "".join(
        tag("buoyancy", tags(link_name="link", pose=list(one.pose)) + tag("geometry", tag(
            one.type, tags(size=one.size and list(one.size), radius=one.radius, length=one.length))), name="part")
        for one in found.elements)  # fmt: skip
    return plugin("libPolyhedraBuoyancyDrag.so", tags(fluid_density=found.fluid_density, fluid_level=found.fluid_level,
                  linear_drag=found.linear_drag, angular_drag=found.angular_drag), parts,
                  name="vrx::PolyhedraBuoyancyDrag")  # fmt: skip


def newer_name(model):
    """What VRX 3 calls a model of ours."""
    return (
        model.partition("_2023")[0]
        if "_2023" in model and "phase" not in model
        else model.replace("dock_2023", "dock_2022")
    )


def gates(pairs):
    """The gates of a course."""
    return tag("gates", "".join(tag("gate", tags(left_marker=left, right_marker=right)) for left, right in pairs))


def states(task, name=None):
    """What all scoring plugins have."""
    return tags(vehicle=task.boat or "wamv", task_name=name or task.name or task.type,
                initial_state_duration=task.initial_state_duration, ready_state_duration=task.ready_state_duration,
                running_state_duration=task.running_state_duration, collision_buffer=task.collision_buffer)  # fmt: skip


def markers(world):
    """How places are marked."""
    return tag("markers", tags(scaling=list(world.markers.scaling), height=world.markers.height))


GOALS = {"crocodile": "avoid", "platypus": "circumnavigate_clockwise", "turtle": "circumnavigate_counterclockwise"}


def task_plugins(world, newer):
    """The scoring plugins of a world."""
    task = world.task
    if task is None:
        return ""
    name, inside = _TASKS[task.type](world, task)
    stem = "".join(word.capitalize() for word in name.split("_")) if newer else name
    file = f"lib{stem}ScoringPlugin.so" if newer else f"lib{name}_scoring_plugin.so"
    others = _channel_plugins(world, task, newer) if task.type == "gymkhana" else ""
    return plugin(file, states(task), inside) + others


def _channel_plugins(world, task, newer):
    channel, file = task.channel, "libNavigationScoringPlugin.so" if newer else "libnavigation_scoring_plugin.so"
    first = plugin(file, tags(vehicle="wamv", task_name="gymkhana_channel", collision_buffer=channel.collision_buffer,
                              course_name=channel.course, obstacle_penalty=channel.obstacle_penalty),
                   gates(channel.gates))  # fmt: skip
    file = "libStationkeepingScoringPlugin.so" if newer else "libstationkeeping_scoring_plugin.so"
    return first + plugin(file, tags(vehicle="wamv", task_name="gymkhana_blackbox", head_error_on=False,
                                     goal_pose_cart=list(task.pinger)))  # fmt: skip


def _stationkeeping(world, task):
    goals = tags(goal_pose=task.goal and list(task.goal), goal_pose_cart=task.goal_cart and list(task.goal_cart))
    return "stationkeeping", goals + tags(head_error_on=task.heading) + markers(world)


def _wayfinding(world, task):
    points = "".join(tag("waypoint", tags(pose=list(pose))) for pose in task.waypoints)
    return "wayfinding", tag("waypoints", points) + markers(world)


def _perception(world, task):
    things = "".join(tag("object", tags(time=one.time, duration=one.duration, type=one.type, name=one.name,
                                        pose=list(one.pose))) for one in task.objects)  # fmt: skip
    return "perception", tags(loop_forever=task.loop_forever) + tag("object_sequence", things)


def _navigation(world, task):
    points = {key: getattr(task, key) for key in ("points_per_gate_crossed", "bonus") if hasattr(task, key)}
    return "navigation", tags(course_name=task.course, obstacle_penalty=task.obstacle_penalty, **points) + gates(
        task.gates
    )


def _docking(world, task):
    bays = "".join(tag("bay", tags(name=bay.name, symbol=bay.symbol, dock_allowed=str(bay.dock_allowed),
                                   min_dock_time=task.min_dock_time)) for bay in task.bays)  # fmt: skip
    targets = "".join(
        tag("target", tags(topic=f"vrx/dock_2022_placard{bay}_{size}_hole/contain", bonus_points=points))
        for bay in range(1, len(task.bays) + 1) for size, points in (("big", 5), ("small", 10))
    ) if task.type == "scan_dock_deliver" else ""  # fmt: skip
    points = {
        key: getattr(task, key) for key in ("color_bonus_points", "dock_bonus_points", "correct_dock_bonus_points")
    }
    colors = {f"color_{i}": color for i, color in enumerate(task.color_sequence, 1)}
    return "scan_dock", (tags(enable_color_checker=task.enable_color_checker, **colors, **points) + tag("bays", bays)
                         + (tag("targets", targets) if targets else ""))  # fmt: skip


def _wildlife(world, task):
    models = {one.name: one.model for one in world.objects}
    animals = [(one.name, one.goal or GOALS[models[one.name].partition("_")[0]]) for one in task.animals]
    buoys = "".join(tag("buoy", tags(model_name=name, link_name="link", goal=goal)) for name, goal in animals)
    numbers = tags(engagement_distance=task.engagement_distance, time_bonus=task.time_bonus,
                   publication_frequency=task.publication_rate)  # fmt: skip
    return "wildlife", tag("buoys", buoys) + numbers


def _gymkhana(world, task):
    return "gymkhana", tags(obstacle_penalty=task.obstacle_penalty, pinger_position=list(task.pinger))


def _acoustic_perception(world, task):
    return "acoustic_perception", tags(pinger_position=list(task.pinger), goal_tolerance=task.goal_tolerance)


def _acoustic_tracking(world, task):
    return "acoustic_tracking", tags(pinger_model=task.pinger, pinger_depth=task.pinger_depth,
                                     obstacle_penalty=task.obstacle_penalty)  # fmt: skip


_TASKS = {
    "stationkeeping": _stationkeeping, "station_keeping": _stationkeeping, "wayfinding": _wayfinding,
    "perception": _perception, "navigation_course": _navigation, "follow_path": _navigation, "dock": _docking,
    "scan_and_dock": _docking, "scan_dock_deliver": _docking, "wildlife": _wildlife, "gymkhana": _gymkhana,
    "acoustic_perception": _acoustic_perception, "acoustic_tracking": _acoustic_tracking,
}  # fmt: skip


def document(version, name, body):
    """A whole file."""
    return f'<?xml version="1.0" ?>\n<sdf version="{version}">\n{tag("world", body, name=name)}</sdf>\n'


def classic_text(name):
    """A world of VRX classic as its macros expand."""
    world = load_world(name)
    terrain = ""
    if world.terrain:
        folder, pose = TERRAINS[world.terrain]
        terrain = tag("include", tags(uri=f"model://{folder}", pose=pose))
    things = "".join(include(one.name, f"model://{one.model}", one.pose, follower(one.path, False) if one.path else "")
                     for one in world.objects)  # fmt: skip
    camera = tag("gui", tag("camera", tags(pose=list(world.camera)), name="user_camera")) if world.camera else ""
    sea = waves(world.sea) if world.sea.model != "none" else ""
    body = place(world) + tag("include", tags(uri="model://sun")) + camera + terrain + things + sea
    return document("1.6", "robotx_example_course", body + wind(world, "libusv_gazebo_wind_plugin.so") + scene(world)
                    + task_plugins(world, False))  # fmt: skip


def newer_text(name):
    """A world of VRX 3 as its file has it."""
    world = load_world(name)
    terrain = tag("include", tags(uri=f"{FUEL}sydney_regatta", pose="0 0 0.2 0 0 0")) if world.terrain else ""
    things = "".join(
        include(one.name, f"{FUEL}{newer_name(one.model)}", one.pose, buoyancy(one.model),
                follower(one.path, True) if one.path else "") for one in world.objects)  # fmt: skip
    water = tag("include", tags(name="Coast Waves", uri="coast_waves")) + tag(
        "include", tags(name="platform", uri="platform")
    )
    physics = tag("physics", tags(max_step_size=0.004), name="4ms", type="dart")
    system = plugin("gz-sim-physics-system", name="gz::sim::systems::Physics")
    body = physics + system + place(world) + terrain + water + things + wind(world, "libUSVWind.so")
    return document(
        "1.9", name.rpartition("/")[2], body + scene(world) + published(world.sea) + task_plugins(world, True)
    )
