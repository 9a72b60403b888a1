"""Say in words what a file is that holds no events, and what to do to get at the events."""

from __future__ import annotations

import re

_BEGINNINGS = (
    (rb"version https://git-lfs", "a pointer of git LFS, not the recording; fetch it with: git lfs pull"),
    (rb"[./\\\w]{0,40}annex[/\\]objects", "a pointer of git-annex, not the recording; fetch it with: git annex get"),
    (rb"\s*<(!doctype|html|head)", "a web page, not the recording; download the file itself"),
    (rb"\s*<\?xml", "an XML document"),
    (rb"\x89PNG", "a PNG image"),
    (rb"\xff\xd8\xff", "a JPEG image"),
    (rb"%PDF", "a PDF document"),
    (rb"\x1f\x8b", "a gzip archive; unpack it first (gunzip, or tar xzf)"),
    (rb"BZh\d", "a bzip2 archive; unpack it first (bunzip2)"),
    (rb"\xfd7zXZ", "an xz archive; unpack it first (unxz)"),
    (rb"\x28\xb5\x2f\xfd", "a zstd archive; unpack it first (unzstd)"),
    (rb"7z\xbc\xaf\x27\x1c", "a 7z archive; unpack it first"),
    (rb"Rar!", "a RAR archive; unpack it first"),
    (rb".{257}ustar", "a tar archive; unpack it first (tar xf)"),
    (rb".{4}ftyp", "a video (MP4), not events"),
    (rb"RIFF.{4}AVI", "a video (AVI), not events"),
    (rb"\x80[\x02-\x05]", "a Python pickle, which is not opened because it can run any program; save it as npz"),
    (rb"#!AER-DAT1", "an AEDAT file of version 1; convert it to version 2 with jAER"),
    (rb"#ROSBAG V1", "a ROS bag of version 1; convert it with: rosbag fix"),
    (rb"ARROW1", "an Arrow file; save it as Parquet"),
)


def name_of_other_file(start: bytes) -> str | None:
    """Return what a file is that begins with bytes of a known other kind, and the way out; None if it is not known.

    Parameters
    ----------
    start : bytes
        The first 512 bytes of the file.

    Examples
    --------
    >>> name_of_other_file(b"version https://git-lfs.github.com/spec/v1")
    'a pointer of git LFS, not the recording; fetch it with: git lfs pull'
    """
    for pattern, name in _BEGINNINGS:
        if re.match(pattern, start, re.DOTALL | re.IGNORECASE):
            return name
    return None
