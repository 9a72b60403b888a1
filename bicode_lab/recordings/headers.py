"""Read the header of an event file: its format, its sensor size and where the events begin.

The content tells the format, never the name: by a magic number, by the '%' lines at the beginning of a vendor's RAW or
DAT file, or by the first lines of a text. A name that contradicts the content is an error. Every error is one line
that says where and what is wrong, which rule is broken, and the way out.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO

from bicode_lab.recordings.aedat.aedat2 import read_aedat2_header
from bicode_lab.recordings.aedat.aedat3 import read_aedat3_header
from bicode_lab.recordings.aedat.aedat4_header import read_aedat4_header
from bicode_lab.recordings.bags.containers import read_bag_header
from bicode_lab.recordings.formats import EXTENSIONS, READABLE, Header, RecordingError, raise_unless_lenient
from bicode_lab.recordings.other_files import name_of_other_file
from bicode_lab.recordings.raw.header import read_vendor_header
from bicode_lab.recordings.tables.hdf5 import read_hdf5_header
from bicode_lab.recordings.tables.mat import read_mat_header
from bicode_lab.recordings.tables.npy import read_npy_header
from bicode_lab.recordings.tables.npz import read_npz_header
from bicode_lab.recordings.tables.parquet import read_parquet_header
from bicode_lab.recordings.text.header import GEOMETRY, read_text_header

_HDF5 = b"\x89HDF\r\n\x1a\n"
_WHOLE_FILES = (
    (_HDF5, read_hdf5_header),
    (b"\x93NUMPY", read_npy_header),
    (b"PK\x03\x04", read_npz_header),
    (b"PAR1", read_parquet_header),
    (b"#ROSBAG V2", read_bag_header),
    (b"\x89MCAP", read_bag_header),
    (b"SQLite format 3", read_bag_header),
)


def read_header(path: Path, lenient: bool = False) -> Header:
    """Read the header of an event file.

    Parameters
    ----------
    path : Path
        The file to read; a ROS 2 bag may be the folder with its metadata.yaml.
    lenient : bool
        Accept any name, and a file that ends anywhere after its format is known.

    Returns
    -------
    Header

    Raises
    ------
    RecordingError
        If the file is missing, a directory, unreadable, empty or not an event file; in strict reading also if it
        has no events after its header, ends inside an event, or has the name of another format.
    """
    if not path.exists():
        raise RecordingError(f"{path}: no such file; check the path")
    if path.is_dir() and (path / "metadata.yaml").is_file():
        return read_bag_header(path)
    if not path.is_file():
        what = "a directory" if path.is_dir() else "not a regular file"
        raise RecordingError(f"{path}: {what}; give one event file ({READABLE})")
    try:
        with path.open("rb") as file:
            header = _read_open_file(path, file, lenient)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read ({error.strerror}); check its permissions") from None
    suffix = path.suffix.lower()
    known = {extension for extensions in EXTENSIONS.values() for extension in extensions}
    if suffix in known and suffix not in EXTENSIONS[header.format]:
        right = EXTENSIONS[header.format][0]
        raise_unless_lenient(lenient, f"{path}: named {suffix} but holds {header.format}; rename it to end in {right}")
    return header


def _read_open_file(path: Path, file: BinaryIO, lenient: bool) -> Header:
    """Tell the format of an open file from its first bytes, and read its header."""
    start = file.read(1024)
    file.seek(0)
    if not start:
        raise RecordingError(f"{path}: empty (0 bytes); record or copy it again")
    if start.startswith(b"#!AER-DAT4.0\r\n"):
        return read_aedat4_header(path, file, lenient)
    if start.startswith(b"#!AER-DAT3"):
        return read_aedat3_header(path, file, lenient)
    if start.startswith(b"#!AER-DAT2"):
        return read_aedat2_header(path, file, lenient)
    if start.startswith(b"Event Stream"):
        return _read_es_header(path, start, lenient)
    if start.startswith(b"PK") and path.suffix.lower() == ".npz":
        return read_npz_header(path)
    for magic, read in _WHOLE_FILES:
        if start.startswith(magic):
            return read(path)
    if start.startswith(b"MATLAB"):
        return read_hdf5_header(path) if start[512:520] == _HDF5 else read_mat_header(path)
    if what := name_of_other_file(start[:512]):
        way = "" if ";" in what else f"; give {READABLE}"
        raise RecordingError(f"{path}: not an event file but {what}{way}")
    if start.startswith(b"%") and not GEOMETRY.match(start):
        return read_vendor_header(path, file, lenient)
    return read_text_header(path, file, lenient)


def _read_es_header(path: Path, start: bytes, lenient: bool) -> Header:
    """Read an Event Stream header: 12 bytes of magic number, 3 of version, 1 of type, 4 of size."""
    if len(start) < 20:
        raise RecordingError(f"{path}: cut short in the header, at byte {len(start)} of 20; copy it again")
    if start[12] != 2 or start[15] not in (1, 2):
        found = f"version {start[12]}, type {start[15]}"
        raise RecordingError(f"{path}: Event Stream {found}; give version 2, type 1 (DVS) or 2 (ATIS)")
    if path.stat().st_size == 20:
        raise_unless_lenient(lenient, f"{path}: ends after its header, at byte 20: no events; record or copy it again")
    width, height = struct.unpack_from("<HH", start, 16)
    return Header(format="ES", size_px=(width, height), offset=20, atis=start[15] == 2)
