"""Sea, wind, light and place of a Gazebo world as the keys of ours."""

import math
import re
from typing import Any

from vrx_mj.config.base import without_ignored_keys
from vrx_mj.config.scene import FogConfig
from vrx_mj.config.sea import GRAVITY, SeaConfig
from vrx_mj.config.wording import shown
from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.gazebo.document import Element

Content = dict[str, Any]

WAVES = ("number", "gain", "period", "angle", "scale", "tau", "amplitude", "steepness")
"""Elements of a wave field that are one number."""
LONGEST_MESSAGE = 20_000
"""Characters of a message that VRX 3's worlds publish; theirs have 2,000."""
WAVES_MODEL = "waves-model-system"
WAVE_PLUGINS = ("wavefieldmodelplugin", WAVES_MODEL)
"""In the names of the files of plugins that make waves."""
MODELS = ("pms", "cwr", "none")
"""VRX's models of waves."""
_KEY = re.compile(r'key:\s{0,80}"(\w{1,40})"')
_VALUE = re.compile(r'(?:(?:double|int)_value|[xyz]):\s{0,80}([-+.\deE]{1,40})|string_value:\s{0,80}"(\w{1,20})"')


def wave_plugin(model: Element) -> Element | None:
    """The plugin that makes the waves of a model, of VRX or of asv_wave_sim."""
    plugins = (one for one in model.walk() if one.tag == "plugin")
    files = ((one, one.attributes.get("filename", "").lower().replace("_", "")) for one in plugins)
    return next((one for one, file in files if any(name in file for name in WAVE_PLUGINS)), None)


def wave_field(plugin: Element) -> Content:
    """The sea of VRX's WavefieldModelPlugin, or of asv_wave_sim's WavesModel, whose tags are in `<wave>`."""
    wave = plugin.child("wave") or plugin
    if WAVES_MODEL in plugin.attributes.get("filename", "").lower():
        return _waves_of_algorithm(wave)
    sea: Content = wave.given(*WAVES)
    direction = wave.numbers("direction", "x y")
    if "number" in sea:
        sea["number"] = wave.whole("number")
    model = _model(wave, wave.text("model") or "PMS")
    return without_ignored_keys(SeaConfig, {"model": model, **sea, **({"direction": direction} if direction else {})})


def _sinusoid(wave: Element) -> Content:
    given = {"amplitude": 0.0, "period": 1.0, **wave.given("amplitude", "period")}
    return {"model": "regular", "height": 2.0 * given["amplitude"], "period": given["period"]}


def _trochoid(wave: Element) -> Content:
    """The waves that VRX's model `CWR` has, too, which are there from the start."""
    usual = {"number": 1, "scale": 2.0, "angle": math.pi / 5.0, "steepness": 1.0, "amplitude": 0.0, "period": 1.0}
    return {"model": "cwr", **usual, **wave.given(*usual), "number": wave.whole("number", 1), "tau": 0.0}


def _fft(wave: Element) -> Content:
    """A sea that the wind has fully raised: Pierson and Moskowitz (1964), Hs = 2 U^2 sqrt(alpha / beta) / g at 19.5 m.

    From 10 m up to there a wind grows by 2.6 %.
    """
    u, v = wave.numbers("wind_velocity", "x y") or (5.0, 0.0)
    usual = {"wind_speed": math.hypot(u, v), "wind_angle_deg": math.degrees(math.atan2(v, u))}
    speed, angle = (usual | wave.given(*usual)).values()
    height = 2.0 * (1.026 * speed) ** 2 * math.sqrt(0.0081 / 0.74) / GRAVITY
    towards = [math.cos(math.radians(angle)), math.sin(math.radians(angle))]
    return {"model": "pm", "significant_height": height, "direction": towards}


_ALGORITHMS = {"fft": _fft, "sinusoid": _sinusoid, "trochoid": _trochoid}
"""Kinds of waves of asv_wave_sim, of which it makes the first by default."""


def _waves_of_algorithm(wave: Element) -> Content:
    name = wave.text("algorithm") or "fft"
    if name not in _ALGORITHMS:
        raise wave.fault(str(UnknownNameError("algorithm", name, _ALGORITHMS)), "algorithm")
    direction = wave.numbers("direction", "x y") or [1.0, 0.0]
    return without_ignored_keys(SeaConfig, {"direction": direction, **_ALGORITHMS[name](wave)})


def published_sea(plugin: Element) -> Content | None:
    """The sea in the message that VRX 3's PublisherPlugin sends again and again; None: it sends another message."""
    message = next((one for one in plugin.all("message") if "wavefield" in one.attributes.get("topic", "")), None)
    if message is None:
        return None
    if len(message.own_text) > LONGEST_MESSAGE:
        raise message.fault(f"a message of more than {LONGEST_MESSAGE} characters is too long")
    found: Content = {}
    _, *rest = _KEY.split(message.own_text)
    for name, body in zip(rest[::2], rest[1::2], strict=True):
        values = [number or text for number, text in _VALUE.findall(body)]
        if values and name == "direction":
            numbers = [_published(message, name, value) for value in values]
            found["direction"] = numbers[:2] if len(numbers) > 1 else [math.cos(numbers[0]), math.sin(numbers[0])]
        elif values and name == "model":
            found["model"] = _model(message, values[0])
        elif values and name in WAVES:
            number = _published(message, name, values[0])
            if name == "number" and not number.is_integer():
                raise message.fault(f"expected a whole number, got {shown(values[0])}", name)
            found[name] = int(number) if name == "number" else number
    return without_ignored_keys(SeaConfig, found)


def _model(element: Element, name: str) -> str:
    """The model of VRX's waves that has a name."""
    if name.lower() not in MODELS:
        raise element.fault(f"expected PMS, CWR or none, got {shown(name)}", "model")
    return name.lower()


def _published(message: Element, name: str, text: str) -> float:
    """A number of a message."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise message.fault(f"expected a number, got {shown(text)}", name)
    return number


def wind(plugin: Element) -> Content:
    """The wind of VRX's wind plugins, with what it pushes."""
    numbers = {
        "direction": "wind_direction",
        "mean_velocity": "wind_mean_velocity",
        "var_gain": "var_wind_gain_constants",
        "var_time": "var_wind_time_constants",
    }
    given = plugin.given(*numbers.values())
    found: Content = {key: given[tag] for key, tag in numbers.items() if tag in given}
    objects = [
        {"model": thing.text("name") or _missing(thing, "name"), "coefficients": _coefficients(thing)}
        for thing in plugin.all("wind_obj")
    ]
    seed = plugin.whole("random_seed", 0)
    return {**found, "seed": seed, **plugin.given("update_rate"), "objects": objects}


def _coefficients(thing: Element) -> list[float]:
    return thing.numbers("coeff_vector", "x y yaw") or _missing(thing, "coeff_vector")


def _missing(element: Element, tag: str) -> Any:
    raise element.fault(f"<{tag}> is required, but missing")


def scene(element: Element) -> Content:
    """Light, background, sky and fog."""
    found: Content = {"sky": _sky(element.child("sky"))}
    for tag in ("grid", "origin_visual", "shadows"):
        if element.text(tag):
            found[tag] = element.switch(tag)
    for tag in ("ambient", "background"):
        color = _color(element, tag)
        if color is not None:
            found[tag] = color
    fog = element.child("fog", "fog") or element.child("fog")  # VRX's macro makes one in another
    if fog is not None and fog.children:
        found["fog"] = _fog(fog)
    return found


def _sky(sky: Element | None) -> Any:
    """Hours of the sky, or whether there is one: clouds are not drawn, nor taken over."""
    if sky is None:
        return False
    return sky.given("time", "sunrise", "sunset") or True


def _fog(fog: Element) -> Content:
    found: Content = {"type": fog.text("type")} if fog.text("type") else {}
    color = _color(fog, "color")
    found |= {**({"color": color} if color else {}), **fog.given("start", "end", "density")}
    return without_ignored_keys(FogConfig, found)


def _color(element: Element, tag: str) -> list[float] | None:
    """Red, green and blue, and alpha where it is given."""
    found = element.child(tag)
    if found is None or not found.own_text:
        return None
    return found.read_numbers("r g b" if len(found.own_text.split()) == 3 else "r g b a")


def georeference(element: Element) -> Content:
    """Where the origin is on Earth."""
    found: Content = {key: element.number(f"{key}_deg", 0.0) for key in ("latitude", "longitude")}
    return found | {"elevation": element.number("elevation", 0.0), "heading": element.number("heading_deg", 0.0)}


def view(gui: Element) -> list[float] | None:
    """The pose that the view opens with, of either Gazebo."""
    pose = gui.child("camera", "pose")
    scenes = (plugin.child("camera_pose") for plugin in gui.all("plugin"))
    found = pose or next((one for one in scenes if one is not None), None)
    return found.read_numbers("x y z roll pitch yaw") if found is not None else None
