"""Joints of a made-up boat: how its propellers turn by what its engines give, and what of it is a message."""

from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.ros.table.boats import BoatFrames, BoatJoint, Spin


def joint(name):
    return BoatJoint(name, "a/base", f"a/{name}", np.zeros(3), np.eye(4)[0], np.eye(3)[2], True, np.zeros(3))


@pytest.fixture
def frames():
    """An engine in newtons and one of shares, both with a shaft."""
    sim = SimpleNamespace(
        time=1.0, thrust=lambda _: {"n": 100.0, "s": -125.0}, steering=lambda _: {"n": 0.25, "s": 0.5}
    )
    one = BoatFrames.__new__(BoatFrames)
    one._host, one.boat, one._time, one._spins = SimpleNamespace(sim=sim), "a", 0.0, {}
    vars(one)["_drives"] = {
        "n": SimpleNamespace(command=lambda force: force, max_command=200.0),
        "s": SimpleNamespace(command=lambda force: force / 250.0, max_command=1.0),
    }
    vars(one)["_thruster_joints"] = [
        (joint("n_engine"), "n", True), (joint("n_shaft"), "n", False), (joint("s_shaft"), "s", False),
    ]  # fmt: skip
    return one


def test_a_propeller_turns_by_its_engines_share_of_full_power(frames):
    spins = frames._propeller_spins()
    assert spins == {"n": Spin().after(1.0, 0.5), "s": Spin().after(1.0, -0.5)}
    frames._host.sim.time = 1.5
    assert frames._propeller_spins()["n"] == Spin().after(1.0, 0.5).after(0.5, 0.5)
    assert frames._propeller_spins()["n"] == Spin().after(1.0, 0.5).after(0.5, 0.5).after(0.0, 0.5)
    frames._host.sim.time = 0.25  # time began anew: everything stands
    assert frames._propeller_spins()["n"] == Spin().after(0.0, 0.5)


def test_states_of_joints_are_angles_of_engines_and_turns_of_shafts(frames):
    message = frames.joints()
    turned, other = Spin().after(1.0, 0.5), Spin().after(1.0, -0.5)
    assert list(message.name) == ["n_engine", "n_shaft", "s_shaft"]
    assert list(message.position) == pytest.approx([0.25, turned.angle, other.angle])
    assert list(message.velocity) == pytest.approx([0.0, turned.rate, other.rate])
    assert list(message.effort) == pytest.approx([0.0, 1.0, -1.0])
    assert message.header.stamp.sec == 1


@pytest.mark.parametrize(("command", "torque"), [(0.1, 0.0), (0.11, 0.22), (-0.1, 0.0), (-1.0, -2.0)])
def test_a_tenth_of_the_power_does_not_turn_a_propeller(command, torque):
    spin = Spin().after(0.1, command)
    assert spin.torque == pytest.approx(torque)
    assert (spin.rate != 0.0) is (torque != 0.0)


def test_friction_stops_a_slow_propeller_and_none_turns_faster_than_a_hundred():
    assert Spin(rate=0.1).after(0.1, 0.0).rate == 0.0
    fast = Spin(rate=99.0).after(1e-3, 1.0)
    assert fast.rate < 100.0
    assert Spin(rate=1e4).after(1e-3, 1.0).rate == 100.0
    assert abs(Spin(angle=3.0).after(0.01, 1.0).angle) <= np.pi
