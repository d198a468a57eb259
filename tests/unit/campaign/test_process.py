"""How a trial's process ended, in words."""

import signal

import pytest

from vrx_mj.campaign.process import _exit_text


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (None, "the process ended with exit code None: the controller, or a library that it uses, ended it"),
        (0, "the process ended with exit code 0: the controller, or a library that it uses, ended it"),
        (-signal.SIGSEGV, "the process was ended by SIGSEGV"),
        (-99, "the process was ended by signal 99"),
    ],
)
def test_a_process_without_a_result_says_how_it_ended(code, words):
    assert _exit_text(code) == words


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="Windows has no SIGKILL")
def test_a_process_that_is_killed_may_have_met_the_end_of_the_memory():
    assert _exit_text(-9) == "the process was ended by SIGKILL; this happens when memory runs out"
