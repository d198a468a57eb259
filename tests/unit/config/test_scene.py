"""What is only looked at: the sky's hours."""

import pytest
from pydantic import ValidationError

from vrx_mj.config.world import SkyConfig


@pytest.mark.parametrize(("sunrise", "sunset", "fine"), [(6.0, 20.0, True), (6.0, 6.0, False), (7.0, 6.0, False)])
def test_the_sun_sets_after_it_rises(sunrise, sunset, fine):
    if fine:
        assert SkyConfig(sunrise=sunrise, sunset=sunset).sunset == sunset
    else:
        with pytest.raises(ValidationError):
            SkyConfig(sunrise=sunrise, sunset=sunset)
