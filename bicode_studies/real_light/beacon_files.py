"""Read the files of public LED beacons: MATLAB tables with the events of one light."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from bicode_lab.events import Events, make_events
from bicode_lab.recordings.tables.mat5 import read_mat5

WHERE_FROM = (
    "They are 504hz_30m.mat and 3125hz_30m.mat of github.com/ziweiWWANG/Event-Beacon-Communication (data/"
    "bright-led-outdoor, for academic use only). Put them into a folder event_beacon and give the folder around it."
)
"""Where to get the two recordings of notebook 18."""

LONGEST_DAYS = 1
"""Times that span more are not in seconds: nobody records a light for so long."""


def read_beacon(path: Path) -> Events:
    """Read the events of one light from a MATLAB file.

    Parameters
    ----------
    path : Path
        A .mat file with the arrays ``event`` (polarity, +1 or -1) and ``event_t`` (time [s]).

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (n,)
        The events with the times of the file and x = y = 0.

    Raises
    ------
    ValueError
        If the file is missing, is not a MATLAB file, or holds something else or times in another unit.
    """
    if not path.is_file():
        raise ValueError(f"{path}: there is no such file")
    try:
        table = read_mat5(path)
        polarity, t_s = (np.asarray(table[name]).ravel() for name in ("event", "event_t"))
    except (LookupError, OSError, ValueError, struct.error, zlib.error) as error:
        raise ValueError(
            f"{path} holds no beacon: it must be a MATLAB file with `event` (+1, -1) and `event_t` [s] ({error})"
        ) from None
    numbers = {polarity.dtype.kind, t_s.dtype.kind} <= set("iuf")
    if not numbers or polarity.size != t_s.size or not np.isin(polarity, (-1, 1)).all() or not np.isfinite(t_s).all():
        raise ValueError(
            f"{path}: `event` has {polarity.size} and `event_t` {t_s.size} entries; "
            "there must be as many of both, with polarities +1 and -1 and finite times"
        )
    span_days = float(np.ptp(t_s)) / 86_400 if t_s.size else 0.0
    if span_days > LONGEST_DAYS:
        raise ValueError(f"{path}: event_t spans {span_days:,.0f} days; it is to be in seconds (divide us by 1e6)")
    zeros = np.zeros(t_s.size, np.uint16)
    return make_events(zeros, zeros, (polarity > 0).astype(np.int16), np.round(t_s * 1e6).astype(np.int64))
