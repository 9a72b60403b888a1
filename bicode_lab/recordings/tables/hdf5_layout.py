"""Find the events, their size, clock and triggers in an HDF5 file, and what is needed to unpack them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from bicode_lab.recordings.formats import RecordingError
from bicode_lab.recordings.tables.columns import Table, find_table, missing_names
from bicode_lab.recordings.tables.ecf import ECF_FILTER
from bicode_lab.recordings.tables.hdf5_heap import heap_texts

_KNOWN_FILTERS = {
    32000: "LZF", 32001: "Blosc", 32004: "LZ4", 32008: "bitshuffle", 32013: "ZFP", 32015: "Zstd", 32026: "Blosc2",
    307: "bzip2", 4: "szip", ECF_FILTER: "the vendor's ECF",
}  # fmt: skip
_FIRST_PLACES = ("events", "", "CD")  # of several groups with events, one of these is read
_DEEPEST = 8


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where the events of an HDF5 file are."""

    group: str
    table: Table
    size_px: tuple[int, int] | None = None
    triggers: str = ""
    """The data set with external triggers; empty where there is none."""
    others: tuple[str, ...] = ()
    """Other groups with events."""

    @property
    def data_sets(self) -> tuple[str, ...]:
        """Names of the data sets that are read, in the group."""
        return (self.table.whole,) if self.table.whole else (self.table.names or ())


def find_place(path: Path, file: Any) -> Place:
    """Find the events in an open HDF5 file.

    Parameters
    ----------
    path : Path
        The file, for messages.
    file : h5py.File

    Returns
    -------
    Place

    Raises
    ------
    RecordingError
        If no group holds x, y, p and t, or a size is not made of integers.
    """
    found = {}
    for name, arrays in _groups(file):
        if name.split("/")[-1].upper() != "EXT_TRIGGER" and (table := find_table(arrays)):
            found[name] = table
    if not found:
        inner = file["events"] if isinstance(file.get("events"), h5py.Group) else file
        raise missing_names(path, "columns", list(inner))
    group = min(found, key=lambda name: (name not in _FIRST_PLACES, _FIRST_PLACES.index(name) if name in _FIRST_PLACES
                                         else 0, name))  # fmt: skip
    return Place(
        group=group or "/",
        table=replace(found[group], offset_us=_offset_us(path, file, group)),
        size_px=_size(path, file, file[group or "/"]),
        triggers=_triggers(file),
        others=tuple(name or "/" for name in sorted(found) if name != group),
    )


def _groups(group: Any, name: str = "", depth: int = 0) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the path of each group and what data sets it has; links that lead nowhere or in circles are passed over."""
    members = {key: group.get(key) for key in group if isinstance(group.get(key, getlink=True), h5py.HardLink)}
    yield (
        name,
        {key: (member.dtype, member.shape) for key, member in members.items() if isinstance(member, h5py.Dataset)},
    )
    if depth < _DEEPEST:
        for key, member in members.items():
            if isinstance(member, h5py.Group):
                yield from _groups(member, f"{name}/{key}".lstrip("/"), depth + 1)


def _offset_us(path: Path, file: Any, group: str) -> int:
    """Return the time that `t` counts from: the data set or attribute t_offset beside the events or above them [us]."""
    parts = group.split("/") if group else []
    for depth in range(len(parts), -1, -1):
        here = file["/".join(parts[:depth]) or "/"]
        data_set = here.get("t_offset")
        stated = data_set if isinstance(data_set, h5py.Dataset) and data_set.dtype.kind != "O" else None
        for value in (stated, _value(here.attrs, "t_offset")):
            if value is None:
                continue
            offset = np.asarray(value)
            if offset.size != 1 or offset.dtype.kind not in "iu" or abs(int(offset.item())) > 1 << 59:
                raise RecordingError(f"{path}: t_offset is {str(offset)[:40]}; store one whole number of microseconds")
            return int(offset.item())
    return 0


def _size(path: Path, file: Any, group: Any) -> tuple[int, int] | None:
    """Return the sensor size that attributes of the group or of the file state; None where they do not."""
    for attributes in (group.attrs, file.attrs):
        width, height = (_value(attributes, side) for side in ("width", "height"))
        if width is not None and height is not None:
            if not all(isinstance(side, np.integer) for side in (width, height)):
                raise RecordingError(f"{path}: width and height are not whole numbers; store one integer each [px]")
            return int(width), int(height)
        if sides := re.fullmatch(r"(\d{1,6})\s*x\s*(\d{1,6})", _text(path, attributes, "geometry")):
            return int(sides[1]), int(sides[2])
        resolution = np.asarray(_value(attributes, "sensor_resolution"))
        if resolution.shape == (2,) and resolution.dtype.kind in "iu":  # written as height, width and as width, height
            return int(resolution.max()), int(resolution.min())
    return None


def _value(attributes: Any, name: str) -> Any:
    """Return the value of an attribute; None where it is missing, and its type where it has a variable length."""
    if name not in attributes:
        return None
    kind = attributes.get_id(name).dtype
    return attributes[name] if kind.kind != "O" else kind


def _text(path: Path, attributes: Any, name: str) -> str:
    """Return an attribute that is a text; empty where it is missing, or another kind of value."""
    if name not in attributes or (kind := h5py.check_string_dtype(attributes.get_id(name).dtype)) is None:
        return ""
    if kind.length is None:
        return next((text for text in heap_texts(path) if re.fullmatch(r"\d+\s*x\s*\d+", text)), "")
    value = attributes[name]
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _triggers(file: Any) -> str:
    """Return the data set of the vendor's layout with external triggers; empty where it is missing."""
    data_set = file.get("EXT_TRIGGER/events")
    if isinstance(data_set, h5py.Dataset) and {"p", "t", "id"} <= set(data_set.dtype.names or ()):
        return "EXT_TRIGGER/events"
    return ""


def is_ecf(data_set: Any) -> bool:
    """Return whether ECF is the only filter of a data set, and HDF5 has no plugin for it."""
    return _filters(data_set) == [ECF_FILTER] and not h5py.h5z.filter_avail(ECF_FILTER)


def _filters(data_set: Any) -> list[int]:
    """Return the numbers of the filters of a data set."""
    settings = data_set.id.get_create_plist()
    return [settings.get_filter(k)[0] for k in range(settings.get_nfilters())]


def check_stored(path: Path, data_set: Any) -> None:
    """Raise RecordingError where a data set announces more events than the file stores; HDF5 would read zeros.

    Parameters
    ----------
    path : Path
        The file, for messages.
    data_set : h5py.Dataset
    """
    if data_set.is_virtual or data_set.external or not data_set.shape:
        return
    if data_set.chunks:
        stored = data_set.id.get_num_chunks() * data_set.chunks[0]
    else:
        row_bytes = data_set.dtype.itemsize * int(np.prod(data_set.shape[1:], dtype=object))
        stored = data_set.id.get_storage_size() // max(row_bytes, 1)
    if stored < data_set.shape[0]:
        raise RecordingError(
            f"{path}: damaged or cut short ({data_set.name} announces {data_set.shape[0]:,} events, stores {stored:,} "
            "at most); write or copy it again"
        )


def check_filters(path: Path, data_set: Any) -> None:
    """Raise RecordingError where a data set is compressed in a way that cannot be undone here.

    Parameters
    ----------
    path : Path
        The file, for messages.
    data_set : h5py.Dataset
    """
    for number in _filters(data_set):
        if h5py.h5z.filter_avail(number) or is_ecf(data_set):
            continue
        with suppress(ImportError):
            import hdf5plugin  # noqa: F401 (its import makes the filters known to HDF5)
        if not h5py.h5z.filter_avail(number):
            name = _KNOWN_FILTERS.get(number, "a codec unknown here")
            raise RecordingError(
                f"{path}: compressed with {name} (HDF5 filter {number}), which is not installed; pip install "
                "hdf5plugin, or repack the file where it can be read: h5repack -f GZIP=1 FILE NEW"
            )
