"""Read Parquet files with columns x, y, p and t, through pyarrow (an optional extra)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bicode_lab.events import Events
from bicode_lab.recordings.decode import Decoder
from bicode_lab.recordings.formats import Header, RecordingError, damaged
from bicode_lab.recordings.tables.columns import check_kind, find_table, in_us, missing_names, unit_of_times

_PIECE_EVENTS = 1 << 18


def read_parquet_header(path: Path) -> Header:
    """Return the header of a Parquet file, after checking that it holds four columns of numbers.

    Parameters
    ----------
    path : Path
        The file to read.

    Returns
    -------
    Header
        Its layout is a `Table`.

    Raises
    ------
    RecordingError
        If pyarrow is not installed, the file is damaged, or columns are missing.
    """
    file = _opened(path)
    try:
        kinds = {field.name: _dtype(field.type) for field in file.schema_arrow}
    except Exception as error:
        raise damaged(path, error) from None
    table = find_table({name: (dtype, (1,)) for name, dtype in kinds.items()})
    if table is None or table.names is None:
        raise missing_names(path, "columns", list(kinds))
    for name in table.names:
        check_kind(path, "column", name, kinds[name], (1,))
    return Header(format="Parquet", layout=table)


def read_parquet(path: Path, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of a Parquet file in pieces, in bounded memory.

    Parameters
    ----------
    path : Path
        The file to read.
    decoder : Decoder
        It validates the events.

    Yields
    ------
    ndarray of EVENT_DTYPE, shape (n,), n >= 0

    Raises
    ------
    RecordingError
        If the file is damaged.
    """
    table = decoder.header.layout
    unit = table.unit
    try:
        for batch in _opened(path).iter_batches(_PIECE_EVENTS, columns=list(table.names)):
            x, y, p, t = (_numbers(batch.column(batch.schema.get_field_index(name))) for name in table.names)
            unit = unit or unit_of_times(t)
            yield decoder.filter(in_us((x, y, p, t), unit))
    except RecordingError:
        raise
    except Exception as error:
        raise damaged(path, error) from None


def _opened(path: Path) -> Any:
    """Open a Parquet file."""
    try:
        from pyarrow import parquet
    except ImportError:
        raise RecordingError(f"{path}: a Parquet file, for which pyarrow is needed; pip install pyarrow") from None
    try:
        return parquet.ParquetFile(path)
    except Exception as error:  # a damaged file can make pyarrow raise almost anything
        raise damaged(path, error) from None


def _dtype(kind: Any) -> np.dtype[Any]:
    """Return the type of a column in numpy; times with a unit become whole microseconds."""
    import pyarrow

    if pyarrow.types.is_timestamp(kind) or pyarrow.types.is_duration(kind):
        return np.dtype(np.int64)
    dtype: np.dtype[Any] = np.dtype(kind.to_pandas_dtype())
    return dtype


def _numbers(column: Any) -> Any:
    """Return a column as numbers, with NaN where a value is missing; times with a unit become microseconds."""
    import pyarrow

    if pyarrow.types.is_timestamp(column.type):
        column = column.cast(pyarrow.timestamp("us"), safe=False).cast(pyarrow.int64())
    elif pyarrow.types.is_duration(column.type):
        column = column.cast(pyarrow.duration("us"), safe=False).cast(pyarrow.int64())
    return column.to_numpy(zero_copy_only=False)
