"""Cases with a user's own measurements: columns, commands over time, bands and bad input."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from peak_memory import peak_memory
from vrx_mj import Simulation, compile_world
from vrx_mj.config.measured import MOST_BYTES, SIGNALS, read_case, read_measurements
from vrx_mj.errors import VrxError
from vrx_mj.validation.report import _signal, measured_case, run_cases

WORLD = "physics: {profile: marine}\nsea: {model: none}\nspawn: {robot: skiff, sensors: none}\n"
CASE = """
source: measured by this test
world: ./bay.yaml
pose: [1, 2, 0, 0, 0, 0.5]
commands:
  - {time: 0, thrusters: {propeller: 0.5}}
  - {time: 2, thrusters: {propeller: 0.5, rudder_angle: 0.2}}
signals:
  surge: {band: 0.01}
  course: {of: heading_deg, band: 0.1}
"""
PLACE = (1.0, 2.0, 0.0, 0.0, 0.0, 0.5)


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bay.yaml").write_text(WORLD, encoding="utf-8")
    return tmp_path


def measured(files, rows, case=CASE, head="time,surge,course"):
    (files / "pull.yaml").write_text(case, encoding="utf-8")
    lines = [head, *(",".join(map(str, row)) for row in rows)]
    (files / "pull.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return measured_case(files / "pull.yaml", files / "pull.csv")


def compared(files, rows):
    (result,) = run_cases([measured(files, rows)])
    return result.rows


def sailed(files):
    """The same run by hand: time, surge, heading."""
    sim = Simulation(compile_world("./bay.yaml"))
    (boat,) = sim.boats
    sim.set_boat(boat, pose=PLACE)
    rows = [(0.0, 0.0, math.degrees(0.5))]
    for second in range(1, 13):
        command = {"propeller": 0.5} | ({"rudder_angle": 0.2} if second > 2 else {})
        sim.step({boat: command}, duration=1.0)
        seen = sim.observe()[boat]
        rows.append((float(second), float(seen.velocity[0]), math.degrees(seen.heading)))
    return rows


def test_a_signal_is_read_where_its_name_says():
    seen = SimpleNamespace(
        position=(1.0, 2.0, 3.0), roll=0.1, pitch=0.2, heading=0.3, velocity=(4.0, 5.0, 6.0),
        angular_velocity=(0.4, 0.5, 0.6), speed=7.0,
    )  # fmt: skip
    read = {name: _signal(seen, name) for name in SIGNALS}
    turned = {name: math.radians(value) for name, value in read.items() if SIGNALS[name].startswith("deg")}
    assert list(turned.values()) == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    assert [value for name, value in read.items() if name not in turned] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]


def test_a_boat_may_start_astern_and_turning_to_starboard(files):
    (files / "pull.yaml").write_text(f"velocity: [-0.5, 0, 0, 0, 0, -0.1]{CASE}", encoding="utf-8")
    assert read_case(files / "pull.yaml").velocity == (-0.5, 0.0, 0.0, 0.0, 0.0, -0.1)


def test_a_run_is_compared_sample_by_sample(files):
    rows = sailed(files)
    surge, course = compared(files, rows)
    assert (surge.inside, course.inside) == (True, True)
    assert (surge.ours, course.ours) == pytest.approx((0.0, 0.0), abs=1e-12)
    off = [(t, u + (0.02 if t == 7.0 else 0.0), psi - 360.0) for t, u, psi in rows]
    surge, course = compared(files, off)
    assert (surge.inside, surge.ours) == (False, pytest.approx(0.02))
    assert (course.inside, course.ours) == (True, pytest.approx(0.0, abs=1e-9))  # a full turn is none
    assert (surge.unit, course.unit) == ("m/s", "deg")


def test_samples_may_lack_a_value_and_begin_late(files):
    rows = [(t, u if t != 5.0 else "", psi) for t, u, psi in sailed(files)[3:]]
    case = measured(files, rows)
    (result,) = run_cases([case])
    (surge, course), (curves, _) = result.rows, result.charts
    assert (surge.inside, course.inside) == (True, True)
    assert "10 samples of pull.csv, up to 12 s" in case.setup
    assert np.isnan(curves.series[0].y[2])


@pytest.mark.parametrize(
    ("case", "message"),
    [
        (CASE.replace("band: 0.01", "band: 0"), "signals.surge.band: must be above 0, got 0"),
        (
            CASE.replace("of: heading_deg, ", ""),
            "signals.course.of: expected x, y, z, roll_deg, pitch_deg",
        ),
        (
            CASE.replace("time: 2", "time: 0"),
            "commands[1]: a time above 0 s, that of the previous row, is needed, got 0",
        ),
        (CASE.replace("source: measured by this test", ""), "source: required, but missing"),
        (CASE.replace("rudder_angle", "rudder"), "no command of boat 'wamv' named 'rudder'"),
        (CASE.replace("./bay.yaml", "./gulf.yaml"), "no file './gulf.yaml' in the current folder"),
        (CASE + "boat: cora\n", "no boat named 'cora'; known: wamv"),
    ],
)
def test_cases_that_cannot_be(files, case, message):
    with pytest.raises(VrxError) as error:
        measured(files, [(0, 0, 0), (1, 0, 0)], case)
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("rows", "head", "message"),
    [
        ([(0, 0, 0), (1, 0, 0)], "time,surge,heading",
         "pull.csv: no column 'course' in its first line; it has time, surge, heading"),
        ([(0, 0, 0)], "time,surge,course", "pull.csv: 2 to 200,000 rows are needed, got 1"),
        ([(0, 0, 0), (1, "fast", 0)], "time,surge,course", "pull.csv, line 3: surge needs a number, got 'fast'"),
        ([(0, 0, 0), (1, "inf", 0)], "time,surge,course", "pull.csv, line 3: surge needs a number, got 'inf'"),
        ([(1, 0, 0), (1, 0, 0)], "time,surge,course",
         "pull.csv, line 3: a time above 1 s, that of the previous row, is needed"),
        ([(0, 0, 0), (1e6, 0, 0)], "time,surge,course", "pull.csv: times from 0 to 36000 s are needed, got 0 to 1e+06"),
    ],
)  # fmt: skip
def test_measurements_that_cannot_be(files, rows, head, message):
    with pytest.raises(VrxError) as error:
        measured(files, rows, head=head)
    assert str(error.value) == message


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\n\r\n"])
def test_lines_end_as_on_any_system(tmp_path, end):
    (tmp_path / "pull.csv").write_bytes(end.join(["time,surge", "0,1", "1,2", ""]).encode())
    assert read_measurements(tmp_path / "pull.csv", ("surge",)) == ((0.0, 1.0), {"surge": (1.0, 2.0)})


def test_a_signal_may_have_the_name_of_the_time(tmp_path):
    (tmp_path / "pull.csv").write_text("time\n0\n1\n", encoding="utf-8")
    assert read_measurements(tmp_path / "pull.csv", ("time",)).signals == {"time": (0.0, 1.0)}


SIZE = 300_000
"""Bytes of large files here."""
LONG = "field larger than field limit (131072)"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"time,surge\n0,1\n1,\r2\n", ": a carriage return inside a line; use one kind of line ending"),
        (b"time,surge\n0,1\n1,\r\r\n", ": a carriage return inside a line; use one kind of line ending"),
        (b"time,surge\n0,1\n1," + b"9" * 140_000, f": {LONG}"),
        (b'time,surge\n"' + b"0\n" * 70_000, f": {LONG}"),
        (b"time,surge\n0,\xe9\n", ": not UTF-8"),
        (b"time,surge\n" + b"\n" * SIZE, ": 2 to 200 rows are needed, got 0"),
        (b"time,surge\n" + b"\r\n0," * (SIZE // 4), None),
        (
            b"time,surge\n" + b"".join(b"%d,1\n" % time for time in range(SIZE // 9)),
            ": 2 to 200 rows are needed, got more",
        ),
        (b"," * SIZE, None),
    ],
    ids=["carriage", "carriages", "long", "quote", "latin", "blank", "alike", "many", "wide"],
)
def test_files_that_are_no_measurements(tmp_path, monkeypatch, text, message):
    monkeypatch.setattr("vrx_mj.config.measured.MOST_ROWS", 200)
    (tmp_path / "pull.csv").write_bytes(text)

    def read():
        with pytest.raises(VrxError) as caught:
            read_measurements(tmp_path / "pull.csv", ("surge",))
        told = str(caught.value)
        assert len(told) < 1500 if message is None else told == f"{tmp_path / 'pull.csv'}{message}"

    assert peak_memory(read) < MOST_BYTES + 25 * SIZE  # with files of 20 MB it is less than 1 GB
