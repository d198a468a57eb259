"""Watch a running simulation, and drive its boats with keys: MuJoCo's window, a browser, a terminal."""
