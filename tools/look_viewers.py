"""What RViz and Lichtblick show of a simulation that is served, where they are installed."""

import contextlib
import http.server
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import browser  # beside the tests
from vrx_mj.recording.viewer import free_port
from vrx_mj.ros.table.viewers import layout_text

WEB = "LICHTBLICK"
"""Environment variable: the folder of Lichtblick's web build, `yarn web:build:prod` in its repository."""
SERVED = ("example_course", "--fleet", "trio", "--seed", "7", "--truth")
TOPICS = {
    **{f"/wamv{number}/robot_description": "std_msgs/String" for number in (1, 2, 3)},
    "/wamv1/sensors/gps/gps/fix": "sensor_msgs/NavSatFix",
    "/wamv1/sensors/cameras/front_left_camera/image_raw/compressed": "sensor_msgs/CompressedImage",
}
"""What the layout shows, besides what it has in every world."""
SCREEN = 97
"""Number of the display that RViz is drawn on."""
RVIZ = {
    "Panels": [],
    "Visualization Manager": {
        "Class": "",
        "Displays": [
            {"Class": "rviz/Grid", "Enabled": True, "Reference Frame": "start", "Plane Cell Count": 40, "Name": "Grid"},
            *(
                {"Class": "rviz/RobotModel", "Enabled": True, "Visual Enabled": True, "Name": boat,
                 "Robot Description": f"{boat}/robot_description"}
                for boat in ("wamv1", "wamv2", "wamv3")
            ),
            {"Class": "rviz/MarkerArray", "Enabled": True, "Marker Topic": "/vrx_mj/markers", "Name": "Markers"},
        ],
        "Enabled": True,
        "Global Options": {"Background Color": "158; 190; 214", "Fixed Frame": "start", "Frame Rate": 10},
        "Tools": [{"Class": "rviz/MoveCamera"}],
        "Value": True,
        "Views": {"Current": {"Class": "rviz/Orbit", "Distance": 60, "Pitch": 0.35, "Yaw": 4.0, "Name": "Current View",
                              "Target Frame": "start"}},
    },
    "Window Geometry": {"Height": 800, "Width": 1280},
}  # fmt: skip


@contextlib.contextmanager
def ended(command: list[str], **how: object) -> Iterator[subprocess.Popen[bytes]]:
    """A program, until the end of the block."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL} | how
    process = subprocess.Popen(command, **quiet)  # type: ignore[call-overload]
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(20.0)
        except subprocess.TimeoutExpired:
            process.kill()


def listening(port: int, seconds: float = 300.0) -> None:
    """Wait until a port of this machine takes connections."""
    until = time.monotonic() + seconds
    while True:
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
        except OSError:
            if time.monotonic() > until:
                raise
            time.sleep(0.2)
        else:
            return


def rviz(folder: Path, seconds: float = 40.0) -> Iterator[Path]:
    """A picture of RViz 1 with boats, shore, docks and objects, some time after it was started [s]."""
    missing = [program for program in ("rviz", "Xvfb", "import") if shutil.which(program) is None]
    if missing:
        print(f"no picture of RViz: {missing[0]} is missing (apt-get install rviz xvfb imagemagick)")
        return
    config, picture = folder / "look.rviz", folder / "rviz.png"
    config.write_text(json.dumps(RVIZ), encoding="utf-8")
    port = free_port(0)
    environment = os.environ | {
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1", "DISPLAY": f":{SCREEN}",
        "LIBGL_ALWAYS_SOFTWARE": "1", "QT_X11_NO_MITSHM": "1",
    }  # fmt: skip
    serve = [sys.executable, "-m", "vrx_mj", "serve", *SERVED, "--ros1"]
    screen = ["Xvfb", f":{SCREEN}", "-screen", "0", "1280x800x24"]
    with ended(serve, env=environment), ended(screen):
        listening(port)
        with ended(["rviz", "-d", str(config)], env=environment):
            time.sleep(seconds)
            subprocess.run(["import", "-window", "root", str(picture)], check=True, env=environment)
    yield picture


IMPORT = """(async text => {
  const file = new File([text], 'vrx_mj.json', { type: 'application/json' });
  window.showOpenFilePicker = async () => [{ kind: 'file', name: 'vrx_mj.json', getFile: async () => file }];
  document.querySelector('[data-testid=layouts-left]').click();
  for (let tries = 0; tries < 300; tries++) {
    await new Promise(done => setTimeout(done, 200));
    const found = document.evaluate("//*[text()[contains(., 'Import from file')]]", document, null, 9).singleNodeValue;
    if (found) { found.click(); return true; }
  }
  return false;
})"""
"""Has Lichtblick import a layout, as by *Layouts*, *Import from file*."""


CHOOSE = """(() => {
  const found = document.evaluate("//*[text()='vrx_mj']", document, null, 9).singleNodeValue;
  found?.click();
  return found !== null;
})()"""
"""Chooses it, once it is in the list."""


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Files of a folder, without a line for each."""

    def log_message(self, *_: object) -> None:
        """Write nothing."""


def lichtblick(folder: Path, flags: tuple[str, ...], seconds: float = 60.0) -> Iterator[Path]:
    """A picture of Lichtblick with our layout: what `serve --foxglove` sends, after some time of the clock [s]."""
    web = os.environ.get(WEB)
    if browser.CHROMIUM_PROGRAM is None or not web:
        print(f"no picture of Lichtblick: Chromium is needed, and the variable {WEB} with the folder of its web build")
        return
    port, picture = free_port(0), folder / "lichtblick.png"
    serve = [sys.executable, "-m", "vrx_mj", "serve", *SERVED, "--foxglove", str(port)]
    pages = http.server.ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=web))
    threading.Thread(target=pages.serve_forever, daemon=True).start()
    with (
        ended(serve),
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile,
        browser.browsing(Path(profile), "about:blank", *flags) as page,
    ):
        listening(port)
        page.size(1280, 800)
        source = f"?ds=foxglove-websocket&ds.url=ws://127.0.0.1:{port}"
        page("Page.navigate", url=f"http://127.0.0.1:{pages.server_port}/{source}")
        page.wait("document.querySelector('[data-testid=layouts-left]') !== null", 120.0)
        if not page.look(f"{IMPORT}({json.dumps(layout_text(TOPICS))})"):
            raise RuntimeError("Lichtblick has another menu of layouts")
        page.wait(CHOOSE, 120.0)
        time.sleep(seconds)
        page.screenshot(picture)
    pages.shutdown()
    yield picture
