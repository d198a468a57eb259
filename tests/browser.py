"""Chromium without a window, driven by the DevTools protocol."""

import base64
import contextlib
import itertools
import json
import subprocess
import time
import urllib.request

from websockets.sync.client import connect

from needs import CHROMIUM_PROGRAM

FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
    "--disable-extensions", "--disable-sync", "--disable-dev-shm-usage", "--remote-debugging-port=0",
)  # fmt: skip


class Page:
    """A tab; `said` is what it wrote to its console, threw, or was refused by its policy."""

    def __init__(self, socket):
        self._socket, self._numbers, self.said = socket, itertools.count(1), []
        self("Page.enable")
        self("Runtime.enable")
        self("Log.enable")

    def __call__(self, method, **parameters):
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            came = json.loads(self._socket.recv(timeout=60.0))
            if came.get("id") == number:
                assert "error" not in came, came
                return came["result"]
            is_refused = came["method"] == "Log.entryAdded" and came["params"]["entry"]["source"] == "security"
            if is_refused or came["method"] in {"Runtime.exceptionThrown", "Runtime.consoleAPICalled"}:
                self.said.append(came["params"])

    def look(self, expression):
        """The value of a JavaScript expression, awaited."""
        done = self("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in done, done
        return done["result"].get("value")

    def wait(self, condition, seconds=15.0):
        """Until a JavaScript expression is true; its value."""
        until = time.monotonic() + seconds
        while not (value := self.look(condition)):
            assert time.monotonic() < until, f"{condition}: not in {seconds} s; {self.look('document.body?.innerText')}"
            time.sleep(0.05)
        return value

    def size(self, width, height, *, dark=False, touch=False):
        self("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=touch)
        self(
            "Emulation.setEmulatedMedia",
            features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}],
        )

    def mouse(self, kind, x, y):
        self("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def key(self, key, text=None):
        self("Input.dispatchKeyEvent", type="keyDown", key=key, text=text or "")
        self("Input.dispatchKeyEvent", type="keyUp", key=key)

    def middle(self, selector):
        """Where an element is [px]."""
        return self.look(
            f"(({{x, y, width, height}}) => [x + width / 2, y + height / 2])"
            f"(document.querySelector('{selector}').getBoundingClientRect())"
        )

    def click(self, selector):
        x, y = self.middle(selector)
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)

    def screenshot(self, file):
        file.write_bytes(base64.b64decode(self("Page.captureScreenshot", format="png")["data"]))


@contextlib.contextmanager
def browsing(folder, url, *flags):
    """A page of a Chromium with a profile of its own, started with more flags."""
    command = [CHROMIUM_PROGRAM, *FLAGS, *flags, f"--user-data-dir={folder}", "about:blank"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        with connect(_tab(folder / "DevToolsActivePort"), max_size=None, proxy=None, ping_interval=None) as socket:
            page = Page(socket)
            page("Page.navigate", url=url)
            yield page
            with contextlib.suppress(Exception):
                page("Browser.close")
    finally:
        process.terminate()
        process.wait(60.0)


def _tab(file, seconds=30.0):
    """Address of the first tab, once Chromium has written its port."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        with contextlib.suppress(OSError, IndexError, StopIteration):
            port = file.read_text(encoding="utf-8").split()[0]
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=5.0) as answer:
                return next(tab["webSocketDebuggerUrl"] for tab in json.load(answer) if tab["type"] == "page")
        time.sleep(0.05)
    raise TimeoutError("Chromium did not start")
