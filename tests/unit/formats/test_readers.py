"""Readers of other people's files."""

from pkgutil import resolve_name

from vrx_mj.formats import READERS


def test_every_reader_is_a_function_that_is_there():
    names = {name for reader in READERS for name in (reader.read, reader.find) if name}
    assert all(callable(resolve_name(f"vrx_mj.formats.{name}")) for name in names)
    assert len(names) > 8
