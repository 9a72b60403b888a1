"""Read and write event files.

`open_recording` opens a file of any known format as a `Recording`, which yields chunks of events. `write_recording`
writes events in the format that the ending of the file's name tells; `WRITABLE` lists the endings. `write_npz` writes
this project's own format. A file that cannot be read or written raises `RecordingError`.
"""

from bicode_lab.recordings.formats import RecordingError
from bicode_lab.recordings.reader import Recording, open_recording
from bicode_lab.recordings.tables.npz import write_npz
from bicode_lab.recordings.writer import WRITABLE, write_recording

__all__ = ["WRITABLE", "Recording", "RecordingError", "open_recording", "write_npz", "write_recording"]
