"""The address that other machines are told."""

import socket
from types import SimpleNamespace

import psutil
import pytest

from ros_scene import Fake
from vrx_mj.ros import network, serve
from vrx_mj.ros.serve import ServeOptions, _announce, _show_addresses

FAR = "203.0.113.7"


@pytest.fixture(autouse=True)
def _unset(monkeypatch):
    monkeypatch.delenv("ROS_IP", raising=False)
    monkeypatch.delenv("ROS_HOSTNAME", raising=False)


@pytest.fixture
def without_route(monkeypatch):
    """A machine without a default route."""
    monkeypatch.setattr(network, "NOWHERE", "255.255.255.255")  # the kernel refuses to connect to it, as without route


def told(**wanted):
    lines = []
    _show_addresses(ServeOptions(**wanted), lambda level, text: lines.append((level, text)))
    return lines


@pytest.mark.parametrize(("host", "is_warned"), [("127.0.0.1", False), ("localhost", False), ("0.0.0.0", True)])
def test_who_listens_for_other_machines_is_warned_and_told_what_to_type_there(host, is_warned, monkeypatch):
    lines = []
    sim = SimpleNamespace(boats=("a", "b"), world=SimpleNamespace(name="bay"))
    monkeypatch.setattr(serve, "announced_address", lambda *_: FAR)
    monkeypatch.setattr(serve, "unreachable", lambda *_: None)
    serve._greet(
        SimpleNamespace(sim=sim, tables={}), ServeOptions(host=host, ros1=True), lambda *line: lines.append(line)
    )
    assert lines[0] == ("INFO", "bay: 2 boats, a, b")
    warning = f"listening on {host}: any machine on that network can drive the boats and end the run"
    assert (("WARN", warning) in lines) == is_warned
    assert any(FAR in text for _, text in lines) == is_warned


def test_the_addresses_of_interfaces_are_this_machines_and_no_loopback():
    found = network.interface_addresses()
    assert "127.0.0.1" not in found
    assert all(map(network.is_local, found))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((network.NOWHERE, 9))
        except OSError:
            return
        assert probe.getsockname()[0] in found


def test_connected_interfaces_come_first_and_those_of_containers_last(monkeypatch):
    interfaces = {  # as psutil has them: on Windows without flags
        "lo": (True, "up,loopback,running", socket.AF_INET, "127.0.0.1"),
        "docker0": (True, "up,running", socket.AF_INET, "172.17.0.1"),
        "eth0": (False, "up,broadcast", socket.AF_INET, "192.168.1.20"),
        "tun0": (False, "pointopoint", socket.AF_INET, "10.0.0.1"),
        "wlan0": (True, "up,running", socket.AF_INET, FAR),
        "wlan1": (True, "up,running", socket.AF_INET6, "fe80::1"),
        "Ethernet 2": (True, "", socket.AF_INET, "192.168.1.21"),
    }
    states = {name: SimpleNamespace(isup=isup, flags=flags) for name, (isup, flags, *_) in interfaces.items()}
    addresses = {name: [SimpleNamespace(family=family, address=one)] for name, (*_, family, one) in interfaces.items()}
    monkeypatch.setattr(psutil, "net_if_stats", lambda: states)
    monkeypatch.setattr(psutil, "net_if_addrs", lambda: addresses)
    assert network.interface_addresses() == [FAR, "192.168.1.21", "192.168.1.20", "172.17.0.1"]


@pytest.mark.usefixtures("without_route")
def test_without_a_default_route_the_address_of_an_interface_is_told(monkeypatch):
    monkeypatch.setattr(network, "interface_addresses", lambda: [FAR])
    assert network.announced_address("0.0.0.0", "localhost") == FAR
    assert told(host="0.0.0.0", rosbridge=9090) == [("INFO", f"roslibpy: roslibpy.Ros('{FAR}', 9090)")]


@pytest.mark.usefixtures("without_route")
def test_where_no_address_is_found_there_is_nothing_to_paste_but_what_to_set(monkeypatch):
    monkeypatch.setattr(network, "interface_addresses", list)
    message = "no address of this machine that others can reach was found: set ROS_IP or --host"
    assert told(host="0.0.0.0", ros1=True, rosbridge=9090) == [("WARN", message)]
    assert told(host="0.0.0.0", ros2=True) == []


def test_an_address_of_loopback_in_the_environment_is_not_to_be_pasted(monkeypatch):
    monkeypatch.setenv("ROS_HOSTNAME", "localhost")
    advice = "set ROS_HOSTNAME to this machine's address, or unset it"
    message = f"other machines cannot reach localhost, the address set by ROS_HOSTNAME: {advice}"
    assert told(host="0.0.0.0", ros1=True) == [("WARN", message)]
    monkeypatch.setenv("ROS_HOSTNAME", FAR)
    assert [level for level, _ in told(host="0.0.0.0", ros1=True)] == ["INFO", "INFO"]


def test_who_listens_on_loopback_means_programs_of_this_machine(monkeypatch):
    monkeypatch.setenv("ROS_IP", "127.0.0.2")
    assert [level for level, _ in told(host="127.0.0.2", ros1=True)] == ["INFO", "INFO"]
    assert [level for level, _ in told(host="192.168.1.20", ros1=True)] == ["WARN"]


def test_a_line_is_told_here_to_all_networks_and_in_the_recording():
    here, recorded, networks = [], [], [Fake(), Fake()]
    sim = SimpleNamespace(event=lambda text, level: recorded.append((level, text)))
    _announce(sim, networks, lambda level, text: here.append((level, text)), "WARN", "the master is gone")
    assert here == recorded == [("WARN", "the master is gone")]
    assert [network.lines for network in networks] == [here, here]
