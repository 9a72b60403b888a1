"""Make small event files that break a rule, and read the error messages they cause."""

import numpy as np
import pytest

from bicode_lab.recordings import RecordingError, open_recording

SIZE_PX = (640, 480)
EVT3_HEAD = b"% evt 3.0\n% geometry 640x480\n% end\n"
EVT2_HEAD = b"% evt 2.0\n% geometry 640x480\n% end\n"
DAT_HEAD = b"% Data file containing CD events.\n% Version 2\n% Width 640\n% Height 480\n\x0c\x08"
ES_HEAD = b"Event Stream\x02\x00\x00\x01\x80\x02\xe0\x01"
GOOD_FILES = ["a.raw", "b.raw", "a.dat", "a.aedat4", "a.es", "a.csv", "a.h5", "a.npz"]
LENIENT_HINT = "or read the good events with lenient=True (--lenient)"


def complaint(path, content=None):
    """Return the error message of a file without the file's name, after checking that it is one line."""
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(RecordingError) as caught:
        open_recording(path).read()
    line = str(caught.value)
    assert line.startswith(f"{path}: ")
    assert "\n" not in line
    assert caught.value.__cause__ is None
    return line.removeprefix(f"{path}: ")


def read_or_complain(path, **size):
    """Return the recording and its events; if it cannot be read, None and the error message."""
    try:
        recording = open_recording(path, **size)
        return recording, recording.read()
    except RecordingError as error:
        return None, str(error)


def evt3(*words):
    """Return an EVT3 file of some words."""
    return EVT3_HEAD + np.array(words, "<u2").tobytes()


def evt2(*words):
    """Return an EVT2 file of some words."""
    return EVT2_HEAD + np.array(words, "<u4").tobytes()


def dat(*rows):
    """Return a DAT file of some events x, y, p, t."""
    words = [t | x << 32 | y << 46 | p << 60 for x, y, p, t in rows]
    return DAT_HEAD + np.array(words, "<u8").tobytes()
