"""What messages show of names and values, at the ends of what they show."""

import pickle

import pytest

from vrx_mj.errors import (
    ChoiceError,
    ConfigError,
    Problem,
    UnknownNameError,
    VrxError,
    VrxWarning,
    first_lines,
    first_names,
    nearest,
    quote,
    shorten,
)


@pytest.mark.parametrize(("count", "shown"), [(2, "a, b"), (3, "a, b, c"), (4, "a, b, c and 1 more"), (0, "")])
def test_first_names(count, shown):
    names = "abcdefg"[:count]
    assert first_names(names, 3) == shown
    assert first_lines(names, 3) == [*names[:3], *(["and 1 more"] if count == 4 else [])]


def test_long_text_keeps_two_thirds_of_its_beginning_and_a_third_of_its_end():
    whole = "0123456789" * 10
    assert shorten(whole[:80]) == whole[:80]
    assert shorten(whole) == f"{whole[:53]}…{whole[-26:]}"
    assert len(shorten(whole[:81])) == len(shorten(whole, 80)) == 80
    assert shorten(whole, 10) == "012345…789"
    assert shorten("a\tb\x00\u200e") == r"a\tb\x00\u200e"


@pytest.mark.parametrize("kind", [VrxError, VrxWarning])
def test_lines_of_messages_are_cut(kind):
    line = "a" * 1500
    assert str(kind(line)) == line
    assert len(str(kind(line + "b"))) == 1500
    short, long = str(kind(f"one\n{line}bb\nthree")).split("\n")[0::2], f"one\n{line}bb\nthree"
    assert short == ["one", "three"]
    assert [len(part) for part in str(kind(long)).split("\n")] == [3, 1500, 5]
    assert kind(line + "b", 7).args[1] == 7


def test_values_are_quoted_in_one_short_line():
    assert quote([1.0, "a"]) == "[1.0, 'a']"
    assert quote("a" * 58) == repr("a" * 58)
    assert len(quote("a" * 59)) == 60
    assert quote("…" * 59).count("…") > 1
    assert quote([1,
                  2]) == "[1, 2]"  # fmt: skip

    class Thing:
        def __init__(self, text):
            self.text = text

        def __repr__(self):
            return self.text

    assert quote(Thing("<" + "x" * 59)) == "<" + "x" * 59
    assert quote(Thing("<" + "x" * 60)) == "Thing"
    assert quote(Thing("a\n   b")) == "a b"
    assert quote(Thing(None)) == "a value of type Thing"


def test_the_nearest_name_is_one_that_resembles_it():
    assert nearest("Lidar_wam", ["gps", "lidar_wamv"]) == "lidar_wamv"
    assert nearest("abcdefghij", ["abcdefgxyz"]) == "abcdefgxyz"  # 14 of 20 letters
    assert nearest("abcdefghij", ["abcdefwxyz"]) is None
    assert nearest("a" * 301, ["a" * 300]) is None
    assert nearest("a" * 300, ["a" * 301]) is None
    assert nearest("a" * 300, ["a" * 300]) == "a" * 300


def test_an_unknown_name_is_told_with_what_is_known():
    few, many = [f"n{i:02}" for i in range(12)], [f"n{i:02}" for i in range(15)]
    assert str(UnknownNameError("boat", "zzz", [])) == "no boat named 'zzz'; known: none"
    error = UnknownNameError("boat", "zzz", few)
    assert (str(error), error.left_out) == (f"no boat named 'zzz'; known: {', '.join(few)}", 0)
    error = UnknownNameError("boat", "zzz", many)
    assert (str(error), error.left_out) == (f"no boat named 'zzz'; known: {', '.join(few)} and 3 more", 3)
    close = UnknownNameError("boat", "n1x1", many)
    assert (str(close), close.left_out) == ("no boat named 'n1x1'; did you mean 'n11'?", 0)
    advised = UnknownNameError("boat", 7, many, "ask")
    assert (str(advised), advised.left_out) == ("no boat named '7'; ask", 0)
    for each in (error, close, advised):
        again = pickle.loads(pickle.dumps(each))
        assert (str(again), again.left_out, again.known) == (str(each), each.left_out, each.known)


def test_choices_are_lines_to_type():
    error = ChoiceError("here", "worlds", {"a.yaml": "one", "long name.yaml": "", "b": "two"})
    typed = ["vrx-mj run a.yaml          # one", "vrx-mj run long name.yaml", "vrx-mj run b               # two"]
    assert str(error) == "here has 3 worlds; type one of these:\n  " + "\n  ".join(typed)
    assert error.text("view").count("vrx-mj view ") == 3
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
    wide = ChoiceError("here", "worlds", {"x" * 90: "one", "b": "two"}).text("run").splitlines()
    assert wide[2] == f"  {'vrx-mj run b':<80}  # two"
    many = ChoiceError("here", "worlds", {f"w{i}": "" for i in range(41)}).text("run").splitlines()
    assert (len(many), many[-1]) == (42, "  and 1 more")


def test_problems_are_told_with_their_places():
    problem = Problem("a.yaml", 3, 7, "sea.gain", "wrong")
    assert str(problem) == "a.yaml:3:7: sea.gain: wrong"
    assert str(ConfigError.of("a.yaml", "wrong")) == "a.yaml: wrong"
    assert str(ConfigError.of("a.yaml", "wrong", key="k", line=2)) == "a.yaml:2: k: wrong"
    assert len(str(Problem("a" * 400, None, None, "k" * 400, "wrong"))) == 300 + 2 + 300 + 2 + 5
    whole, more = ConfigError([problem] * 40), ConfigError([problem] * 42)
    assert str(whole).splitlines() == [str(problem)] * 40
    assert str(more).splitlines() == [*[str(problem)] * 40, "and 2 more problems"]
    assert str(pickle.loads(pickle.dumps(more))) == str(more)
