"""DAT and Event Stream, judged and decoded   their words -> events

faery reads these formats and says little of what is wrong with a file: a time running
backwards is held at its last value, the end of a cut event is dropped, and at a bad
coordinate it gives up without a place. So their bytes are read here as well: reading
strictly only to judge them, in step with faery; reading leniently for the events.
"""

from __future__ import annotations

from numba import njit

from bicode_lab.events import Events
from bicode_lab.recordings.validate import BLANK, EVENTS, HEIGHT, HIGH, LOW, ZEROS, Ints, judge, note


@njit(cache=True)
def decode_dat(words: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events) -> int:
    """DAT: 64-bit words of 32 bits of time, 14 of x, 14 of y and 4 of polarity; the time wraps at 32 bits."""
    for i in range(words.size):
        word = words[i]
        if word == 0 and i + 1 == words.size and not final:
            return i
        low = word & 0xFFFFFFFF
        if word == 0 and (state[ZEROS] or (i + 1 < words.size and words[i + 1] == 0)):
            note(tally, BLANK, state[EVENTS], place + 8 * i, 0)
            state[EVENTS] += 1
        else:
            if state[LOW] - low > 1 << 31:
                state[HIGH] += 1
            state[LOW] = low
            t = ((state[HIGH] + 1) << 32) + low
            judge(state, tally, out, (word >> 32) & 0x3FFF, (word >> 46) & 0x3FFF, (word >> 60) & 0xF, t, place + 8 * i)
        state[ZEROS] = word == 0
    return words.size


@njit(cache=True)
def _five_zeros(data: Ints, i: int) -> bool:
    """Is there an event of nothing but zeros?"""
    return i + 5 <= data.size and not data[i : i + 5].any()


@njit(cache=True)
def _decode_es(data: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events, atis: bool) -> int:
    """Event Stream: 5 bytes an event, times as steps; bytes that only lengthen the step stand alone."""
    i = 0
    while i < data.size:
        first = data[i]
        if (first >= 0xFC) if atis else (first >= 0xFE):
            state[LOW] += (first & 3) * 63 if atis else (127 if first == 0xFE else 0)
            i += 1
            continue
        if i + 5 > data.size or (not final and i + 10 > data.size):
            break
        state[LOW] += first >> 2 if atis else first >> 1
        zeros = _five_zeros(data, i)
        if zeros and (state[ZEROS] or _five_zeros(data, i + 5)):
            note(tally, BLANK, state[EVENTS], place + i, 0)
            state[EVENTS] += 1
        elif not (atis and first & 1):  # exposures are not contrast events
            x = data[i + 1] | data[i + 2] << 8
            y = state[HEIGHT] - 1 - (data[i + 3] | data[i + 4] << 8)  # rows are counted from below
            judge(state, tally, out, x, y, (first >> 1) & 1 if atis else first & 1, state[LOW], place + i)
        state[ZEROS] = zeros
        i += 5
    return i


@njit(cache=True)
def decode_es(data: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events) -> int:
    """Event Stream of contrast events: bytes in; good events in `out`, and how many bytes were used out."""
    return _decode_es(data, place, final, state, tally, out, False)


@njit(cache=True)
def decode_atis(data: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events) -> int:
    """The same for the type ATIS, which has exposures in between."""
    return _decode_es(data, place, final, state, tally, out, True)
