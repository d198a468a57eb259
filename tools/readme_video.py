"""Make the README's moving picture, docs/sail.webp, and its still, docs/sail.png, from a recording.

`python tools/readme_video.py` sails three boats past a dock, records them, and draws the recording. A recording of that
run can be given, to draw it again: `python tools/readme_video.py run.rrd`.
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
SIZE, FPS = (800, 450), 15.0
BEGIN, END = 11.0, 19.0
STILL = 15.0
"""Simulated time of the still [s]."""
LARGEST = 3_000_000
"""Bytes of the moving picture, at most."""
SPEED_UP = 0.85
"""Thrust of all engines."""

DOCK = """
X   X   X   X   X
X   X   X   X   X
XXXXXXXXXXXXXXXXX
"""
SEA = {"model": "pms", "number": 3, "scale": 2.0, "gain": 0.5, "period": 4.5, "direction": [-1.0, 0.35], "tau": 1}
GATES = [
    {"name": f"{color}_{x}", "model": f"mb_marker_buoy_{color}", "pose": [x, y, 0.2, 0, 0, 0]}
    for x in (18, 32, 46)
    for color, y in (("green", 8.5), ("red", -7.5))
]
WORLD = {
    "extends": "ocean",
    "name": "bay",
    "description": "three boats pass a dock",
    "sea": SEA,
    "docks": [{"name": "quay", "pose": [46, 14, 0, 0, 0, math.pi / 2], "layout": DOCK}],
    "objects": [{"name": "light", "model": "robotx_light_buoy", "pose": [60, 10, 0.25, 0, 0, 0]}, *GATES],
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
    """A camera that goes with the fleet, at first before its starboard bow, at last abeam."""
    middle = np.mean([track.position for track in recorded.boats.values()], axis=0)
    trend = np.polyfit(recorded.time, middle[:, :2], 3)

    def eye(t: float) -> Eye:
        east, north = (float(np.polyval(trend[:, axis], t)) for axis in (0, 1))
        share = (t - BEGIN) / (END - BEGIN)
        angle = math.radians(-62.0 - 50.0 * share)
        place = (east + 17.0 * math.cos(angle), north + 17.0 * math.sin(angle), 4.8 - 0.8 * math.sin(math.pi * share))
        return looking(place, (east - 0.5, north + 2.0, 0.4), (0.0, 0.0, 1.0), field=1.05)

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
