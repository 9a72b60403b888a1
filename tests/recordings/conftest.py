"""What the tests of recordings share."""

import sys
from pathlib import Path

import faery
import numpy as np
import pytest

from bicode_lab.recordings import write_recording

sys.path.insert(0, str(Path(__file__).parent))  # for `bad_files`

from bad_files import GOOD_FILES, SIZE_PX


@pytest.fixture
def good_files(tmp_path, some_events):
    """Return a folder with files of the same events in every format."""
    theirs = np.empty(some_events.size, faery.EVENTS_DTYPE)
    for name, ours in (("t", "t"), ("x", "x"), ("y", "y"), ("on", "p")):
        theirs[name] = some_events[ours]
    for name in GOOD_FILES[:-2]:
        version = {"a.raw": "evt2", "b.raw": "evt3"}.get(name)
        faery.events_stream_from_array(theirs, SIZE_PX).to_file(str(tmp_path / name), version=version)
    for name in GOOD_FILES[-2:]:
        write_recording(tmp_path / name, some_events, *SIZE_PX)
    return tmp_path
