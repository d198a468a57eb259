"""Waves of asv_wave_sim as the sea, against the formulas of its source."""

import math
import warnings
from pathlib import Path

import numpy as np
import pytest

from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.formats.gazebo.worlds import gazebo_world


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def world_of(body):
    """What the world of a text is in our keys, with its notes."""
    Path("bay.world").write_text(f'<sdf version="1.9"><world name="bay">{body}</world></sdf>', encoding="utf-8")
    return gazebo_world(Path("bay.world"))


def losses(world):
    """Notes of what is not as in Gazebo."""
    return [f"{note.what} {note.fate}: {note.ours}" for note in world.notes if note.fate != "imported"]


def loaded_sea():
    """The sea of the world."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        return load_world("bay.world").sea


WAVES = '<plugin filename="gz-waves1-waves-model-system" name="gz::sim::systems::WavesModel"><wave>{}</wave></plugin>'
ALGORITHMS = {
    "<algorithm>sinusoid</algorithm><amplitude>2.0</amplitude><period>6.0</period><direction>0 1</direction>":
        {"model": "regular", "height": 4.0, "period": 6.0, "direction": (0.0, 1.0)},
    "<algorithm>trochoid</algorithm><number>3</number><scale>1.5</scale><amplitude>0.2</amplitude><period>4</period>":
        {"model": "cwr", "number": 3, "scale": 1.5, "angle": math.pi / 5, "amplitude": 0.2, "period": 4.0, "tau": 0.0},
    "<wind_speed>9</wind_speed><wind_angle_deg>135</wind_angle_deg>":
        {"model": "pm", "direction": pytest.approx((-math.sqrt(0.5), math.sqrt(0.5)))},
    "<algorithm>fft</algorithm><wind_velocity>0 -9</wind_velocity>":
        {"model": "pm", "direction": pytest.approx((0.0, -1.0))},
}  # fmt: skip


@pytest.mark.parametrize("included", [False, True])
@pytest.mark.parametrize("wave", ALGORITHMS)
def test_waves_of_asv_wave_sim_are_the_sea(wave, included):
    plugin = WAVES.format(wave)
    if included:
        folder = Path("models/swell")
        folder.mkdir(parents=True)
        text = f'<sdf version="1.9"><model name="swell"><static>true</static>{plugin}</model></sdf>'
        (folder / "model.sdf").write_text(text, encoding="utf-8")
    model = f'<model name="waves"><static>true</static>{plugin}</model>'
    world = world_of("<include><uri>model://swell</uri></include>" if included else model)
    assert losses(world) == []
    assert "objects" not in world.section
    sea = loaded_sea()
    assert {key: getattr(sea, key) for key in ALGORITHMS[wave]} == ALGORITHMS[wave]


def test_a_sea_of_asv_wave_sim_has_the_height_of_its_spectrum_over_wave_numbers():
    world_of(f'<model name="waves">{WAVES.format("<wind_speed>9</wind_speed>")}</model>')
    k, g, u = np.geomspace(1e-4, 1e3, 200_000), 9.81, 1.026 * 9.0
    density = 0.0081 / 2.0 / k**3 * np.exp(-0.74 * g**2 / k**2 / u**4)
    sea = loaded_sea()
    assert sea.significant_height == pytest.approx(4.0 * math.sqrt(np.trapezoid(density, k)), rel=1e-5)
    assert 2.0 * math.pi / sea.tp == pytest.approx(g / u * (0.8 * 0.74) ** 0.25, rel=3e-3)


def test_waves_whose_folder_is_not_there_are_told():
    world = world_of("<include><uri>model://waves</uri></include>")
    told = "the water is flat without its folder, which defines the waves; is it on GAZEBO_MODEL_PATH?"
    assert losses(world) == [f"<include> 'model://waves' approximated: {told}"]


def test_an_unknown_kind_of_waves_is_an_error(strict):
    with pytest.raises(ConfigError, match="no algorithm named 'ftt'; known: fft, sinusoid, trochoid"):
        world_of(f'<model name="waves">{WAVES.format("<algorithm>ftt</algorithm>")}</model>')
