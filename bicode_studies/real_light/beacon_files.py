"""Read the files of public LED beacons: MATLAB tables with the events of one light."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from bicode_lab.events import Events, make_events

WHERE_FROM = (
    "They are 504hz_30m.mat and 3125hz_30m.mat of github.com/ziweiWWANG/Event-Beacon-Communication (data/"
    "bright-led-outdoor, for academic use only). Put them into a folder event_beacon and give the folder around it."
)
"""Where to get the two recordings of notebook 18."""


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
        If the file is missing, is not a MATLAB file, or holds something else.
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
            "there must be as many of both, with polarities +1 and -1 and finite times"
        )
    zeros = np.zeros(t_s.size, np.uint16)
    return make_events(zeros, zeros, (polarity > 0).astype(np.int16), np.round(t_s * 1e6).astype(np.int64))
