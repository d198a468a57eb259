"""Waves in columns against the sums over the table of waves: heights to the bit, motions to rounding."""

import math

import numpy as np
import pytest

from unit.physics.rows import sea
from vrx_mj.physics.kinematics import orbital_motion, orbital_turning
from vrx_mj.physics.waves import surface_height, wave_columns
from vrx_mj.spectra import Site, irregular_sea, jonswap


@pytest.mark.parametrize("depth", [math.inf, 3.0])
@pytest.mark.parametrize("count", [0, 1, 7, 8, 60, 61])
@pytest.mark.parametrize("far", [1.0, 1e6])
def test_columns_give_the_sums(count, depth, far):
    """Far: phases beyond a million radians, of which the C library takes the cosine."""
    components = irregular_sea(jonswap(2.4), 0.3, (0.8, 7.0), (1.0, 0.2), count, 8.0, Site(depth)) if count else []
    phases = np.random.default_rng(count).uniform(0.0, 6.28, count)
    rows = [wave._asdict() | {"steepness": 0.0, "phase": p} for wave, p in zip(components, phases, strict=True)]
    waves, record = sea(rows, depth=depth, level=0.3, tau=20.0)
    columns, reach, past = wave_columns(waves, record, 4), (0.9, -0.4, 0.5), (0.02, -0.01, 0.005)
    for x, y, z, t in np.random.default_rng(5).uniform((-90, -90, -4, 0), (90, 90, 1, 900), (50, 4)):
        assert surface_height(columns, record, far * x, y, t) == surface_height(waves, record, far * x, y, t)
        found, summed = (orbital_motion(rows, record, far * x, y, z, t, reach, past) for rows in (columns, waves))
        assert found == pytest.approx(summed, rel=0, abs=1e-15 * max(count, 1))  # in another order
        turned, rows_turned = (
            orbital_turning(rows, record, reach, far * x, y, z, t, past) for rows in (columns, waves)
        )
        assert turned == pytest.approx(rows_turned, rel=0, abs=1e-14 * max(count, 1))
