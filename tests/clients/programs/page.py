"""A web server with a team's page, and a browser that shows it: TF by roslibjs, and the thrusts, which it commands.

The argument is roslibjs.
"""

import functools
import http.server
import os
import shutil
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from browser import browsing

HERE = Path(__file__).parent


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        """Nothing."""


with tempfile.TemporaryDirectory() as name:
    shutil.copy(HERE / "page.html", name)
    shutil.copy(sys.argv[1], name)
    server = http.server.ThreadingHTTPServer(("localhost", 0), functools.partial(Quiet, directory=name))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    url = f"http://localhost:{server.server_port}/page.html#{os.environ['ROSBRIDGE_PORT']}"
    with browsing(Path(name) / "browser", url) as page:
        page.wait("typeof seen === 'object' && seen.action > 1 && seen.service > 1 && seen.thrusts > 1", 60.0)
        print("ready", flush=True)
        try:
            while True:
                time.sleep(0.1)
        except KeyboardInterrupt:
            pass
        print(page.look("JSON.stringify(seen)"), flush=True)
        print("said", page.said, flush=True)
    server.shutdown()
