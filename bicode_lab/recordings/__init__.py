"""Read and write event files."""

from bicode_lab.recordings.formats import RecordingError
from bicode_lab.recordings.npz import write_npz
from bicode_lab.recordings.reader import Recording, open_recording
from bicode_lab.recordings.writer import WRITABLE, write_recording

__all__ = ["WRITABLE", "Recording", "RecordingError", "open_recording", "write_npz", "write_recording"]
