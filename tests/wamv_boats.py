"""The WAM-V's URDF as the tests read it: with the standard library, and by no code of ours."""

import xml.etree.ElementTree as ET
from functools import cache

from vrx_mj.formats.parts.read import example_file, load_parts, wamv_urdf

SINGLES = ("camera", "gps", "imu", "lidar", "ground_truth", "pinger", "ball_shooter")
SUITE = {"vrx_sensors_enabled": "true"}
FLAGS = {f"{single}_enabled": "true" for single in SINGLES}

# what a boat is made of: arguments, and the rows of wamv_links.csv that it has
BOATS = {
    "H": ({}, {"H"}),
    "T": ({"thruster_config": "T"}, {"T"}),
    "X": ({"thruster_config": "X"}, {"X"}),
    "H suite": (SUITE, {"H", "suite"}),
    "T suite": ({**SUITE, "thruster_config": "T"}, {"T", "suite"}),
    "X suite": ({**SUITE, "thruster_config": "X"}, {"X", "suite"}),
    "H singles": (FLAGS, {"H", "singles"}),
    "example": (None, {"example"}),
}


@cache
def text_of(boat, namespace="wamv", *, locked=False):
    arguments = BOATS[boat][0]
    if arguments is not None:
        return wamv_urdf(namespace=namespace, locked=locked, arguments=arguments)
    thrusters, components = (load_parts(example_file(kind), kind) for kind in ("thrusters", "components"))
    return wamv_urdf(thrusters=thrusters, components=components, namespace=namespace, locked=locked)


def robot(boat, namespace="wamv", **how):
    return ET.fromstring(text_of(boat, namespace, **how))


def local(element, key="name"):
    return element.get(key).removeprefix("wamv/")


def numbers(text):
    return [float(word) for word in text.split()]


def origin(element):
    place = element.find("origin") if element is not None else None
    if place is None:
        return [0.0] * 3, [0.0] * 3
    return numbers(place.get("xyz", "0 0 0")), numbers(place.get("rpy", "0 0 0"))


def values(element, *names):
    return [float(element.find(f".//{name}").text) for name in names]
