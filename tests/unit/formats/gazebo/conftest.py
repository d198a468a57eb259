"""What the tests of files of Gazebo share."""

import pytest

from vrx_mj.formats.gazebo.document import STRICT


@pytest.fixture
def strict():
    """What cannot be read of a world is an error."""
    token = STRICT.set(True)
    yield
    STRICT.reset(token)
