"""Tests of the headers of RAW and DAT: letters of any code page, types of events, names of EVT2.1."""

import numpy as np
import pytest
from make_files import dat_bytes

from bicode_lab.events import make_events
from bicode_lab.recordings import open_recording

EVENTS = make_events([1, 2], [3, 4], [0, 1], [5, 4096])
WORDS = np.array([0x8000, 0x6005, 3, 0x2001, 0x8001, 4, 0x2802], "<u2").tobytes()


@pytest.mark.parametrize("name", [b"M\xfcller", "M\u00fcller".encode(), b"\x93Optik\x94 \x80", b"\xff\xfe"])
@pytest.mark.parametrize("line_end", [b"\n", b"\r\n"])
def test_letters_of_any_code_page(tmp_path, name, line_end):
    lines = (b"% evt 3.0", b"% camera_integrator_name " + name, b"% geometry 9x8", b"% end")
    (tmp_path / "a.raw").write_bytes(line_end.join(lines) + line_end + WORDS)
    recording = open_recording(tmp_path / "a.raw")
    assert recording.read().tolist() == EVENTS.tolist()
    assert (recording.width, recording.height) == (9, 8)


def test_events_that_begin_as_a_line_of_the_header_would(tmp_path):
    """Without a line "end", the first byte that is no '%' ends the header, or the first line that is no text."""
    words = np.array([0x0025, 0x8000, 0x6005, 3, 0x2001, 0x000A], "<u2").tobytes()
    (tmp_path / "a.raw").write_bytes(b"% evt 3.0\n% geometry 99x88\n" + words)
    assert open_recording(tmp_path / "a.raw").read().tolist() == [(1, 3, 0, 5)]


@pytest.mark.parametrize("kind", [b"\x00\x08", b"\x0c\x08"])
def test_both_types_of_dat_hold_the_same_events(tmp_path, kind):
    (tmp_path / "a.dat").write_bytes(dat_bytes(EVENTS, kind))
    assert open_recording(tmp_path / "a.dat").read().tolist() == EVENTS.tolist()
