"""Files of public LED beacons: MATLAB tables of one light's events.   .mat -> events"""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from bicode_lab.events import Events, make_events


def read_beacon(path: Path) -> Events:
    """A .mat file with `event` (+1, -1) and `event_t` [s] in; its events out, x = y = 0, times from 0 on as there.

    Raises
    ------
    ValueError
        Where there is no such file, it is no MATLAB table, or holds something else.
    """
    if not path.is_file():
        raise ValueError(f"{path}: there is no such file")
    try:
        table = loadmat(path, variable_names=["event", "event_t"])
        polarity, t_s = (np.asarray(table[name]).ravel() for name in ("event", "event_t"))
    except (
        MatReadError,
        NotImplementedError,
        LookupError,
        TypeError,
        OSError,
        EOFError,
        ValueError,
        zlib.error,
    ) as error:
        raise ValueError(
            f"{path} holds no beacon: it must be a MATLAB file with `event` (+1, -1) and `event_t` [s] ({error})"
        ) from None
    if polarity.size != t_s.size or not np.isin(polarity, (-1, 1)).all() or not np.isfinite(t_s).all():
        raise ValueError(
            f"{path}: `event` has {polarity.size} and `event_t` {t_s.size} entries; "
            "it takes as many, polarities of +1 and -1, and finite times"
        )
    zeros = np.zeros(t_s.size, np.uint16)
    return make_events(zeros, zeros, (polarity > 0).astype(np.int16), np.round(t_s * 1e6).astype(np.int64))
