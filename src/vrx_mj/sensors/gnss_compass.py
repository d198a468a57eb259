"""Two satellite antennas as a compass: true heading and rate of turn of the line from one to the other."""

import math

from vrx_mj.config.sensors import GnssCompassConfig
from vrx_mj.frames import compass
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.kinds import Plot, RecordedNumbers, SensorKind
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.readings import Heading


def heading(config: GnssCompassConfig, place: Place, x_from_east: float, draw: Draw) -> Heading:
    """What a compass at `place` measures, in a world whose x axis is `x_from_east` [rad].

    The heading is that of the sensor's x axis seen from above, and the rate of turn its rate. East is that of the
    world's origin: at Sydney true east is 0.006 degrees off at 1 km.
    """
    x, y, z = place.rotation[:, 0].tolist()
    roll, pitch, yaw = place.spin.tolist()
    turn = yaw - z * (x * roll + y * pitch) / max(x * x + y * y, 1e-12)
    angle = math.atan2(y, x) + x_from_east + draw.error(0, config.heading_noise)
    return _with_variances(math.remainder(angle, 2.0 * math.pi), turn + draw.error(1, config.turn_noise), config)


def _with_variances(angle: float, turn: float, config: GnssCompassConfig) -> Heading:
    return Heading(angle, turn, config.heading_noise**2, config.turn_noise**2)


GNSS_COMPASS = SensorKind(
    GnssCompassConfig,
    lambda now: heading(now.config, now.place, now.x_from_east, now.draw),
    RecordedNumbers(
        lambda _: 2, lambda numbers, config: _with_variances(float(numbers[0]), float(numbers[1]), config), fields=2
    ),
    plots=(
        Plot("heading", "Heading [deg]", lambda data: compass(data.heading)),
        Plot("rate_of_turn", "Rate of turn [deg/s]", lambda data: math.degrees(data.rate_of_turn)),
    ),
)
