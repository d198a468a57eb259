"""Record a run to a rerun file, read it back, compare two. Nothing here loads rerun before it is used."""

from vrx_mj.recording.coco import CocoWriter, write_coco
from vrx_mj.recording.compare import Comparison, compare
from vrx_mj.recording.reader import Record, Track, read_record
from vrx_mj.recording.session import open_viewer, record, resume
from vrx_mj.recording.tables import read

__all__ = [
    "CocoWriter", "Comparison", "Record", "Track", "compare", "open_viewer", "read", "read_record", "record", "resume",
    "write_coco",
]  # fmt: skip
