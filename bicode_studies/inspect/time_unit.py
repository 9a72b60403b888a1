"""Judge whether the times of a recording are in microseconds, from the events alone."""

from __future__ import annotations

PERIOD_US = 33_000
LEAST_EVENTS = 500
FEW_PER_PERIOD = 100  # events in 33 ms, where all times are whole thousands
NEXT_TO_NONE = 5  # events in 33 ms; a marker that can be read makes some 20 in a packet alone
MANY_PER_TIME = 50  # events of one and the same time, on average


def remark_on_times(n_events: int, span_us: int, step_us: int) -> str | None:
    """Return a remark if the times of a recording are hardly in microseconds.

    Times in nanoseconds make a recording a thousand times too long and so nearly empty. Times in milliseconds or
    seconds put many events at the same time.

    Parameters
    ----------
    n_events : int
        Number of events.
    span_us : int
        Time from the first event to the last, as the file says [us].
    step_us : int
        Greatest common divisor of the times since the first event; 0 if all events have one time.

    Returns
    -------
    str or None
        None if nothing speaks against microseconds.

    Examples
    --------
    >>> print(remark_on_times(9_000, 100_000_000, 1000))
    9,000 events in 100.0 s are 3.0 in a period of 33 ms, and all times are whole thousands: are they ...
    >>> remark_on_times(1_000_000, 1_000_000, 1) is None
    True
    """
    if n_events < LEAST_EVENTS:
        return None
    per_period = n_events * PERIOD_US / max(span_us, 1)
    thousands = step_us > 0 and step_us % 1000 == 0
    if span_us > PERIOD_US and per_period < (FEW_PER_PERIOD if thousands else NEXT_TO_NONE):
        all_are = ", and all times are whole thousands" if thousands else ""
        return (
            f"{n_events:,} events in {span_us * 1e-6:,.1f} s are {per_period:.1f} in a period of 33 ms{all_are}: are "
            "they in nanoseconds? Times are to be in microseconds; divide them, or see whether the lens is covered"
        )
    n_times = span_us // max(step_us, 1) + 1
    if step_us <= 1 and n_events / n_times > MANY_PER_TIME:
        return (
            f"{n_events:,} events have at most {n_times:,} different times, {span_us:,} us from the first to the last: "
            "are they in milliseconds or seconds? Times are to be in microseconds; multiply them"
        )
    return None
