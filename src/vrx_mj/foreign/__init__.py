"""The process in which strangers' files are read: without rights, within limits, answering with plain tables."""

from vrx_mj.foreign.asking import ask, ask_ahead, budget, spend
from vrx_mj.foreign.reader import ReaderError

__all__ = ["ReaderError", "ask", "ask_ahead", "budget", "spend"]
