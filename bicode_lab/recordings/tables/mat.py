"""Read MATLAB files with events: the arrays x, y, p and t, or a struct with such fields.

Files of version 7.3 are HDF5 files and are read as such.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from bicode_lab.events import Events
from bicode_lab.recordings.decode import Decoder
from bicode_lab.recordings.formats import Header, RecordingError, damaged
from bicode_lab.recordings.tables.columns import Array, check_kind, check_sizes, find_table, missing_names, read_table
from bicode_lab.recordings.tables.mat5 import Value, read_mat5


def read_mat_header(path: Path) -> Header:
    """Return the header of a MATLAB file, after checking that x, y, p and t are in it.

    Parameters
    ----------
    path : Path
        The file to read.

    Returns
    -------
    Header
        Its layout is a pair: the `Table`, and the arrays by name.

    Raises
    ------
    RecordingError
        If the file is damaged, or holds no events with x and y.
    """
    variables = _variables(path)
    plain = {name: value for name, value in variables.items() if not isinstance(value, dict)}
    structs = [_fields(value) for value in variables.values() if isinstance(value, dict)]
    for arrays in (plain, *structs):
        table = find_table({name: (array.dtype, _long_shape(array)) for name, array in arrays.items()})
        if table:
            break
    else:
        if {"event", "event_t"} <= set(variables):
            raise RecordingError(
                f"{path}: holds the events of one light (event, event_t) and says nothing of x and y, so no marker can "
                "be found in it; read it with --line-code uart"
            )
        raise missing_names(path, "arrays", list(variables))
    if not table.whole:
        for name in table.names or ():
            check_kind(path, "array", name, arrays[name].dtype, arrays[name].shape)
        check_sizes(path, "arrays", [arrays[name].size for name in table.names or ()])
    return Header(format="MAT", size_px=_size(plain), layout=(table, arrays))


def read_mat(path: Path, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of a MATLAB file in pieces.

    Parameters
    ----------
    path : Path
        The file; its arrays are in the layout of the header.
    decoder : Decoder
        It validates the events.

    Yields
    ------
    ndarray of EVENT_DTYPE, shape (n,), n >= 0
    """
    table, arrays = decoder.header.layout
    first = table.whole or table.names[0]
    whole = {name: array if table.whole else array.ravel() for name, array in arrays.items()}
    yield from read_table(decoder, table, len(whole[first]), lambda name, rows: whole[name][rows])


def _variables(path: Path) -> dict[str, Value]:
    """Return the variables of a MATLAB file by name."""
    try:
        return read_mat5(path)
    except (ValueError, LookupError, MemoryError, struct.error, zlib.error) as error:
        raise damaged(path, error) from None


def _fields(fields: dict[str, Value]) -> dict[str, Array]:
    """Return the fields of a struct that are arrays, and those of structs inside it."""
    found: dict[str, Array] = {}
    for name, value in fields.items():
        if isinstance(value, dict):
            found = {**_fields(value), **found}
        else:
            found[name] = value
    return found


def _long_shape(array: Array) -> tuple[int, ...]:
    """Return the shape of an array, where MATLAB writes a single row or column as one dimension."""
    return (array.size,) if 1 in array.shape else array.shape


def _size(variables: dict[str, Array]) -> tuple[int, int] | None:
    """Return the sensor size if the variables width and height state it."""
    sides = [variables.get(name) for name in ("width", "height")]
    if any(side is None or side.size != 1 or side.dtype.kind not in "iuf" for side in sides):
        return None
    width, height = (float(side.item()) for side in sides if side is not None)
    return (int(width), int(height)) if width == int(width) and height == int(height) else None
