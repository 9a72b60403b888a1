"""Notice times in another unit than microseconds, before a reader waits for a table that stays empty."""

from __future__ import annotations

import numpy as np

from bicode_lab.events import Events

FEWEST_EVENTS = 1000
"""With fewer events nothing is said."""
_SLOWEST_PER_S = 500.0  # of a blinking marker; a still scene of a quiet sensor sends fewer, and then nothing blinks
_FASTEST_PER_S = 5e7  # more than the links of most event cameras carry for long


def remark_on_clock(events: Events) -> str:
    """Return one line where the first events of a recording cannot have times in microseconds, or hold no blinking.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        The first events, in the order of time.

    Returns
    -------
    str
        Empty where nothing is remarkable, and where there are fewer than a thousand events.

    Examples
    --------
    >>> from bicode_lab.events import make_events
    >>> slow = make_events(np.zeros(1000), np.zeros(1000), np.zeros(1000), 100_000 * np.arange(1000))
    >>> print(remark_on_clock(slow))
    1,000 events in 99.9 s: nothing blinks at such a rate; every time is a multiple of 1,000: are they ns, not us?
    """
    if events.size < FEWEST_EVENTS:
        return ""
    times = events["t"].astype(np.int64)
    span_us = int(times[-1]) - int(times[0])
    found = f"{events.size:,} events in {max(span_us, 1) / 1e6:.4g} s"
    if events.size / max(span_us / 1e6, 1e-6) < _SLOWEST_PER_S:
        if not (times % 1000).any():
            return f"{found}: nothing blinks at such a rate; every time is a multiple of 1,000: are they ns, not us?"
        return f"{found}: nothing blinks at such a rate; are the times in microseconds?"
    if events.size / max(span_us / 1e6, 1e-6) > _FASTEST_PER_S:
        return f"{found}: more than most cameras can send; are the times in microseconds, or in ms or s?"
    return ""
