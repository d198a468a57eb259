"""Worlds that are served."""

import pytest

import vrx_mj
from ros_scene import SERVERS, served
from vrx_mj.ros.table import viewers

SENSORS = ["gps", "imu", "pinger"]


@pytest.fixture(autouse=True)
def _closed():
    """Close what a test served."""
    yield
    while SERVERS:
        SERVERS.pop().close()


@pytest.fixture(autouse=True)
def _markers_are_few(request, monkeypatch):
    """Every server makes markers for viewers first, of shores of 60,000 corners: few tests look at them."""
    if request.path.name not in {"test_viewers.py", "test_bags.py", "test_foxglove.py"}:
        monkeypatch.setattr(viewers, "_markers", lambda *_: iter(()))


@pytest.fixture(scope="session")
def course():
    return vrx_mj.compile_world("example_course")


@pytest.fixture(scope="session")
def bay():
    """Two boats on open water, with a GPS, an IMU, ground truth and nothing that draws."""
    return vrx_mj.compile_world(
        {"extends": "sydney_regatta"},
        fleet={
            "usv_count": 2,
            "layout": "line",
            "spacing": 12.0,
            "origin": "spawn",
            "sensors": ["gps", "imu", "pinger"],
        },
    )


@pytest.fixture
def scene(bay):
    return served(bay)
