"""CORA, by the figures of VRX's cora_description."""

import pytest

from vrx_mj.config.fleet import Order
from vrx_mj.mjcf.build import build_boat

CORA_LINKS = {  # mass, moments of inertia, place in the base link
    "dummy_link": (33000, (20700, 420000, 420000), (0, 0, 1)),
    "left_engine_link": (0.1, (0.00889245, 0.00911125, 0.00078125), (-6.103, 0.911, 0.016)),
    "right_engine_link": (0.1, (0.00889245, 0.00911125, 0.00078125), (-6.103, -0.911, 0.016)),
    "left_propeller_link": (0.5, (0.008545, 0.008545, 0.0144), (-6.103, 0.911, 0.016)),
    "right_propeller_link": (0.5, (0.008545, 0.008545, 0.0144), (-6.103, -0.911, 0.016)),
}


def test_cora_weighs_and_pushes_as_vrxs():
    boat = build_boat(Order("cora"))  # without a warning
    parts = {part.name: part for part in boat.parts}
    for name, (mass, moments, place) in CORA_LINKS.items():
        inertial = parts[name].inertial
        assert (inertial.mass, inertial.tensor) == (mass, (*moments, 0, 0, 0))
        assert parts[name].pose == pytest.approx((*place, 0, 0, 0))
    total = sum(part.inertial.mass for part in boat.parts if part.inertial)
    assert total == pytest.approx(33004.65, abs=0.005)
    for jet, y in zip(boat.thrusters, (0.911, -0.911), strict=True):
        assert (jet.joint, jet.drive.mapping, jet.drive.max_angle) == (None, "linear", 0)
        assert (jet.drive.max_force_forward, jet.drive.max_force_reverse) == (120_000, -50_000)
        assert jet.pose == pytest.approx((-6.103, y, 0.016, 0, 0, 0))
