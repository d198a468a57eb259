"""Sea, wind, light and place of a Gazebo world as the keys of ours."""

import math
import re

from vrx_mj.config.base import without_ignored_keys
from vrx_mj.config.scene import FogConfig
from vrx_mj.config.sea import GRAVITY, SeaConfig
from vrx_mj.config.wording import literal
from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.gazebo.document import POSE, Element, plugin_name
from vrx_mj.formats.series.pieces import Content

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
        raise message.fault(f"a message of more than {_LONGEST_MESSAGE} characters is too long")
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
    x, y, _ = element.value_of("linear_velocity", "x y z", (0.0, 0.0, 0.0))
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
