"""The command line, `vrx-mj`."""

from vrx_mj.cli.app import main

__all__ = ["main"]
