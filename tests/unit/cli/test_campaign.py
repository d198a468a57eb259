import pytest


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "a campaign is of controllers or of programs: name CONTROLLER... or --exec, one of the two"),
        (("a:b", "--exec", "c"), "a campaign is of controllers or of programs: name CONTROLLER... or --exec, one of"),
        (("a:b", "--rate", "2"), "--rate is for programs, which --exec names: controllers are called by time itself"),
        (("a:b", "--rosbridge"), "--rosbridge is for programs, which --exec names: controllers are called by time"),
        (("--exec", "c", "--exec", "c"), "the program c is named twice"),
        (("--exec", " "), "--exec '' names no program"),
        (("--exec", "c", "--rate", "0"), "--rate 0: a number above 0, 1 for real time, or max"),
    ],
)
def test_wrong_words_are_told_before_anything_is_sailed(cli, words, message):
    said = cli("campaign", *words, "--worlds", "ocean", "-o", "never")
    assert (said.code, said.out) == (2, "")
    assert said.err.startswith(message), said.err
