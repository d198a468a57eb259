"""Every command of `vrx-mj`: its group in the help, where its function is, and what it does in one line.

A command's module is imported only when that command is used or its own help is asked for.
"""

from typing import NamedTuple

__all__ = ["COMMANDS", "FIRST", "PANELS", "Entry", "overview"]

PANELS = {
    "Sail": "worlds and boats in motion",
    "Look": "what there is, and what has happened",
    "Check": "boats, and this machine",
    "ROS": "programs and bags of ROS 1, ROS 2 and rosbridge",
    "Learn": "controllers and policies in many worlds",
}
"""The groups of the help, and what each holds."""


class Entry(NamedTuple):
    """A command."""

    panel: str
    """Its group in the help: a key of `PANELS`."""
    home: str
    """`module:name` in this package: a function, or the typer application of a command with subcommands."""
    summary: str
    """The first sentence of its help."""


COMMANDS = {
    "demo": Entry("Sail", "commands:demo", "Sail three boats into a recording, and open it in the viewer."),
    "run": Entry("Sail", "commands:run", "Sail a world, and print where the boats end and how the task is scored."),
    "view": Entry("Sail", "commands:view", "Watch a world live, and drive its boats with the keyboard."),
    "new": Entry("Sail", "commands:new", "Copy a commented start file into the current folder."),
    "compile": Entry("Sail", "commands:compile_", "Compile a world to MJCF that plain MuJoCo opens."),
    "list": Entry("Look", "commands:list_", "List worlds, fleets, robots, objects, docks or tasks."),
    "map": Entry("Look", "commands:map_", "Draw a world as seen from above."),
    "replay": Entry("Look", "commands:replay", "Open a recording in rerun's viewer, or draw a video of it."),
    "score": Entry("Look", "commands:score", "Score a recording again, with the task's own rules."),
    "compare": Entry("Look", "commands:compare", "Compare the motion in two recordings, to the last bit."),
    "robot": Entry("Check", "robot:app", "Build and check boats from VRX's thruster and component files."),
    "doctor": Entry("Check", "commands:doctor", "Check what is installed and what works on this machine."),
    "bench": Entry("Check", "commands:bench", "Measure the speed of this machine against the budgets."),
    "serve": Entry("ROS", "serve:serve", "Serve a world to ROS, with VRX's topics and services."),
    "teleop": Entry("ROS", "ros:teleop", "Drive a boat of a served world."),
    "convert": Entry("ROS", "ros:convert", "Convert a recording to a bag."),
    "ros": Entry("ROS", "ros:app", "Write the message packages that ROS 1 programs need."),
    "campaign": Entry("Learn", "campaign:campaign", "Sail controllers in many worlds, and compare their scores."),
    "worlds": Entry("Learn", "worlds:app", "Generate series of worlds from an axes file, as VRX's generator does."),
}  # fmt: skip

FIRST = {
    "demo": "vrx-mj demo",
    "list": "vrx-mj list worlds",
    "run": "vrx-mj run example_course --fleet trio --record run.rrd",
    "replay": "vrx-mj replay run.rrd",
    "view": "vrx-mj view example_course --fleet trio",
    "new": "vrx-mj new world my_bay",
}
"""What a new user needs first, with an example of each."""


def overview() -> str:
    """What `vrx-mj` without arguments prints: six commands, and where the rest is."""
    width = max(map(len, FIRST.values()))
    rows = [f"  {example:<{width}}  {COMMANDS[name].summary}" for name, example in FIRST.items()]
    return "\n".join(
        [
            "vrx-mj simulates unmanned surface vessels on MuJoCo. Start with:",
            "",
            *rows,
            "",
            f"vrx-mj --help lists all {len(COMMANDS)} commands; vrx-mj COMMAND --help explains one.",
            "",
        ]
    )
