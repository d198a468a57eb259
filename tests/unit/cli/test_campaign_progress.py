"""What a campaign prints while it runs."""

import pytest

from campaigns import failed, scored
from vrx_mj.cli.campaign import CampaignProgress

RESULTS = [failed("a:f", "bay", seed, f"no buoy within {seed}.5 m") for seed in range(3)] + [
    scored("a:f", "bay", 3, 1.5)
]


class Printed:
    def __init__(self, watched):
        self.watched, self.lines = watched, []

    def print(self, line, color):
        self.lines.append(line)

    def update(self, done, text):
        self.state = done, text


@pytest.mark.parametrize("watched", [True, False])
def test_failures_of_one_kind_are_one_message(watched):
    progress = CampaignProgress(bar := Printed(watched), 4)
    for result in RESULTS:
        progress.note_result(result)
    first = "[1/4] a:f in bay, seed 0: failed: no buoy within 0.5 m"
    others = [f"[{seed + 1}/4] a:f in bay, seed {seed}: failed as before" for seed in (1, 2)]
    assert bar.lines == ([first] if watched else [first, *others, "[4/4] a:f in bay, seed 3: 1.5 m (320 s in 0.0 s)"])
    assert bar.state == (4, "0 running, 3 failed")
