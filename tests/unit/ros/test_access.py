"""By which names this machine is called, and of which site a page is."""

import socket
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.ros.network import Names, Origins, checked_origins, host_of, is_address, is_loopback


@pytest.mark.parametrize(
    ("field", "host"),
    [
        ("simbox:11311", "simbox"),
        ("SimBox.Local.", "simbox.local"),
        ("127.0.0.1", "127.0.0.1"),
        ("[::1]:9090", "::1"),
        ("[fe80::1%25eth0]", "fe80::1%25eth0"),
        ("", ""),
        ("a:b", ""),
        ("a:99999", ""),
        ("a@b", ""),
        ("a/b", ""),
        ("a?b", ""),
        ("[", ""),
        ("http://a", ""),
    ],
)
def test_the_host_of_a_host_field(field, host):
    assert host_of(field) == host


@given(st.text(max_size=30))
def test_a_host_field_is_text_from_anybody(text):
    host = host_of(text)
    assert host == host.lower() or not host.isascii()
    is_address(host), is_loopback(host), Names().has(host, "127.0.0.1"), Origins().welcome(text, host)


@pytest.mark.parametrize(
    ("host", "reached", "known"),
    [
        ("localhost", "10.0.0.5", True),  # through a tunnel
        ("127.0.0.2", "127.0.0.1", True),
        ("::1", "127.0.0.1", True),
        ("10.0.0.5", "10.0.0.5", True),
        ("10.0.0.5", "::ffff:10.0.0.5", True),
        ("10.0.0.6", "10.0.0.5", False),
        ("0.0.0.0", "127.0.0.1", False),
        ("simbox", "10.0.0.5", True),
        ("evil.example", "10.0.0.5", False),
        ("localhost.evil.example", "127.0.0.1", False),
        ("127.0.0.1.evil.example", "127.0.0.1", False),
        ("", "127.0.0.1", False),
        (socket.gethostname().lower(), "10.0.0.5", True),
        (f"{socket.gethostname().lower()}.local", "10.0.0.5", True),
    ],
)
def test_this_machine_is_known_by_its_addresses_and_names(host, reached, known):
    assert Names(["SimBox", ""]).has(host, reached) is known


def test_the_name_that_the_name_server_has_for_this_machine_is_learnt(monkeypatch):
    monkeypatch.setattr(socket, "getfqdn", lambda: "Dock-3.Example")
    names = Names()
    until = time.monotonic() + 10.0
    while not names.has("dock-3.example", "10.0.0.5"):
        assert time.monotonic() < until
        time.sleep(0.01)


@pytest.mark.parametrize(
    ("origin", "host", "welcome"),
    [
        ("http://localhost:8000", "10.0.0.5", True),
        ("https://app.localhost", "127.0.0.1", True),
        ("http://[::1]:8000", "127.0.0.1", True),
        ("file://", "127.0.0.1", False),
        ("file://localhost", "127.0.0.1", False),
        ("http://10.0.0.5:8000", "10.0.0.5", True),
        ("HTTP://SimBox", "simbox", True),
        ("http://10.0.0.6:8000", "10.0.0.5", False),
        ("https://example.com", "127.0.0.1", False),
        ("https://example.com", "", False),
        ("null", "127.0.0.1", False),
        ("null", "null", False),
        ("", "", False),
        ("http://", "", False),
        ("http://[", "", False),
        ("http://localhost@example.com", "127.0.0.1", False),
        ("http://example.com#localhost", "127.0.0.1", False),
    ],
)
def test_pages_of_this_machine_are_welcome(origin, host, welcome):
    assert Origins().welcome(origin, host) is welcome
    assert Origins(["https://app.foxglove.dev"]).welcome(origin, host) is welcome
    assert Origins(["*"]).welcome(origin, host)


@pytest.mark.parametrize("word", ["null", "file://"])
def test_pages_without_an_origin_are_welcome_where_they_are_allowed(word):
    assert Origins(checked_origins([word])).welcome(word, "127.0.0.1")
