"""Sea, wind, light, place and task of a Gazebo world as the keys of ours; plugins of both generations of VRX."""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence

from vrx_mj.config.base import without_ignored_keys
from vrx_mj.config.tasks import TASKS, TaskConfig
from vrx_mj.config.tree import literal
from vrx_mj.config.values import COLORS
from vrx_mj.config.weather import GRAVITY, SeaConfig
from vrx_mj.config.world import FogConfig
from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.gazebo.document import NEEDED, POSE, Element, plugin_name
from vrx_mj.formats.series.pieces import At, Content
from vrx_mj.formats.urdf.elements import sections
from vrx_mj.frames import ZERO

_LONGEST_MESSAGE = 20_000
"""Characters of a message that VRX 3's worlds publish; theirs have 2,000."""
_WAVES_MODEL = "wavesmodelsystem"
_WAVE_PLUGINS = ("wavefieldmodelplugin", _WAVES_MODEL)
"""Parts of the names of plugins that make waves."""
_MODELS = ("pms", "cwr", "none")
"""VRX's models of waves."""
_ALGORITHMS = ("fft", "sinusoid", "trochoid")
"""Kinds of waves of asv_wave_sim, the first by default."""
_KEY = re.compile(r'key:\s{0,80}"(\w{1,40})"')
_VALUE = re.compile(r'(?:(?:double|int)_value|[xyz]):\s{0,80}([-+.\deE]{1,40})|string_value:\s{0,80}"(\w{1,20})"')
_BOAT = "wamv"
_TOPICS = ("_topic", "_service", "_topic_name", "robot_namespace")
"""Ends of the tags that name topics."""
_OURS = {"", "vrx", "wamv", "scan_dock", "scan_dock_deliver"}
"""Beginnings of the names of topics that are the same here."""
_LIGHT = "robotx_light_buoy"
"""The light buoy that a task sets; VRX 3's have fixed colours."""
_HOLES = (("big", 5.0), ("small", 10.0))
"""Points for the holes of a placard by default."""
_HOLE = re.compile(r"placard_?(\d)\w{0,40}?_(big|small)_hole")


def wave_plugin(model: Element) -> Element | None:
    """The plugin that makes the waves of a model, of VRX or of asv_wave_sim."""
    plugins = ((one, plugin_name(one)) for one in model.walk() if one.tag == "plugin")
    return next((one for one, name in plugins if any(wave in name for wave in _WAVE_PLUGINS)), None)


def wave_field(plugin: Element) -> Content:
    """The sea of VRX's WavefieldModelPlugin, or of asv_wave_sim's WavesModel, whose tags are in `<wave>`."""
    wave = plugin.child("wave") or plugin
    if _WAVES_MODEL in plugin_name(plugin):
        return _waves_of_algorithm(wave)
    model = _model(wave, wave.text("model") or "PMS")
    return without_ignored_keys(SeaConfig, {"model": model, **wave.fields("wave")})


def _fft(wave: Element) -> Content:
    """A sea that the wind has fully raised: Pierson and Moskowitz (1964), Hs = 2 U^2 sqrt(alpha / beta) / g at 19.5 m.

    From 10 m up to there a wind grows by 2.6 %.
    """
    u, v = wave.value_of("wind_velocity", "x y", (5.0, 0.0))
    speed = wave.value_of("wind_speed", default=math.hypot(u, v))
    angle = wave.value_of("wind_angle_deg", default=math.degrees(math.atan2(v, u)))
    height = 2.0 * (1.026 * speed) ** 2 * math.sqrt(0.0081 / 0.74) / GRAVITY
    towards = [math.cos(math.radians(angle)), math.sin(math.radians(angle))]
    return {"model": "pm", "significant_height": height, "direction": towards}


def _waves_of_algorithm(wave: Element) -> Content:
    """The sea of an algorithm of asv_wave_sim; a trochoid is that of VRX's model `CWR`, there from the start."""
    name = wave.text("algorithm") or "fft"
    if name not in _ALGORITHMS:
        raise wave.fault(str(UnknownNameError("algorithm", name, _ALGORITHMS)), "algorithm")
    sea: Content = {"direction": wave.value_of("direction", "x y", [1.0, 0.0])}
    if name == "fft":
        sea |= _fft(wave)
    elif name == "sinusoid":
        given = wave.fields("sinusoid")
        sea |= {"model": "regular", "height": 2.0 * given["amplitude"], "period": given["period"]}
    else:
        sea |= {"model": "cwr", **wave.fields("trochoid"), "tau": 0.0}
    return without_ignored_keys(SeaConfig, sea)


def published_sea(plugin: Element) -> Content | None:
    """The sea in the message that VRX 3's PublisherPlugin sends again and again; None: it sends another message."""
    message = next((one for one in plugin.all("message") if "wavefield" in one.attributes.get("topic", "")), None)
    if message is None:
        return None
    if len(message.own_text) > _LONGEST_MESSAGE:
        raise message.fault(f"message too long: at most {_LONGEST_MESSAGE} characters")
    _, *rest = _KEY.split(message.own_text)
    texts = {
        name: " ".join(number or text for number, text in _VALUE.findall(body))
        for name, body in zip(rest[::2], rest[1::2], strict=True)
    }
    parts = tuple(Element(name, message.place, {}, text, ()) for name, text in texts.items() if name != "direction")
    found = Element("wave", message.place, {}, "", parts).fields("wave")
    if texts.get("model"):
        found["model"] = _model(message, texts["model"])
    if texts.get("direction"):
        part = Element("direction", message.place, {}, texts["direction"], ())
        x, *more = part.value("x y z"[: 2 * len(part.own_text.split()) - 1])
        found["direction"] = [x, more[0]] if more else [math.cos(x), math.sin(x)]
    return without_ignored_keys(SeaConfig, found)


def _model(element: Element, name: str) -> str:
    """The model of VRX's waves that has a name."""
    if name.lower() not in _MODELS:
        raise element.fault(f"expected PMS, CWR or none, got {literal(name)}", "model")
    return name.lower()


def mean_wind(element: Element) -> Content | None:
    """The wind of gz-sim's `<wind>`, level and without gusts; None: it is calm."""
    x, y, _ = element.value_of("linear_velocity", "x y z", ZERO)
    return {"direction": math.degrees(math.atan2(y, x)), "mean_velocity": math.hypot(x, y)} if x or y else None


def scene(element: Element) -> Content:
    """Light, background, sky and fog; clouds are not drawn, nor taken over."""
    sky = element.child("sky")
    found = {"sky": sky is not None and (sky.fields("sky") or True), **element.fields("scene")}
    fog = element.child("fog/fog") or element.child("fog")  # VRX's macro makes one in another
    if fog is not None and fog.children:
        found["fog"] = without_ignored_keys(FogConfig, fog.fields("fog"))
    return found


def view(gui: Element) -> list[float] | None:
    """The pose that the view opens with, of either Gazebo."""
    poses = (one.value_of("camera/pose|camera_pose", POSE) for one in (gui, *gui.all("plugin")))
    return next(filter(None, poses), None)


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
                yield child, "topics keep VRX's names"
        elif child.tag == "frame":
            if text not in {"", plugin.text("vehicle") or _BOAT}:
                yield child, "poses are always relative to the boat"
        elif child.tag not in known and f"{kind}/{child.tag}" not in known:
            yield child, "this plugin does not read it"


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


def _wildlife(plugin: Element, *_: object) -> Content:
    """Animals by the names of their models; a link's name has before it that of a model in the model."""
    animals = []
    for buoy in plugin.all("buoys/buoy"):
        row = buoy.fields("animal")
        inner = buoy.text("link_name").removeprefix(f"{row['name']}::").split("::")[:-1]
        animals.append(At(row | {"name": "/".join([row["name"], *inner])}, buoy.place))
    return {"type": "wildlife", "animals": animals, **plugin.fields("wildlife")}


def _navigation(plugin: Element, *_: object) -> Content:
    """A channel of VRX classic, or a path of VRX 3, whose plugin of that name gives points."""
    points = plugin.fields("navigation points")
    by_points = bool(points) or plugin.attribute("name").startswith("vrx::")
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


def _scan_dock(plugin: Element, _: object, objects: Sequence[Content]) -> Content:
    targets, rows = plugin.all("targets/target"), plugin.fields("scandock")
    light = next((one for one in objects if one["model"] == _LIGHT), None)
    dock = next((one for one in objects if re.match(r"(vrx_)?dock_(?!block)", one["model"])), None)
    if dock is None:
        raise plugin.fault("this task needs a dock, but the world has none")
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
            raise target.fault("expected the topic of a hole, as in vrx/dock_2022_placard1_big_hole/contain", "topic")
        points = target.value_of("bonus_points", default=0.0)
        found.append({"bay": int(hole[1]), "size": hole[2], "points": points})
    usual = [{"bay": bay, "size": size, "points": points} for bay in range(1, bays + 1) for size, points in _HOLES]
    return {"targets": found} if sorted(found, key=str) != sorted(usual, key=str) and found else {}


_TASKS: Mapping[str, Callable[[Element, Sequence[Element], Sequence[Content]], Content]] = {
    "acousticperception": _by_rows, "acoustictracking": _by_rows, "gymkhana": _gymkhana,
    "navigation": _navigation, "perception": _by_rows, "scandock": _scan_dock,
    "stationkeeping": _stationkeeping, "wayfinding": _wayfinding, "wildlife": _wildlife,
}  # fmt: skip
