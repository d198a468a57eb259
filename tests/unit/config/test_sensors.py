"""What a file may say of a sensor, and what it may not."""

import pytest
from pydantic import TypeAdapter, ValidationError

from vrx_mj.config.sensors import CameraConfig, ErrorModel, SensorConfig

SENSOR = TypeAdapter(SensorConfig)
SPREADS = ("noise", "drift", "drift_frequency")


@pytest.mark.parametrize("field", SPREADS)
def test_a_spread_is_not_negative(field):
    with pytest.raises(ValidationError) as caught:
        ErrorModel.model_validate({field: [0.1, -0.1, 0.0]})
    (problem,) = caught.value.errors()
    assert (problem["loc"], problem["msg"]) == ((field, 1), "Input should be greater than or equal to 0")


def test_an_offset_has_a_sign():
    assert ErrorModel.model_validate({"offset": [0.1, -0.1, 0.0]}).offset == (0.1, -0.1, 0.0)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"type": "camera", "near": 2, "far": 1}, "invalid near 2 m and far 1 m: near must be below far"),
        ({"type": "camera", "near": 2, "far": 2}, "invalid near 2 m and far 2 m: near must be below far"),
        ({"type": "echo_sounder", "range": [9, 9]}, "the nearest must be below the farthest, got [9, 9]"),
        (
            {"type": "lidar", "azimuth": [-60.0, 60.0]},
            "invalid azimuth [-60.0, 60.0] rad: at most a full turn, 2 pi, either way",
        ),
        (
            {"type": "lidar", "azimuth": [0.0, 6.3]},
            "invalid azimuth [0.0, 6.3] rad: at most a full turn, 2 pi, either way",
        ),
    ],
)
def test_what_sees_nothing_or_is_in_degrees_is_told(values, message):
    with pytest.raises(ValidationError) as caught:
        SENSOR.validate_python({"name": "eye", "link": "mast", **values})
    (problem,) = caught.value.errors()
    assert problem["msg"] == message


def test_a_camera_without_antialiasing_is_written_as_before_there_was_any():
    """So saved worlds and their hashes stay."""
    plain, smooth = (CameraConfig(name="c", link="l", antialiasing=samples) for samples in (0, 4))
    assert "antialiasing" not in plain.model_dump()
    assert smooth.model_dump()["antialiasing"] == 4
    with pytest.raises(ValueError, match="0, 2 or 4"):
        CameraConfig(name="c", link="l", antialiasing=3)
