"""A rosbridge and a client of it."""

import pytest

from bridged import Bridged
from rosbridge_client import Talk


@pytest.fixture(scope="module")
def bridged():
    with Bridged() as made:
        yield made


@pytest.fixture
def talk(bridged):
    with Talk(bridged) as made:
        yield made
