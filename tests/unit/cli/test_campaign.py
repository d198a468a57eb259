"""`vrx-mj campaign`: what is wrong with its words is told before anything is sailed."""

import pytest

CREW = """
def steady(obs, t):
    return {"wamv": {"left": 0.5, "right": 0.4}}
"""


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("crew:steady", "crew:steady"), "the controller crew:steady is named twice"),
        (("nobody:f",), "no module named 'nobody' for the controller 'nobody:f'"),
        (("crew:steady", "--worlds", "none/*"), "--worlds 'none/*' matches none of "),
        (("crew:steady", "--timeout", "0"), "invalid --timeout '0': a number above 0 is needed"),
        (("crew:steady", "--against", "nowhere"), "no campaign in 'nowhere': it has no campaign.json"),
        ((), "a campaign needs either controllers (CONTROLLER...) or programs (--exec)"),
        (("a:b", "--exec", "c"), "a campaign needs either controllers (CONTROLLER...) or programs (--exec)"),
        (("a:b", "--rate", "2"), "--rate needs --exec: it applies to programs, not to controllers"),
        (("a:b", "--rosbridge"), "--rosbridge needs --exec: it applies to programs, not to controllers"),
        (("--exec", "c", "--exec", "c"), "the program c is named twice"),
        (("--exec", " "), "invalid --exec '': the name of a program is needed"),
        (("--exec", "c", "--ardupilot", "--rosbridge"), "--ardupilot serves no ROS: --rosbridge and --lockstep cannot"),
        (("--exec", "c", "--ardupilot", "--lockstep", "a"), "--ardupilot serves no ROS: --rosbridge and --lockstep"),
        (("--exec", "c", "--rate", "0"), "invalid --rate '0': a number above 0 is needed, 1 for real time, or max"),
    ],
)
def test_wrong_words_are_told_before_anything_is_sailed(cli, folder, words, message):
    (folder / "bay.yaml").write_text(
        "extends: ocean\ntask: {type: stationkeeping, goal_cart: [8, 0, 0]}\n", encoding="utf-8"
    )
    (folder / "crew.py").write_text(CREW, encoding="utf-8")
    said = cli("campaign", *words, "--worlds", "bay.yaml", "-o", "never")
    assert (said.code, said.out) == (2, "")
    assert said.err.startswith(message)
    assert not (folder / "never").exists()


def test_worlds_that_cannot_be_read_are_told_once(cli, folder):
    (folder / "crew.py").write_text(CREW, encoding="utf-8")
    (folder / "seas").mkdir()
    for name, text in (("a", "extends: ocean\n"), ("b", "extends: ocean\ngravity: 9\n"), ("c", "sea: {gain: high}\n")):
        (folder / "seas" / f"{name}.yaml").write_text(text, encoding="utf-8")
    said = cli("campaign", "crew:steady", "--worlds", "seas/*.yaml", "--seeds", "0..19", "-o", "never")
    assert (said.code, said.out) == (2, "")
    (problem,) = said.err.splitlines()
    assert problem.startswith("seas/b.yaml:2:1: gravity: ")
    said = cli("campaign", "crew:steady", "--worlds", "ocean", "--fleet", "seas/b.yaml", "-o", "never")
    assert (said.code, said.err.count("seas/b.yaml")) == (2, 1)
    assert not (folder / "never").exists()
