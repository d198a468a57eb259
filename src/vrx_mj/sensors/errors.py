"""Errors of sensors as Hector's plugins model them: offset, drift and white noise along three axes.

Hector scales a drift's increments by the interval instead of its root, so that its size depends on the rate; here a
drift has the standard deviation that is configured. VRX configures none.
"""

from functools import lru_cache

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import ErrorModel
from vrx_mj.physics.noise import axis_error, stream_key


class Draw:
    """The random numbers of one measurement of one sensor."""

    def __init__(self, seed: int, boat: str, sensor: str, index: int, rate: float, *, life: int = 0) -> None:
        self.key = _key(seed, boat, sensor, life)
        """Key of the sensor's stream."""
        self.index = index
        """Number of the measurement."""
        self.rate = rate
        """Measurements per second."""

    def error(
        self, axis: int, noise: float, *, offset: float = 0.0, drift: float = 0.0, frequency: float = 0.0
    ) -> float:
        """One error; every `axis` of a sensor is a stream of its own."""
        if noise == drift == 0.0:
            return offset
        return float(axis_error(np.uint64(self.key), axis, self.index, offset, drift, frequency / self.rate, noise))


@lru_cache(maxsize=4096)
def _key(seed: int, boat: str, sensor: str, life: int) -> int:
    """Key of a sensor's stream; a boat with the name of one that left, in its next `life`, has streams of its own."""
    return stream_key(seed, "sensor", boat, sensor, *([life] if life else []))


def errors(model: ErrorModel, draw: Draw, axis: int) -> FloatArray:
    """(3,) errors along the axes of a model, whose streams are `axis` and the two after it."""
    return np.array([axis_of(model, draw, axis, k) for k in range(3)])


def axis_of(model: ErrorModel, draw: Draw, axis: int, k: int) -> float:
    """The error along axis `k` of a model whose first stream is `axis`."""
    offset, drift, frequency = model.offset[k], model.drift[k], model.drift_frequency[k]
    return draw.error(axis + k, model.noise[k], offset=offset, drift=drift, frequency=frequency)


def variances(model: ErrorModel) -> FloatArray:
    """(3,) variances of the errors, drift included: what Hector's plugins write into covariances."""
    return np.square(model.drift) + np.square(model.noise)


def covariance(*variance: float) -> tuple[float, ...]:
    """(9,) row by row: the covariance of three errors that have nothing to do with each other."""
    return tuple(float(value) for value in np.diag(variance).flat)
