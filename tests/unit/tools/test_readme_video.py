"""The README's moving picture shows what the line below it says, and is small."""

import re
import runpy
from pathlib import Path

from vrx_mj.config.world import load_world

REPO = Path(__file__).parents[3]


def test_the_picture_is_the_storm_that_the_readme_names():
    script = runpy.run_path(str(REPO / "tools" / "readme_video.py"))
    world = load_world(script["WORLD"])
    named = re.search(
        r"^\*A storm in profile `(\w+)`, with .* of ([\d.]+) m\.\*$", (REPO / "README.md").read_text("utf-8"), re.M
    )
    assert (world.physics.profile, world.sea.significant_height) == (named[1], float(named[2]))
    assert (REPO / "docs" / "sail.webp").stat().st_size <= script["LARGEST"]
