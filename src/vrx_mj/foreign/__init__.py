"""The process in which strangers' files are read: without rights, within limits, answering with plain tables."""

from vrx_mj.foreign.asking import ReaderError, ask, ask_ahead, budget, spend

__all__ = ["ReaderError", "ask", "ask_ahead", "budget", "spend"]
