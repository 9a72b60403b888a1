"""The least that a loop over events can cost on this machine: what is left to gain in the receiver's.

Each loop does one thing that the receiver's cannot do without: read the events, write them as
codes, change the word or byte that an event's pixel has in a table of the receiver's size. Nothing
is decided, and nothing else is read.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd
from numba import njit

from bicode_lab.event_codes import AHEAD, ONE, EventCoder, prefetch
from bicode_lab.events import Events, words
from bicode_lab.lab.cost import seconds_of


def least_ns(events: Events, width: int, height: int, repeats: int = 7) -> pd.Series[float]:
    """The events of a period and its sensor in; the least time of each step out, for an event [ns].

    By processor time, the best of `repeats`. The tables are the receiver's: a byte a pixel (its box), a word of
    2 bytes (its sum in a bin), a word of 8 (its marks); with and without asking for the memory ahead.
    """
    coder = EventCoder(width, height)
    codes = coder(events).codes
    seconds = {
        "read the events": seconds_of(partial(_read, words(events)), repeats),
        "read them, write codes": seconds_of(partial(coder, events), repeats),
    }
    for kind in (np.uint8, np.uint16, np.uint64):
        table = np.zeros(width * height, kind)
        for name, touch in (("", _touch), (", asked for ahead", _touch_ahead)):
            name = f"a code, and {table.nbytes / 1e6:.1f} MB at random{name}"
            seconds[name] = seconds_of(partial(touch, codes, table), repeats)
    return pd.Series(seconds, name="ns") / max(events.size, 1) * 1e9


@njit(cache=True)
def _read(events):  # type: ignore[no-untyped-def]
    """Words in, something that needs all of them out."""
    seen = np.int64(0)
    for i in range(events.shape[0]):
        seen ^= events[i, 0] ^ events[i, 1]
    return seen


@njit(cache=True)
def _touch(codes, table):  # type: ignore[no-untyped-def]
    """Change what each event's pixel has in the table."""
    for i in range(codes.size - AHEAD):
        table[np.uint64(codes[i]) >> ONE] ^= 1


@njit(cache=True)
def _touch_ahead(codes, table):  # type: ignore[no-untyped-def]
    """The same, each asked for AHEAD events before."""
    for i in range(codes.size - AHEAD):
        prefetch(table, np.uint64(codes[i + AHEAD]) >> ONE)
        table[np.uint64(codes[i]) >> ONE] ^= 1
