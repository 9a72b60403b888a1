"""Read the arrays of MATLAB files of version 5 to 7: numbers and structs of numbers.

SciPy reads these files, too, but a damaged one can end the whole process in it. A file is a head of 128 bytes and then
elements: type and length (32 bits each), and the content, up to a multiple of 8 bytes. Up to 4 bytes of content share
the 8 bytes with type and length (16 bits each). A matrix is an element that holds others: flags, sizes, name, numbers;
a compressed element holds a matrix packed by zlib. Facts: MathWorks, "MAT-File Format".
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
Value = Array | dict[str, Any]
"""An array of numbers, or the fields of a struct."""

_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_MATRIX, _COMPRESSED = 14, 15
_STRUCT, _FIRST_NUMERIC, _LAST_NUMERIC = 2, 6, 15  # classes of a matrix
_DEEPEST = 8


def read_mat5(path: Path) -> dict[str, Value]:
    """Return the variables of a MATLAB file by name; those that are neither numbers nor one struct are left out.

    Parameters
    ----------
    path : Path
        The file to read.

    Returns
    -------
    dict of str to (ndarray or dict)

    Raises
    ------
    ValueError, struct.error, zlib.error
        If the file is cut short or damaged.
    """
    data = path.read_bytes()
    mark = data[126:128]
    if mark not in (b"IM", b"MI"):
        raise ValueError(f"no mark of the byte order at byte 126, but {mark!r}")
    order = "<" if mark == b"IM" else ">"
    variables: dict[str, Value] = {}
    for kind, content in _elements(data[128:], order):
        if kind == _COMPRESSED:
            (packed,) = list(_elements(zlib.decompress(content), order))[:1] or [(0, b"")]
            kind, content = packed
        if kind == _MATRIX:
            name, value = _matrix(content, order, 0)
            if name and value is not None:
                variables[name] = value
    return variables


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Yield the type and the content of each element."""
    at = 0
    while at < len(data):
        kind, length = struct.unpack_from(f"{order}II", data, at)
        start, end = at + 8, at + 8 + length
        if kind >> 16:  # a short element
            kind, length = kind & 0xFFFF, kind >> 16
            start, end = at + 4, at + 4 + length
        if end > len(data) or (start == at + 4 and length > 4):
            raise ValueError(f"an element of {length} bytes where {len(data) - start} are left")
        yield kind, data[start:end]
        at = at + 8 if start == at + 4 else end
        if kind != _COMPRESSED:
            at += -at % 8


def _matrix(content: bytes, order: str, depth: int) -> tuple[str, Value | None]:
    """Return the name and the value of a matrix; None for a value that is neither numbers nor one struct."""
    parts = list(_elements(content, order))
    if len(parts) < 3 or depth > _DEEPEST:
        return "", None
    (flags,) = struct.unpack_from(f"{order}I", parts[0][1])
    sizes = np.frombuffer(parts[1][1], f"{order}i4").tolist()
    name = parts[2][1].decode("latin-1")
    kind = flags & 0xFF
    if kind == _STRUCT and sizes == [1, 1]:
        return name, _struct(parts[3:], order, depth)
    if not _FIRST_NUMERIC <= kind <= _LAST_NUMERIC or flags & 0x800 or len(parts) < 4 or parts[3][0] not in _NUMBERS:
        return name, None
    stored, numbers = parts[3]
    array = np.frombuffer(numbers, f"{order}{_NUMBERS[stored]}")
    if min(sizes, default=0) < 0 or array.size != int(np.prod(sizes, dtype=object)):
        raise ValueError(f"{array.size} numbers in an array of {' x '.join(map(str, sizes))}")
    return name, array.reshape(sizes, order="F")


def _struct(parts: list[tuple[int, bytes]], order: str, depth: int) -> dict[str, Any]:
    """Return the fields of a struct of one element."""
    if len(parts) < 2:
        raise ValueError("a struct without names of fields")
    (length,) = struct.unpack_from(f"{order}I", parts[0][1])
    if length == 0:
        raise ValueError("a struct with names of no letters")
    text = parts[1][1]
    names = [text[at : at + length].split(b"\0")[0].decode("latin-1") for at in range(0, len(text), length)]
    values = (_matrix(content, order, depth + 1)[1] for _, content in parts[2:])
    return {name: value for name, value in zip(names, values, strict=False) if value is not None}
