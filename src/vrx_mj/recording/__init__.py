"""Record a run to a rerun file, read it back, compare two. Nothing here loads rerun before it is used."""

from vrx_mj.recording.checks import Comparison, compare
from vrx_mj.recording.exports import CocoWriter, read, write_coco
from vrx_mj.recording.reader import Record, Track, read_record
from vrx_mj.recording.session import open_viewer, record, resume

__all__ = [
    "CocoWriter", "Comparison", "Record", "Track", "compare", "open_viewer", "read", "read_record", "record", "resume",
    "write_coco",
]  # fmt: skip
