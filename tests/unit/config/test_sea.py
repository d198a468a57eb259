"""Seas in files: what they need, what they are by default, and spectra in files."""

import math

import pytest

from vrx_mj.config.weather import SeaConfig, read_spectrum
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxError

TRIANGLE = "frequency,density\n# of a tank\n0.1, 0.0\n0.2, 2.0\n0.4, 0.0\n"


def sea(**keys):
    return load_world({"name": "bay", "sea": keys}).sea


def problem(**keys):
    with pytest.raises(ConfigError) as error:
        sea(**keys)
    return str(error.value)


def test_a_spectrum_has_sixty_waves_and_no_growth():
    own = sea(model="jonswap", significant_height=1.0)
    assert (own.components, own.ramp, own.gamma, own.spreading, own.depth) == (60, 0.0, 3.3, None, None)
    assert (own.hs, own.tp) == (1.0, pytest.approx(5.0, rel=1e-3))


def test_sea_states_are_heights():
    assert [sea(model="pm", sea_state=state).hs for state in range(7)] == [0.0, 0.05, 0.3, 0.875, 1.875, 3.25, 5.0]


def test_a_spectrum_of_a_file_has_its_height_and_peak(tmp_path):
    (tmp_path / "tank.csv").write_text(TRIANGLE, encoding="utf-8")
    (tmp_path / "bay.yaml").write_text("sea: {model: file, file: tank.csv}\n", encoding="utf-8")
    own = load_world(tmp_path / "bay.yaml").sea
    assert own.hs == pytest.approx(4.0 * math.sqrt(0.5 * 0.3 * 2.0))
    assert own.tp == 5.0
    assert own.spectrum.frequencies == (0.1, 0.2, 0.4)
    (tmp_path / "bay.yaml").write_text(
        "sea: {model: file, file: tank.csv, significant_height: 1, peak_period: 4}\n", encoding="utf-8"
    )
    assert (load_world(tmp_path / "bay.yaml").sea.hs, load_world(tmp_path / "bay.yaml").sea.tp) == (1.0, 4.0)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"model": "jonswap"}, "sea.significant_height: required unless sea_state is given"),
        ({"model": "pm"}, "sea.significant_height: required unless sea_state is given"),
        (
            {"model": "tma", "significant_height": 0.3},
            "sea.depth: required for `model: tma`, a sea in shallow water; for deep water use jonswap",
        ),
        (
            {"model": "pm", "significant_height": 1.0, "sea_state": 2},
            "sea.sea_state: give significant_height or sea_state, not both",
        ),
        (
            {"model": "jonswap", "significant_height": 3.0, "peak_period": 3.0},
            (
                "sea.significant_height: a sea of 3 s breaks at 0.937 m, got 3 m; reduce the height, or use a longer "
                "peak_period"
            ),
        ),
        (
            {"model": "pm", "sea_state": 6, "depth": 4.0},
            (
                "sea.model: a sea of 11.2 s breaks at 3.42 m in 4 m of water, got 5 m; reduce the height, or use "
                "a longer "
                "peak_period or greater depth"
            ),
        ),
        ({"model": "file"}, "sea.file: required for `model: file`"),
        ({"model": "regular"}, "sea.height: required for `model: regular`"),
        (
            {"model": "stokes5", "height": 3.0, "period": 3.0},
            "sea.height: a wave of 3 s breaks at 2 m, got 3 m; reduce the height, or use a longer period",
        ),
        ({"model": "jonswap", "sea_state": 7}, "sea.sea_state: must be below 7, got 7"),
        ({"model": "jonswap", "sea_state": 2, "components": 501}, "sea.components: must be at most 500, got 501"),
        ({"model": "jonswap", "sea_state": 2, "spreading": 0}, "sea.spreading: must be above 0, got 0"),
        ({"model": "jonswap", "sea_state": 2, "gamma": 0.5}, "sea.gamma: must be at least 1, got 0.5"),
    ],
)  # fmt: skip
def test_what_cannot_be_a_sea(keys, message):
    assert problem(**keys) == f"<world>: {message}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "at least 2 points, not all of density 0, are needed, got 0"),
        ("0.1 0\n0.2 0\n", "at least 2 points, not all of density 0, are needed, got 2"),
        ("0.1 1\n0.1 2\n", "line 2: a frequency above 0.1 Hz, that of the previous line, is needed, got '0.1 2'"),
        ("0.1 1\n0.2 -2\n", "line 2: a frequency above 0 and a density of 0 or more are needed, got '0.2 -2'"),
        ("0 1\n0.2 2\n", "line 1: a frequency above 0 and a density of 0 or more are needed, got '0 1'"),
        ("0.1 nan\n0.2 2\n", "line 1: a frequency above 0 and a density of 0 or more are needed, got '0.1 nan'"),
        ("0.1 1\n0.2 two\n", "line 2: a frequency [Hz] and a density [m2/Hz] are needed, got '0.2 two'"),
        ("0.1 1\n0.2\n", "line 2: a frequency [Hz] and a density [m2/Hz] are needed, got '0.2'"),
    ],
)
def test_what_is_no_spectrum(tmp_path, text, message):
    (tmp_path / "tank.csv").write_text(text, encoding="utf-8")
    with pytest.raises(VrxError) as error:
        read_spectrum("tank.csv", tmp_path)
    assert str(error.value) == f"spectrum 'tank.csv'{', ' if message.startswith('line') else ': '}{message}"


def test_a_spectrum_that_is_not_there(tmp_path):
    with pytest.raises(VrxError, match=r"^no file 'tank.csv' in "):
        read_spectrum("tank.csv", tmp_path)
    (tmp_path / "tank.csv").write_bytes(b"\xff\xfe0.1 1")
    with pytest.raises(VrxError, match=r"tank.csv:1:1: byte 0xFF is not UTF-8; save the file as UTF-8$"):
        read_spectrum("tank.csv", tmp_path)


def test_the_defaults_are_vrx_s():
    assert SeaConfig().model == "pms"


@pytest.mark.parametrize("path", ["../tank.csv", "link.csv"])
def test_a_spectrum_of_a_file_stays_in_its_folder(tmp_path, path):
    folder = tmp_path / "world"
    folder.mkdir()
    (tmp_path / "tank.csv").write_text("0.1 1\n0.2 2\n0.3 1\n", encoding="utf-8")
    (folder / "link.csv").symlink_to(tmp_path / "tank.csv")
    with pytest.raises(VrxError, match=f"^path '{path}' leaves the folder of the file that names it; add its folder"):
        read_spectrum(path, folder)
    assert read_spectrum(str(tmp_path / "tank.csv"), None).frequencies == (0.1, 0.2, 0.3)
