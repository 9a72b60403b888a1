"""Keep a copy of standard input in a file, because the readers go back and forth in what they read."""

from __future__ import annotations

import atexit
import shutil
import sys
import tempfile
from pathlib import Path

from bicode_lab.recordings.formats import RecordingError


def copy_of_standard_input() -> Path:
    """Copy standard input to a file of its own, up to its end; the file is removed when the process ends.

    Returns
    -------
    Path

    Raises
    ------
    RecordingError
        If standard input is a terminal, or the copy cannot be written.
    """
    if sys.stdin is None or sys.stdin.isatty():
        raise RecordingError("-: standard input is a terminal; send a recording into it: cat FILE | bicode decode -")
    try:
        folder = Path(tempfile.mkdtemp(prefix="bicode-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        path = folder / "standard-input"
        with path.open("wb") as file:
            shutil.copyfileobj(sys.stdin.buffer, file)
    except OSError as error:
        raise RecordingError(
            f"-: standard input cannot be kept ({error.strerror}); check the temporary folder"
        ) from None
    return _with_ending(path)


def _with_ending(path: Path) -> Path:
    """Return the file under a name that ends as the bags of ROS 2 have to."""
    with path.open("rb") as file:
        start = file.read(16)
    for magic, ending in ((b"\x89MCAP", ".mcap"), (b"SQLite format 3", ".db3")):
        if start.startswith(magic):
            return path.rename(path.with_suffix(ending))
    return path
