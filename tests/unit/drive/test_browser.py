"""What a page is sent, and when, by a clock that is set by hand."""

from types import SimpleNamespace

import pytest

from vrx_mj.drive import browser


@pytest.fixture
def page(monkeypatch):
    """A browser whose page, recording and chunks are stand-ins, and what it does, one word after the other."""
    done = []

    def noted(word, result=None):
        return lambda *arguments, **_: (done.append((word, *arguments)), result)[1]

    def stream(_application):
        return SimpleNamespace(connect_grpc=noted("connect"), disconnect=noted("disconnect"))

    def chunks(scene, live=False):
        return lambda row: ([one.kind for one in scene.bodies], live, row)

    server = SimpleNamespace(data_url="url", close=noted("close"), is_running=lambda: True)
    bodies = tuple(SimpleNamespace(kind=kind) for kind in ("boat", "buoy", "boat"))
    monkeypatch.setattr(browser, "scene_of", lambda _: SimpleNamespace(bodies=bodies))
    monkeypatch.setattr(browser, "replace", lambda scene, **fields: SimpleNamespace(**vars(scene) | fields))
    monkeypatch.setattr(browser, "Server", lambda: server)
    monkeypatch.setattr(browser, "layout", lambda _, live: ("layout", live))
    monkeypatch.setattr(browser, "still_chunks", lambda _: "still")
    monkeypatch.setattr(browser, "event_chunk", lambda events: [(one.time, one.text) for one in events])
    monkeypatch.setattr(browser, "MovingChunks", chunks)
    for name in ("send_chunks", "send_blueprint"):
        monkeypatch.setattr(browser.rr, name, noted(name))
    monkeypatch.setattr(browser.rr, "RecordingStream", stream)
    clock = SimpleNamespace(now=50.0)
    session = SimpleNamespace(
        sim=SimpleNamespace(time=0.0, row=lambda: {None: "row"}), resets=0, pilot=SimpleNamespace(boat="a")
    )
    return browser.Browser(session.sim, lambda: clock.now), session, clock, done


BEGIN = [("connect", "url"), ("send_blueprint", ("layout", True)), ("send_chunks", "still")]
FLEET, OTHERS = ("send_chunks", (["boat", "boat"], True, "row")), ("send_chunks", (["buoy"], False, "row"))


def test_boats_are_sent_ten_times_a_second_and_all_else_twice(page):
    screen, session, clock, done = page
    assert done == BEGIN
    done.clear()
    screen.show(session)
    assert done == [FLEET, OTHERS, ("send_chunks", [(0.0, "the keys drive a")])]
    counts = []
    for number in range(1, 101):
        done.clear()
        clock.now, session.sim.time = 50.0 + 0.026 * number, 0.02 * number
        screen.show(session)
        counts.append((done.count(FLEET), done.count(OTHERS)))
    assert tuple(map(sum, zip(*counts, strict=True))) == (25, 5)  # in 2.6 s, by frames of 26 ms
    done.clear()
    clock.now += 9.0
    screen.show(session)  # time stands still: nothing is new
    assert done == []
    session.pilot.boat = "b"
    screen.show(session)
    assert done == [("send_chunks", [(2.0, "the keys drive b")])]


def test_a_run_that_begins_again_is_another_recording(page):
    screen, session, _, done = page
    screen.show(session)
    done.clear()
    session.resets = 1
    screen.show(session)  # at once, whatever was sent before
    assert done == [("disconnect",), *BEGIN, FLEET, OTHERS, ("send_chunks", [(0.0, "the keys drive a")])]
    done.clear()
    assert screen.is_open()
    assert list(screen.pressed_keys()) == []
    screen.close()
    screen.close()
    assert done == [("disconnect",), ("close",), ("close",)]
