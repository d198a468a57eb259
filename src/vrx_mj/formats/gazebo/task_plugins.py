"""The scoring plugins of both generations of VRX as a world's task."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence

from vrx_mj.config.tasks import TASKS, TaskConfig
from vrx_mj.config.values import COLORS
from vrx_mj.formats.gazebo.document import NEEDED, Element, plugin_name
from vrx_mj.formats.series.pieces import At, Content
from vrx_mj.formats.urdf.tags import sections

_BOAT = "wamv"
_TOPICS = ("_topic", "_service", "_topic_name", "robot_namespace")
"""Ends of the tags that name topics."""
_OURS = {"", "vrx", "wamv", "scan_dock", "scan_dock_deliver"}
"""Beginnings of the names of topics that are the same here."""


def kind_of(plugin: Element) -> str | None:
    """Kind of one of VRX's scoring plugins, as `scandock`; None for another plugin."""
    found = re.fullmatch(r"(\w+?)(vrx)?scoringplugin", plugin_name(plugin))
    return found[1] if found and found[1] in _TASKS else None


def task_of(plugins: Sequence[Element], objects: Sequence[Content]) -> tuple[Element, Content]:
    """The task of a world's scoring plugins, and the plugin that says most of it.

    A gymkhana has three plugins; otherwise the first one counts. `objects` are those of the world.
    """
    first = next((plugin for plugin in plugins if kind_of(plugin) == "gymkhana"), plugins[0])
    own = _TASKS[kind_of(first) or ""](first, plugins, objects)
    return first, {"type": own["type"]} | _common(first, own) | own


def unread(plugin: Element) -> Iterator[tuple[Element, str]]:
    """The elements of a scoring plugin without effect here by which something is lost, each with the reason."""
    kind, known = kind_of(plugin), sections()["scoring plugin"]
    for child in plugin.children:
        text = child.own_text.strip("/")
        if child.tag.endswith(_TOPICS):
            if text.partition("/")[0] not in _OURS | {plugin.text("vehicle")}:
                yield child, "topics have the names that VRX gives them"
        elif child.tag == "frame":
            if text not in {"", plugin.text("vehicle") or _BOAT}:
                yield child, "poses are relative to the boat"
        elif child.tag not in known and f"{kind}/{child.tag}" not in known:
            yield child, "no such element is read of this plugin"


def markers_of(plugin: Element) -> Content | None:
    """Markers of the places of a task."""
    markers = plugin.child("markers")
    if markers is None:
        return None
    color = markers.text("material").rpartition("/")[2].lower()
    return markers.fields("markers") | ({"color": color} if color in COLORS else {})


def _common(plugin: Element, own: Content) -> Content:
    """Keys of all tasks that differ from our defaults; what a plugin leaves out is as in scoring_plugin.cc."""
    ours, found = TASKS.get(own["type"], TaskConfig).model_fields, plugin.fields("scoring plugin").items()
    return {key: value for key, value in found if value not in {_BOAT, own["type"], ours[key].default}}


def _by_rows(plugin: Element, *_: object) -> Content:
    """A task that has a row for each key."""
    kind = kind_of(plugin) or ""
    return {"type": kind.replace("acoustic", "acoustic_"), **plugin.fields(kind)}


def _stationkeeping(plugin: Element, *_: object) -> Content:
    name = plugin.text("task_name")
    found = plugin.fields("stationkeeping")
    usual = {"goal_cart"} if "goal" in found else set[str]()
    usual |= {"heading"} if found.get("heading") else set()
    kind = name if name in {"stationkeeping", "station_keeping"} else "stationkeeping"
    return {"type": kind, **{key: value for key, value in found.items() if key not in usual}}


def _wayfinding(plugin: Element, *_: object) -> Content:
    poses = [point.value_of("pose", "latitude longitude yaw") for point in plugin.all("waypoints/waypoint")]
    if not poses or None in poses:
        raise plugin.fault("each <waypoint> of <waypoints> needs a <pose>", "waypoints")
    return {"type": "wayfinding", "waypoints": poses}


def _navigation(plugin: Element, *_: object) -> Content:
    points = plugin.fields("navigation points")
    by_points = bool(points) or plugin.text("task_name") == "follow_path"
    return {"type": "follow_path" if by_points else "navigation_course", **_channel(plugin), **points}


def _channel(plugin: Element) -> Content:
    gates = plugin.all("gates/gate")
    pairs = [At([*gate.fields("gate").values()], gate.place) for gate in gates]
    return {**plugin.fields("channel"), **({"gates": pairs} if pairs else {}), **plugin.fields("gymkhana")}


def _gymkhana(plugin: Element, plugins: Sequence[Element], _: object) -> Content:
    channel = next((one for one in plugins if kind_of(one) == "navigation"), None)
    if channel is None:
        raise plugin.fault("a gymkhana needs a navigation scoring plugin")
    course = _channel(channel) | channel.fields("gymkhana channel")
    pinger = plugin.value_of("pinger_position", "x y z", NEEDED)
    return {"type": "gymkhana", "channel": course, "pinger": pinger, **plugin.fields("gymkhana")}


_LIGHT = "robotx_light_buoy"
"""The light buoy that a task sets; VRX 3's have fixed colours."""
_HOLES = (("big", 5.0), ("small", 10.0))
"""Points for the holes of a placard by default."""
_HOLE = re.compile(r"placard_?(\d)\w{0,40}?_(big|small)_hole")


def _scan_dock(plugin: Element, _: object, objects: Sequence[Content]) -> Content:
    targets, rows = plugin.all("targets/target"), plugin.fields("scandock")
    light = next((one for one in objects if one["model"] == _LIGHT), None)
    dock = next((one for one in objects if re.match(r"(vrx_)?dock_(?!block)", one["model"])), None)
    if dock is None:
        raise plugin.fault("no dock is among the models of the world, which this task needs")
    name = plugin.text("task_name")
    usual = "scan_dock_deliver" if targets else "scan_and_dock" if light else "dock"
    known = name in {"dock", "scan_and_dock", "scan_dock_deliver"} and not (name == "dock" and light is not None)
    found: Content = {"type": name if known else usual, "dock": dock["name"]}
    if light is not None:
        found["light_buoy"] = light["name"]
    colors = [plugin.text(f"color_{i}").lower() for i in (1, 2, 3)]
    sequence = {"color_sequence": colors} if all(colors) else {}
    return {**found, **sequence, **rows, **_targets(targets, len(rows["bays"]))}


def _targets(targets: Sequence[Element], bays: int) -> Content:
    """Points of holes, unless they are the usual ones of all bays."""
    found = []
    for target in targets:
        if (hole := _HOLE.search(target.text("topic"))) is None:
            raise target.fault("expected the topic of a hole, as vrx/dock_2022_placard1_big_hole/contain", "topic")
        points = target.value_of("bonus_points", default=0.0)
        found.append({"bay": int(hole[1]), "size": hole[2], "points": points})
    usual = [{"bay": bay, "size": size, "points": points} for bay in range(1, bays + 1) for size, points in _HOLES]
    return {"targets": found} if sorted(found, key=str) != sorted(usual, key=str) and found else {}


_TASKS: Mapping[str, Callable[[Element, Sequence[Element], Sequence[Content]], Content]] = {
    "acousticperception": _by_rows, "acoustictracking": _by_rows, "gymkhana": _gymkhana,
    "navigation": _navigation, "perception": _by_rows, "scandock": _scan_dock,
    "stationkeeping": _stationkeeping, "wayfinding": _wayfinding, "wildlife": _by_rows,
}  # fmt: skip
