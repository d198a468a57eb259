import json
import math
import os
import pathlib
import subprocess
import sys

import mujoco
import pytest

from vrx_mj import Simulation, read_record

KEYS = {"world", "fleet", "seed", "steps", "sim_time", "wall_time", "real_time_factor", "state_sha256", "platform"}
KEYS |= {"physics_version"}
CONTROLLERS = """
def left_half(obs, t):
    return {"wamv": {"left": 0.5}}

class Turner:
    def reset(self, seed):
        self.seed = seed

    def __call__(self, obs, t):
        assert self.seed == 5
        return {"wamv": {"left": 0.5}}

def broken(obs, t):
    raise RuntimeError("my own mistake")

def nonsense(obs, t):
    return 0.5
"""


CALM = "nothing random moves the boats: every --seed gives the same run, except for sensor noise\n"


def summary_of(cli, *words):
    said = cli("run", "ocean", "--duration", "0.5", "--seed", 5, *words, "--summary", "s.json")
    assert (said.code, said.err) == (0, CALM)
    with pathlib.Path("s.json").open(encoding="utf-8") as file:
        return json.load(file)


def test_the_summary_has_what_scripts_need(cli):
    summary = summary_of(cli, "--fleet", "trio")
    assert set(summary) >= KEYS
    assert (summary["world"], summary["fleet"], summary["seed"]) == ("ocean", "trio", 5)
    assert (summary["steps"], summary["sim_time"], summary["interrupted"]) == (50, 0.5, False)
    assert list(summary["boats"]) == ["wamv1", "wamv2", "wamv3"]
    for boat in summary["boats"].values():
        assert len(boat["position"]) == 3
        assert boat["heading_compass"] == pytest.approx((90.0 - math.degrees(boat["heading"])) % 360.0)
        assert 0.0 <= boat["course_compass"] <= 360.0
        assert boat["distance"] >= 0.0
    assert summary["wall_time"] * summary["real_time_factor"] == pytest.approx(summary["sim_time"])


def test_the_table_tells_the_same_with_units(cli):
    said = cli("run", "ocean", "--duration", "0.5", "--seed", 5, "--thrust", "left=0.5")
    state = summary_of(cli, "--thrust", "left=0.5")["state_sha256"]
    assert f"state_sha256 {state}\n" in said.out
    assert "ocean, fleet single, seed 5" in said.out
    for head in ("boat", "x [m]", "y [m]", "z [m]", "yaw from", "compass", "heading", "course", "distance"):
        assert head in said.out


def test_equal_runs_have_equal_states_and_others_do_not(cli):
    first, again = summary_of(cli), summary_of(cli)
    driven = summary_of(cli, "--thrust", "left=0.5")
    assert first["state_sha256"] == again["state_sha256"] != driven["state_sha256"]


def test_a_controller_from_the_current_folder_commands_the_boats(cli, folder):
    (folder / "my_boat.py").write_text(CONTROLLERS, encoding="utf-8")
    steady = summary_of(cli, "--thrust", "left=0.5")
    for name in ("left_half", "Turner"):
        assert summary_of(cli, "--control", f"my_boat:{name}")["state_sha256"] == steady["state_sha256"]
    said = cli("run", "ocean", "--duration", "1", "--control", "my_boat:nonsense")
    assert said.err.strip() == "the controller returned 0.5: a mapping by boat, or None, is needed"
    assert said.code == 2


def test_controllers_that_a_fleet_names_command_its_boats_unless_the_run_says_otherwise(cli, folder):
    (folder / "my_crew.py").write_text(CONTROLLERS.replace('"wamv"', '"wamv1"'), encoding="utf-8")
    boats = "usv_count: 1\nlayout: line\n"
    (folder / "plain.yaml").write_text(boats, encoding="utf-8")
    (folder / "own.yaml").write_text(boats + "controller: my_crew:Turner\n", encoding="utf-8")
    steady = summary_of(cli, "--fleet", "plain.yaml", "--thrust", "left=0.5")["state_sha256"]
    assert summary_of(cli, "--fleet", "own.yaml")["state_sha256"] == steady
    assert summary_of(cli, "--fleet", "own.yaml", "--thrust", "left=0.2")["state_sha256"] != steady
    said = cli("run", "ocean", "--fleet", "own.yaml", "--duration", "1", "--control", "my_crew:nonsense")
    assert said.err.strip() == "the controller returned 0.5: a mapping by boat, or None, is needed"


@pytest.mark.filterwarnings("default::vrx_mj.errors.VrxWarning")
def test_nudge_moves_boats_to_free_water(cli, folder):
    (folder / "heap.yaml").write_text("positions: [{x: 0, y: 0}, {x: 1, y: 0}]\n", encoding="utf-8")
    refused = cli("run", "ocean", "--fleet", "heap.yaml", "--duration", "0.1")
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert refused.err.startswith("heap.yaml:1:27: positions[1]: 'wamv2' is on 'wamv1', 1.23 m inside it, ")
    said = cli("run", "ocean", "--fleet", "heap.yaml", "--duration", "0.1", "--nudge")
    assert said.code == 0
    assert said.err.startswith("warning: 'wamv2' moved ")


def test_a_mistake_in_a_controller_keeps_its_traceback(cli, folder):
    (folder / "wrong_boat.py").write_text(CONTROLLERS, encoding="utf-8")
    with pytest.raises(RuntimeError, match="my own mistake"):
        cli("run", "ocean", "--duration", "1", "--control", "wrong_boat:broken")


def test_a_recording_is_named_and_reads_back(cli, folder):
    said = cli("run", "ocean", "--duration", "1", "--record", "run.rrd")
    assert (said.code, said.err) == (0, "")
    assert "recording: run.rrd; to open it: vrx-mj replay run.rrd\n" in said.out
    assert read_record(folder / "run.rrd").states[-1].time == pytest.approx(1.0)
    assert cli("compare", "run.rrd", "run.rrd").code == 0


def test_the_advice_after_a_recording_can_be_pasted(cli, folder):
    said = cli("run", "ocean", "--duration", "1", "--record", "my run.rrd")
    assert "recording: my run.rrd; to open it: vrx-mj replay 'my run.rrd'\n" in said.out


def test_recordings_of_different_runs_compare_with_exit_code_1(cli, folder):
    (folder / "gusty.yaml").write_text("extends: ocean\nwind: {mean_velocity: 3, var_gain: 3}\n", encoding="utf-8")
    for seed in (1, 2):
        said = cli("run", "gusty.yaml", "--duration", "1", "--seed", seed, "--record", f"{seed}.rrd")
        assert (said.code, said.err) == (0, "")
    said = cli("compare", "1.rrd", "2.rrd")
    assert said.code == 1
    assert "seed: 1 and 2\n" in said.out
    assert "\nthey diverge at 0.050 s (row 1) in wind_speed: " in said.out


@pytest.mark.parametrize("output", ["course", "course/scene.xml", "course/my.xml"])
def test_a_compiled_world_opens_in_plain_mujoco_and_sails(cli, folder, tmp_path, monkeypatch, output):
    said = cli("compile", "ocean_buoys", "--seed", 5, "-o", output)
    assert (said.code, said.err) == (0, "")
    monkeypatch.chdir(tmp_path)
    named, told = said.out.split(": opens in MuJoCo; to sail it: ")
    scene = folder / named
    assert mujoco.MjModel.from_xml_path(str(scene)).nbody > 1
    place = told.split("'")[1]
    assert told.endswith("water, wind and thrust exist only in vrx_mj (vrx-mj run, vrx-mj view)\n")
    assert Simulation.load(folder / place).boats == ("wamv",)


def test_the_map_is_drawn_where_it_was_asked(cli, folder):
    said = cli("map", "ocean_buoys", "-o", "my map.png")
    assert (said.code, said.out, said.err) == (0, "map: my map.png\n", "")
    assert (folder / "my map.png").read_bytes().startswith(b"\x89PNG")


def test_sensors_without_a_recording_are_refused(cli, folder):
    said = cli("run", "ocean", "--duration", "1", "--sensors", "all")
    assert said.err.strip() == "--sensors all needs --record FILE.rrd"
    assert said.code == 2


def test_sensors_are_recorded_at_the_rates_asked_for(cli, folder):
    words = ["run", "example_course", "--duration", "1", "--record", "run.rrd"]
    said = cli(*words, "--sensors", "wamv:imu_wamv@5,lidar_wamv@2,wamv:gps_wamv")
    assert said.code == 0
    record = read_record(folder / "run.rrd")
    counts = {sensor.name: len(record.readings("wamv", sensor.name)) for sensor in record.sensors}
    assert counts == {"imu_wamv": 6, "lidar_wamv": 3, "gps_wamv": 16}
    assert len(record.readings("wamv", "lidar_wamv")[-1].data.points) > 1000
    assert not [name for name in record.objects if name.startswith("wamv/")]
    said = cli(*words, "--sensors", "wamv:sonar")
    assert said.code == 2
    assert said.err.startswith("no sensor of wamv named 'sonar'; known: front_left_camera, ")


@pytest.mark.render
def test_a_cameras_pictures_are_recorded(cli, folder):
    said = cli("run", "example_course", "--duration", "0.4", "--record", "run.rrd", "--sensors", "front_left_camera@5")
    assert said.code == 0
    images = read_record(folder / "run.rrd").readings("wamv", "front_left_camera")
    assert [round(image.time, 3) for image in images] == [0.0, 0.2, 0.4]
    sky, water = images[1].data.rgb[20].mean(axis=0), images[1].data.rgb[-200].mean(axis=0)
    assert images[1].data.rgb.shape == (720, 1280, 3)
    assert sky.sum() > water.sum() + 100  # the right side up


@pytest.mark.slow
@pytest.mark.parametrize("command", [True, False])
def test_a_command_keeps_pandas_out_of_its_recording_and_a_users_process_does_not(command, tmp_path):
    (tmp_path / "pandas.py").write_text("open('loaded', 'w').close()\nraise ImportError\n", encoding="utf-8")
    script = "import vrx_mj\nwith vrx_mj.record(vrx_mj.Simulation(vrx_mj.compile_world('ocean')), 'run.rrd'): pass"
    words = ["-m", "vrx_mj", "run", "ocean", "--duration", "1", "--record", "run.rrd"] if command else ["-c", script]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    subprocess.run([sys.executable, *words], cwd=tmp_path, env=environment, check=True, capture_output=True)
    assert (tmp_path / "run.rrd").is_file()
    assert (tmp_path / "loaded").exists() is not command
