"""Make the README's moving picture, docs/sail.webp, and its still, docs/sail.png, from a recording.

`python tools/readme_video.py` sails three boats in a storm of profile `marine`, records them, and draws the recording.
A recording of that run can be given, to draw it again: `python tools/readme_video.py run.rrd`.
"""

import math
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import vrx_mj
from vrx_mj.recording.video import Eye, Film, Shot, looking, write_video

DOCS = Path(__file__).resolve().parents[1] / "docs"
SIZE, FPS = (800, 450), 12.5
BEGIN, END = 11.0, 19.0
STILL = 15.0
"""Simulated time of the still [s]."""
LARGEST = 2_000_000
"""Bytes of the moving picture, at most."""
SPEED_UP = 0.85
"""Thrust of all engines."""

BUOYS = [{"name": f"buoy_{x}", "model": "mb_marker_buoy_green", "pose": [x, 10.5, 0.2, 0, 0, 0]} for x in (12, 24, 36)]
WORLD = {
    "name": "storm",
    "description": "three boats head into the waves of a storm, 1.2 m of significant height",
    "physics": {"profile": "marine"},
    "sea": {
        "model": "jonswap",
        "significant_height": 1.2,
        "peak_period": 4.5,
        "direction": [-1.0, 0.35],
        "spreading": 10,
    },
    "wind": {"direction": 160, "mean_velocity": 12, "var_gain": 2},
    "scene": {"sky": {"time": 16.5, "sunrise": 6, "sunset": 18}},
    "objects": BUOYS,
}
FLEET = {
    "boats": [
        {"name": "wamv1", "pose": [0, 0, 0.1, 0, 0, 0]},
        {"name": "wamv2", "pose": [-8, 4.5, 0.1, 0, 0, 0]},
        {"name": "wamv3", "pose": [-8, -4.5, 0.1, 0, 0, 0]},
    ]
}


def steer(obs, t):
    """Full ahead to the east, with the heading held and a gentle swing of the leader's."""
    commands = {}
    for boat, seen in obs.items():
        if boat == "task":
            continue
        w, x, y, z = seen.quaternion
        heading = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        wanted = 0.12 * math.sin(0.45 * t)
        turn = 0.9 * (wanted - heading) - 0.5 * float(seen.angular_velocity[2])
        commands[boat] = {"left": SPEED_UP - turn, "right": SPEED_UP + turn}
    return commands


def sail(path):
    """Record the run."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world(WORLD, fleet=FLEET))
    with vrx_mj.record(sim, path):
        vrx_mj.run(sim, END + 1.0, controller=steer)


def camera(recorded):
    """A camera that goes with the fleet close to the water, at first before its starboard bow, at last abeam."""
    middle = np.mean([track.position for track in recorded.boats.values()], axis=0)
    trend = np.polyfit(recorded.time, middle[:, :2], 3)

    def eye(t: float) -> Eye:
        east, north = (float(np.polyval(trend[:, axis], t)) for axis in (0, 1))
        share = (t - BEGIN) / (END - BEGIN)
        angle = math.radians(-35.0 - 45.0 * share)
        place = (east + 22.0 * math.cos(angle), north + 22.0 * math.sin(angle), 2.6)
        return looking(place, (east - 1.5, north + 1.0, 0.6), (0.0, 0.0, 1.0), field=0.78)

    return eye


def main() -> None:
    """Sail if there is no recording, and draw."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(folder) / "sail.rrd"
        if not path.exists():
            sail(path)
        recorded = vrx_mj.read_record(path)
    shot = Shot(size=SIZE, fps=FPS, begin=BEGIN, end=END, captions=False)
    count = write_video(recorded, DOCS / "sail.webp", shot, eye=camera(recorded))
    film = Film(recorded, shot, size=SIZE, fps=FPS, eye=camera(recorded))
    Image.fromarray(film.picture(STILL)).save(DOCS / "sail.png", optimize=True)
    film.close()
    size = (DOCS / "sail.webp").stat().st_size
    print(f"docs/sail.webp: {count} pictures, {size / 1e6:.2f} MB; docs/sail.png")
    if size > LARGEST:
        raise SystemExit(f"docs/sail.webp is larger than {LARGEST / 1e6:g} MB")


if __name__ == "__main__":
    main()
