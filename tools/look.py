"""Makes the pictures that people look at: recordings in rerun, a drawn sea, and what RViz and Lichtblick show.

`python tools/look.py FOLDER [NAME...]` (30 minutes for all; NAME picks recordings, `sea`, `rviz` or `lichtblick`) runs,
records and takes pictures. Those of recordings are dark and light, narrow and wide: dark ones of rerun without a window
(Debian's mesa-vulkan-drivers), light ones of Chromium. RViz and Lichtblick are left out with a line where they are not
installed. It ends with FOLDER/sheet.webp, all pictures small; `--gallery` writes docs/gallery/recordings.webp and the
pictures of docs/sensors.md, which `sensors` makes.
"""

import argparse
import contextlib
import itertools
import math
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import yaml
from PIL import Image
from readme_video import FLEET as STORM_FLEET
from readme_video import WORLD as STORM
from rerun.experimental import ViewerClient

import vrx_mj
from vrx_mj.recording.blueprint import PLAN_WATER
from vrx_mj.recording.parts import viewer_binary, viewer_environment
from vrx_mj.recording.video import Film, Shot, looking
from vrx_mj.recording.viewer import Server, free_port

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from look_viewers import lichtblick, rviz  # noqa: E402

import browser  # noqa: E402  # beside the tests

browser.FLAGS = tuple(flag for flag in browser.FLAGS if flag != "--disable-gpu")

MOMENTS: dict[str, tuple[float, ...]] = {
    "readme": (0.0, 30.0, 60.0), "storm": (8.0, 15.0), "open_water": (2.0, 60.0), "fleet_of_20": (5.0, 60.0),
    "wayfinding": (60.0, 299.0), "docking": (60.0, 200.0), "collision": (6.0, 14.0), "fleet_of_100": (20.0,),
}  # fmt: skip
"""Recordings, and the simulated times of their pictures [s]."""
SIZES = (1280, 800), (1920, 1080)
"""Width and height of a window [px]."""
HEIGHTS = (0.5, 2.0, 12.0, 60.0, 200.0)
"""Heights of the eye over the sea [m]."""
SEAS = {"half_a_metre": (0.5, 0.5, 3.5), "2_m": (2.0, 1.2, 5.0), "12_m": (12.0, 1.2, 5.0), "200_m": (200.0, 3.0, 8.0)}
"""Pictures of docs/sensors.md: heights of the eye and of the waves [m], and their peak period [s]."""
SCENES = {}, {"fog": {"type": "linear", "color": [0.8, 0.82, 0.84], "end": 120}}, {"sky": {"time": 19.6}}
"""Day, fog and dusk, in which cameras are shown."""
SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
LOADED = "document.querySelector('canvas')?.width > 300"
WATER, CHANGING = 0.03, 0.002
"""Share of a page's pixels that a plan's water has at least, and how much it may change in a page that has its data."""
THUMB = (400, 225)
"""Width and height of a picture on a sheet [px]."""

STRAIGHT = "left=0.6,right=0.4"
GRID = {"layout": "grid", "spacing": 8}
HEAD_ON = {
    "boats": [
        {"name": "port_bound", "pose": [-12, 0, 0.1, 0, 0, 0]},
        {"name": "starboard_bound", "pose": [12, 0.6, 0.1, 0, 0, math.pi]},
    ]
}


def arguments(name: str, folder: Path) -> list[str]:
    """Words of `vrx-mj run` for a recording, its files written to a folder."""

    def written(what: str, content: object) -> str:
        file = folder / f"{what}.yaml"
        file.write_text(yaml.safe_dump(content), encoding="utf-8")
        return str(file)

    if name in SEAS:
        _, waves, period = SEAS[name]
        sea = {"model": "jonswap", "significant_height": waves, "peak_period": period, "direction": [0.6, 0.8]}
        world = {"extends": "ocean_buoys", "physics": {"profile": "marine"}, "sea": {**sea, "spreading": 10}}
        return [written(f"waves_{name}", world), "--duration", "20"]
    shipped = "vrx_mj.control:"
    return {
        "readme": ["example_course", "--fleet", "trio", "--duration", "60", "--seed", "7", "--thrust", STRAIGHT],
        "storm": [written("storm", STORM), "--fleet", written("three", STORM_FLEET), "--duration", "20",
                  "--thrust", "left=0.8,right=0.85"],
        "open_water": ["ocean", "--duration", "60", "--thrust", "left=0.9,right=0.9"],
        "fleet_of_20": ["ocean", "--fleet", written("twenty", GRID | {"usv_count": 20}), "--duration", "60", "--thrust",
                        STRAIGHT],
        "fleet_of_100": ["ocean", "--fleet", written("hundred", GRID | {"usv_count": 100}), "--duration", "20",
                         "--thrust", STRAIGHT],
        "wayfinding": ["wayfinding_task", "--duration", "300", "--control", f"{shipped}WaypointFollower"],
        "docking": ["scan_dock_deliver", "--duration", "300", "--control", f"{shipped}Docking"],
        "collision": ["ocean", "--fleet", written("head_on", HEAD_ON), "--duration", "15",
                      "--thrust", "left=1,right=1"],
    }[name]  # fmt: skip


def record(name: str, folder: Path) -> Path:
    """The recording of this name, made if it is not there."""
    file = folder / f"{name}.rrd"
    if not file.exists():
        command = [sys.executable, "-m", "vrx_mj", "run", *arguments(name, folder), "--record", str(file)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return file


def dark(file: Path, size: tuple[int, int]) -> Iterator[Path]:
    """Pictures of rerun's own viewer."""
    port = free_port(0)
    window = f"{size[0]}x{size[1]}"
    command = [
        str(viewer_binary()), str(file), "--headless", "--bind", "127.0.0.1", "--port", str(port),
        "--window-size", window, "--hide-welcome-screen",
    ]  # fmt: skip
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, env=viewer_environment()) as process:
        try:
            viewer = connected(f"rerun+http://127.0.0.1:{port}/proxy")
            for moment in MOMENTS[file.stem]:
                picture = file.with_name(f"{file.stem}_{moment:g}_dark_{size[0]}.png")
                repeated(viewer.set_time, "sim_time", duration=moment, play_state="paused")
                time.sleep(1.0)
                repeated(viewer.save_screenshot, str(picture))
                yield picture
        finally:
            process.terminate()


def repeated(order: Callable[..., object], *what: object, tries: int = 10, **how: object) -> None:
    """Give a viewer an order until it has carried it out: on a busy machine it may take longer than it has for one."""
    for _ in range(tries - 1):
        with contextlib.suppress(TimeoutError):
            order(*what, **how)
            return
    order(*what, **how)


def connected(url: str, seconds: float = 60.0) -> ViewerClient:
    """A viewer that shows its views, paused at the first moment."""
    until = time.monotonic() + seconds
    while True:
        with contextlib.suppress(Exception):
            viewer = ViewerClient.connect(url)
            viewer.set_time("sim_time", duration=0.0, play_state="paused")
            if viewer.get_state().views:
                return viewer
        if time.monotonic() > until:
            raise TimeoutError(f"no viewer at {url}")
        time.sleep(0.2)


def light(file: Path) -> Iterator[Path]:
    """Pictures of rerun's page in a browser with a light theme, near the begin of the run, which it plays."""
    with (
        contextlib.closing(Server(file)) as server,
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
        browser.browsing(Path(folder), "about:blank", *SOFTWARE) as page,
    ):
        page.size(*SIZES[0], dark=False)
        page("Page.navigate", url=server.page_url)
        page.wait(LOADED, 60.0)
        for size in SIZES:
            page.size(*size, dark=False)
            yield settled(page, file.with_name(f"{file.stem}_light_{size[0]}.png"))


def settled(page: browser.Page, picture: Path, seconds: float = 300.0) -> Path:
    """A picture of a page that shows a plan, of which the water has stayed the same over three pictures."""
    until, shares = time.monotonic() + seconds, [0.0, 0.0, 0.0]
    while min(shares) < WATER or np.ptp(shares) > CHANGING:
        if time.monotonic() > until:
            raise TimeoutError(f"no views in {picture} after {seconds:g} s")
        page.screenshot(picture)
        water = np.asarray(Image.open(picture).convert("RGB")) == PLAN_WATER
        shares = [*shares[1:], float(water.all(axis=-1).mean())]
    return picture


def drawn_sea(folder: Path) -> Iterator[Path]:
    """What cameras at several heights see of the storm, drawn by our own renderer."""
    recorded = vrx_mj.read_record(record("storm", folder))
    moment = MOMENTS["storm"][-1]
    row = int(np.searchsorted(recorded.time, moment))
    middle = np.mean([track.position[row] for track in recorded.boats.values()], axis=0)
    shot = Shot(size=(640, 360), fps=10.0, begin=0.0, end=recorded.time[-1], captions=False)
    for height in HEIGHTS:
        away = 20.0 + 1.5 * height
        place = (float(middle[0]) - away, float(middle[1]) - 0.4 * away, height)
        eye = looking(place, (*map(float, middle[:2]), 0.3), (0.0, 0.0, 1.0))
        film = Film(recorded, shot, size=(640, 360), fps=10.0, eye=lambda _t, eye=eye: eye)
        picture = folder / f"sea_{height:g}m.png"
        Image.fromarray(film.picture(moment)).save(picture)
        film.close()
        yield picture


def sensors(folder: Path) -> Iterator[Path]:
    """A boat and buoys from heights over a sea, and what the cameras of VRX's suite see by day, in fog and at dusk."""
    for name, (height, *_) in SEAS.items():
        recorded = vrx_mj.read_record(record(name, folder))
        boat, away = recorded.boats["wamv"].position[-1], 8.0 + 1.5 * height
        eye = looking(
            (boat[0] - away, boat[1] - 0.4 * away, height),
            (boat[0] + 4.0 + 2.2 * height, boat[1], 0.5),
            (0.0, 0.0, 1.0),
        )
        film = Film(recorded, Shot(captions=False), size=(480, 360), fps=10.0, eye=lambda _t, eye=eye: eye)
        picture = folder / f"sea_from_{name}.webp"
        Image.fromarray(film.picture(recorded.time[-1])).save(picture, quality=80)
        film.close()
        yield picture
    rows, spawn = [], {"pose": [-532.0, 237.0, 0.1, 0.0, 0.0, math.pi]}
    for scene in SCENES:
        sim = vrx_mj.Simulation(vrx_mj.compile_world({"extends": "example_course", "spawn": spawn, "scene": scene}))
        sim.step(duration=5.0)
        readings = sim.sense("wamv")
        found = [readings[f"{where}_camera"].data.rgb for where in ("front_left", "front_right", "middle_right")]
        rows.append(np.hstack([Image.fromarray(rgb).resize((480, 270)) for rgb in found]))
    picture = folder / "cameras.jpg"
    Image.fromarray(np.vstack(rows)).save(picture, quality=88)
    yield picture


def sheet(pictures: list[Path], target: Path, columns: int = 4) -> None:
    """All pictures, small, on one."""
    rows = math.ceil(len(pictures) / columns)
    whole = Image.new("RGB", (columns * THUMB[0], rows * THUMB[1]), "white")
    for i, picture in enumerate(pictures):
        small = Image.open(picture).convert("RGB")
        small.thumbnail(THUMB)
        whole.paste(small, (i % columns * THUMB[0], i // columns * THUMB[1]))
    whole.save(target, quality=80)


OTHERS: dict[str, Callable[[Path], Iterator[Path]]] = {
    "sea": drawn_sea, "sensors": sensors, "rviz": rviz, "lichtblick": partial(lichtblick, flags=SOFTWARE)
}  # fmt: skip
"""Pictures of something else than a recording."""


def main() -> None:
    """Take the pictures that are named, or all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", choices=[*MOMENTS, *OTHERS, []])
    parser.add_argument("--gallery", action="store_true", help="write the sheet of the docs")
    parser.add_argument("--dark", action="store_true", help="no pictures of a browser")
    given = parser.parse_args()
    folder, names = given.folder, given.names or [*MOMENTS, *OTHERS]
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        if name in OTHERS:
            taken = OTHERS[name](folder)
        else:
            file = record(name, folder)
            views = [dark(file, size) for size in SIZES]
            taken = itertools.chain(*views, *([] if given.dark else [light(file)]))
        for picture in taken:
            print(picture)
    found = [picture for name in (*MOMENTS, *OTHERS) for picture in sorted(folder.glob(f"{name}*.png"))]
    sheet(found, folder / "sheet.webp")
    if given.gallery:
        chosen = [one for one in found if "_1920" not in one.name]
        sheet(chosen, ROOT / "docs" / "gallery" / "recordings.webp", columns=3)
        for picture in (*folder.glob("sea_from_*.webp"), *folder.glob("cameras.jpg")):
            shutil.copy(picture, ROOT / "docs")


if __name__ == "__main__":
    main()
