"""Worlds whose boats carry sensors, for tests: the sensors are put into a compiled world."""

import math
import re
from dataclasses import replace

import vrx_mj
from integration.sailing import boats, water
from trees import make_world, typed
from vrx_mj.config.sensors import (
    AnemometerConfig,
    BallShooterConfig,
    EchoSounderConfig,
    GnssCompassConfig,
    GpsConfig,
    ImuConfig,
    P3dConfig,
    PingerConfig,
)
from vrx_mj.frames import rotation
from vrx_mj.mjcf.objects import BALL, ball_name, parked_balls
from vrx_mj.model.world import tree_of

SYDNEY = {"latitude": -33.724223, "longitude": 150.679736}
GPS_AT, IMU_AT, PINGER_AT, GUN_AT = (-0.85, 0.0, 1.3), (0.3, -0.2, 1.3), (1.0, 0.5, -1.0), (0.52, 0.3, 1.4)
LEVEL = (0.0, 0.0, 0.0)
GPS = GpsConfig(name="gps", link="gps_link", pose=(*GPS_AT, *LEVEL))
IMU = ImuConfig(name="imu", link="imu_link", pose=(*IMU_AT, *LEVEL))
P3D = P3dConfig(name="p3d", link="base_link")
PINGER = PingerConfig(name="pinger", link="pinger", pose=(*PINGER_AT, *LEVEL))
QUIET_PINGER = PINGER.model_copy(update={"range_noise": 0.0, "bearing_noise": 0.0, "elevation_noise": 0.0})
GUN = BallShooterConfig(name="gun", link="gun_link", pose=(*GUN_AT, 0.0, -1.04, 0.0))
WIND = AnemometerConfig(name="wind", link="mast", pose=(-0.5, 0.1, 3.0, *LEVEL))
COMPASS = GnssCompassConfig(name="compass", link="mast", pose=(-0.5, 0.0, 1.3, *LEVEL))
SONAR = EchoSounderConfig(name="echo", link="keel", pose=(0.4, -0.2, -0.1, 0.0, math.pi / 2, 0.0))
SUITE = (GPS, IMU, P3D, PINGER)


def row(boat, config):
    """A sensor's row in a compiled world."""
    return {
        "boat": boat,
        "body": f"{boat}/base_link",
        "position": config.pose[:3],
        "rotation": rotation(*config.pose[3:]),
        "frame": f"{boat}/{config.frame or config.link}",
        "config": config.model_dump(),
    }


def equipped(world, sensors, **parameters):
    """The world with these sensors on its boats, a list of configurations for each."""
    rows = [row(boat, config) for boat, configs in sensors.items() for config in configs]
    return make_world(world.mjcf, world.assets, typed({**tree_of(world.parameters), "sensors": rows, **parameters}))


def sailing(sensors=SUITE, *, fleet=None, seed=None, profile="vrx", **world):
    """A simulation in open water at Sydney, with these sensors on boat a, or a mapping of boats to sensors."""
    carried = sensors if isinstance(sensors, dict) else {"a": sensors}
    guns = [(boat, c.name) for boat, configs in carried.items() for c in configs if c.type == "ball_shooter"]
    balls = parked_balls(guns)
    things = [{"name": f"ball{k}", "model": BALL, "pose": list(ball.pose)} for k, ball in enumerate(balls)]
    text = water(**{"georeference": SYDNEY, **world, "objects": [*world.get("objects", []), *things]})
    compiled = vrx_mj.compile_world(text, fleet=fleet or boats((0.0, 0.0, 0.3)))
    world = equipped(_renamed(compiled, guns), carried)
    parameters = replace(world.parameters, profile=profile)  # also one that no world has yet
    return vrx_mj.Simulation(make_world(world.mjcf, world.assets, parameters), seed=seed)


def _renamed(world, guns):
    """The world whose objects ball0, ball1, ... belong to these guns, and sleep."""
    names = {f"ball{k}": ball_name(*gun) for k, gun in enumerate(guns)}
    mjcf, parameters = world.mjcf, dict(tree_of(world.parameters))
    for old, new in names.items():
        mjcf = mjcf.replace(f'"{old}/', f'"{new}/')
    parameters["objects"] = [
        {**item, "name": names.get(item["name"], item["name"]), "body": _body(item["body"], names)}
        for item in tree_of(world.parameters)["objects"]
    ]
    parameters["floats"] = [
        {**item, "body": _body(item["body"], names)} for item in tree_of(world.parameters)["floats"]
    ]
    if guns:
        mjcf = re.sub(r"<option ", '<option sleep_tolerance="0" ', mjcf, count=1)
        mjcf = re.sub(r"<flag ", '<flag sleep="enable" ', mjcf, count=1)
    for new in names.values():
        mjcf = mjcf.replace(f'<body name="{new}/link"', f'<body name="{new}/link" sleep="init"')
    return make_world(mjcf, world.assets, typed(parameters))


def _body(body, names):
    """The name of a thing's body when the thing is renamed."""
    thing, slash, link = body.rpartition("/")
    return names.get(thing, thing) + slash + link
