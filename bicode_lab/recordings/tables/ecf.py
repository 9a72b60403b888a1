"""Decode the vendor's HDF5 codec ECF, filter 0x8ECF, without its library.

A chunk holds the number of its events and two flags (32 bits), the first time (64 bits), and then the times, rows,
columns and polarities of all events, one after the other:

    times      bytes: upper half a step 0 .. 14 [us], lower half how many events have that time (15: 16 bits follow);
               bytes whose upper half is 15 are the digits of a longer step, lowest first
    rows       16 bits: row << 5 | how many (31: 16 bits follow)
    columns    16 bits: column << 5 | one bit for each of the next five columns, the nearest uppermost
    polarities bytes: polarity << 7 | how many (127: 16 bits follow)

With the first flag set, columns and polarities are 12 bits an event instead, four events in three 16-bit words. With
the second flag set, rows, columns and polarities are 24 bits an event, four events in three 32-bit words.

Facts: the public codec, github.com/prophesee-ai/hdf5_ecf.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from bicode_lab.events import EVENT_DTYPE, Events
from bicode_lab.kernels import njit
from bicode_lab.recordings.validate import Int, Ints

ECF_FILTER = 0x8ECF
"""Number of the filter in HDF5."""

_MOST_EVENTS = 65535  # of one chunk


@njit(cache=True)
def _word(data: Ints, at: Int, size: int) -> Int:
    """Return `size` bytes as a number, the lowest byte first; zeros after the end of the data."""
    value: Int = np.int64(0)
    for k in range(size):
        if at + k < data.size:
            value |= data[at + k] << (8 * k)
    return value


@njit(cache=True)
def _fill_times(data: Ints, at: Int, t: Ints) -> Int:
    """Fill in the steps of the times; return the byte after them, or -1 where the data end too early."""
    i, now = 0, np.int64(0)
    while i < t.size:
        if at >= data.size:
            return np.int64(-1)
        step, count = data[at] >> 4, data[at] & 15
        at += 1
        if step == 15:
            digits, shift = count, 4
            while at < data.size and data[at] >> 4 == 15:
                digits |= (data[at] & 15) << min(shift, 60)
                shift += 4
                at += 1
            now += digits
            continue
        now += step
        if count == 15:
            count = _word(data, at, 2)
            at += 2
        for _ in range(min(count, t.size - i)):
            t[i] = now
            i += 1
    return at


@njit(cache=True)
def _fill_runs(data: Ints, at: Int, size: int, bits: int, values: Ints) -> Int:
    """Fill in values that come as words of `size` bytes, each with a count in its lower `bits`; return as above."""
    i, most = 0, (1 << bits) - 1
    while i < values.size:
        if at >= data.size:
            return np.int64(-1)
        word = _word(data, at, size)
        at += size
        count = word & most
        if count == most:
            count = _word(data, at, 2)
            at += 2
        for _ in range(min(count, values.size - i)):
            values[i] = word >> bits
            i += 1
    return at


@njit(cache=True)
def _fill_columns(data: Ints, at: Int, x: Ints) -> Int:
    """Fill in columns that come as words of one column and a bit for each of the next five; return as above."""
    i = 0
    while i < x.size:
        if at >= data.size:
            return np.int64(-1)
        word = _word(data, at, 2)
        at += 2
        x[i] = word >> 5
        i += 1
        for k in range(5):
            if (word >> (4 - k)) & 1 and i < x.size:
                x[i] = (word >> 5) + k + 1
                i += 1
    return at


@njit(cache=True)
def _fill_packed(data: Ints, at: Int, size: int, values: Ints) -> Int:
    """Fill in values of 3/4 of a word of `size` bytes each, four in three words; return as above."""
    part = 2 * size  # a quarter of the bits of a word
    for i in range(0, values.size, 4):
        if at + 3 * size > data.size:
            return np.int64(-1)
        a, b, c = _word(data, at, size), _word(data, at + size, size), _word(data, at + 2 * size, size)
        at += 3 * size
        second = (a & ((1 << part) - 1)) | (b >> 2 * part) << part
        third = (b & ((1 << 2 * part) - 1)) | (c >> 3 * part) << 2 * part
        four = (a >> part, second, third, c & ((1 << 3 * part) - 1))
        for k in range(min(4, values.size - i)):
            values[i + k] = four[k]
    return at


def decode_ecf(chunk: bytes) -> Events:
    """Decode one chunk.

    Parameters
    ----------
    chunk : bytes
        As it is in the file.

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (n,)

    Raises
    ------
    ValueError
        If the chunk is cut short or damaged.
    """
    if len(chunk) < 12:
        raise ValueError(f"ECF chunk of {len(chunk)} bytes; the head alone has 12")
    info, t0 = struct.unpack_from("<Iq", chunk)
    n, all_packed, packed = info >> 2, info & 2, info & 1
    if n > _MOST_EVENTS:
        raise ValueError(f"ECF chunk of {n} events; there are at most {_MOST_EVENTS}")
    data = np.frombuffer(chunk, np.uint8).astype(np.int64)
    t, x, y, p = (np.zeros(n, np.int64) for _ in range(4))
    at = _fill_times(data, 12, t)
    if all_packed:
        at = _fill_packed(data, at, 4, x) if at >= 0 else at
        y, x, p = (x >> 12) & 0x7FF, (x >> 1) & 0x7FF, x & 1
    else:
        at = _fill_runs(data, at, 2, 5, y) if at >= 0 else at
        if packed:
            at = _fill_packed(data, at, 2, x) if at >= 0 else at
            x, p = x >> 1, x & 1
        else:
            at = _fill_columns(data, at, x) if at >= 0 else at
            at = _fill_runs(data, at, 1, 7, p) if at >= 0 else at
    if at < 0:
        raise ValueError("ECF chunk that is cut short")
    events = np.empty(n, EVENT_DTYPE)
    events["x"], events["y"], events["p"], events["t"] = x, y, p, t0 + t
    return events


def read_ecf_rows(dataset: Any, rows: slice) -> npt.NDArray[Any]:
    """Return some events of a data set of h5py whose only filter is ECF.

    Parameters
    ----------
    dataset : h5py.Dataset
        One dimension, in chunks.
    rows : slice
        Which events, with a step of 1.

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (n,)

    Raises
    ------
    ValueError
        If a chunk is missing, cut short or damaged.
    """
    (length,) = dataset.chunks
    first, stop = rows.start, min(rows.stop, dataset.shape[0])
    parts = []
    for start in range(first // length * length, stop, length):
        _, chunk = dataset.id.read_direct_chunk((start,))
        events = decode_ecf(chunk)
        if events.size < min(length, dataset.shape[0] - start):
            raise ValueError(f"ECF chunk of {events.size} events where {length} are due")
        parts.append(events[max(first - start, 0) : stop - start])
    return np.concatenate(parts) if parts else np.empty(0, EVENT_DTYPE)
