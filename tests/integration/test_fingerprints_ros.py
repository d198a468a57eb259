"""What goes out on every topic of served worlds: the numbers that went out before."""

from collections import defaultdict

import pytest

import vrx_mj
from fingerprints import check
from integration.test_fingerprints_worlds import compiled
from ros_scene import run, served
from vrx_mj.ros.table import make_tables

EVERYDAY = "marina"
BY_NIGHT = {
    "my_course": None, "vrx2023/acoustic_tracking_task": None,
    "example_course": "trio", "gymkhana": None, "wildlife_task": None, "scan_dock_deliver": None, "marina": None,
    "perception_task": None, "wayfinding_task": None, "stationkeeping_task": None, "vrx2019/dock": None,
    "vrx2023/scan_dock_deliver_task": None, "vrx2023/follow_path_task": None, "vrx2023/wildlife_task": None,
}  # fmt: skip
OF_THIS_MACHINE, LONG = ("image", "compressed", "camera", "description"), ("markers", "points", "scan")
"""Parts of the names of topics that a renderer draws or that name folders, and of long ones."""
CLOCK = {"clock_rate": 100.0}


def check_topics(name, fleet, seconds, but_for=OF_THIS_MACHINE):
    """The first and the last message of each topic in both dialects, and how many there were."""
    sim = vrx_mj.Simulation(compiled(name, fleet=fleet), seed=3)
    found = defaultdict(list)
    for dialect in ("vrx", "vrx3"):
        table = served(sim, dialect=dialect).network.table
        wanted = {topic for topic in table.outputs if not any(part in topic for part in but_for)}
        scene = served(sim, wanted=wanted, dialect=dialect)
        sim.command_all({boat: dict.fromkeys(sim.command_names(boat), 0.4) for boat in sim.boats})
        run(scene, seconds)
        for topic in sorted(wanted & scene.network.got.keys()):
            sent = scene.network.got[topic]
            ends = [[one.time, one.message] for one in (sent[0], sent[-1])]
            found[f"{dialect} {topic.split('/')[1]}"] += [topic, len(sent), *ends]
        scene.server.close()
    check("ros", f"{name} for {seconds} s", **found)


def check_table(name, fleet, **options):
    """All entries of both tables, with what is served of them and how often."""
    tables = make_tables(served(vrx_mj.Simulation(compiled(name, fleet=fleet), seed=3), **options).server, **CLOCK)
    found = {}
    for dialect, table in tables.items():
        found |= {
            f"{dialect} outputs": [
                [o.name, o.type, o.rate, o.latched, o.recorded, o.sensor, o.blind is None, *o.dialects]
                for o in table.outputs.values()
            ],
            f"{dialect} inputs": [[i.name, i.type, i.boat, *i.dialects] for i in table.inputs.values()],
            f"{dialect} services": [[s.name, s.type, *s.dialects] for s in table.services.values()],
            f"{dialect} elsewhere": [text for pair in table.elsewhere.items() for text in pair],
        }
    check("ros", f"table of {name} with {fleet}, {' '.join(map(str, options.values()))}", **found)


@pytest.mark.parametrize(
    "options", [{}, {"truth": True, "cmd_vel": "velocity"}, {"localization": "navigator", "cmd_vel": "off"}], ids=str
)
def test_tables_have_the_topics_and_rates_that_they_had(options):
    check_table(EVERYDAY, "trio", **options)


def test_topics_carry_what_they_did():
    check_topics(EVERYDAY, None, 0.3, (*OF_THIS_MACHINE, *LONG))


@pytest.mark.slow
@pytest.mark.nightly
def test_so_do_those_of_other_worlds():
    for name, fleet in BY_NIGHT.items():
        check_topics(name, fleet, 3.0)
        check_table(name, fleet)
