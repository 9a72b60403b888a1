"""Decide which time words of an EVT2 or EVT3 stream are to be trusted.

EVT3 sends the time in two kinds of words: TIME_HIGH holds the upper 12 of 24 bits and TIME_LOW the lower 12. EVT2
has only TIME_HIGH words, with the upper 28 of 34 bits. A new TIME_HIGH sets the lower bits to zero. It wraps (EVT3:
every 16.78 s), so a step of more than half a turn is taken as a step in the other direction. A TIME_LOW that steps
back is not a wrap. Real sensors send such steps: a Gen4.1 sensor now and then sends a TIME_LOW that is up to 11 us
too high and corrects it in the next word. No event comes between the two, so the events never step back in time.

A TIME_HIGH that contradicts the time words after it is damaged. Without a check, one flipped bit would set the clock
ahead by up to one turn, and every event after it would seem to step back. In lenient reading a damaged TIME_HIGH is
therefore replaced where its neighbours determine the right value. Otherwise it is ignored, as is a damaged TIME_LOW,
and the events under it are dropped.
"""

from __future__ import annotations

from bicode_lab.kernels import njit
from bicode_lab.recordings.validate import DOUBTFUL, EVENTS, HIGH, LENIENT, LOW, TRUSTED, Int, Ints, count_offence

# Answers to the question whether a time word can be trusted.
REJECTED, ACCEPTED, UNUSED, UNDECIDED = range(4)  # UNUSED: no event depends on it; UNDECIDED: later words are needed
HIGH_TRUSTED, BOTH_TRUSTED = 1, 3  # state[TRUSTED]: bit 0 is set for TIME_HIGH, bit 1 for TIME_LOW

_MAX_VOTES = 5  # later time words that are asked about one
_NEAR_STEPS = 16  # a later TIME_HIGH at most this far ahead supports the one in question
_SMALL_STEP_US = 16  # a TIME_LOW that goes no further needs a single supporting word


@njit(cache=True)
def clock_step(value: Int, high: Int, turn: Int) -> Int:
    """Return the signed step from one TIME_HIGH to another, the shorter way round the clock.

    Parameters
    ----------
    value, high : int
        The later and the earlier value.
    turn : int
        Number of values of the clock: 2^12 (EVT3) or 2^28 (EVT2).

    Returns
    -------
    int
        Step, ``-turn / 2 .. turn / 2 - 1``.
    """
    step = (value - high) % turn
    return step - turn if step >= turn // 2 else step


@njit(cache=True)
def _check_time_high(words: Ints, i: int, high: Int, turn: Int, final: bool) -> tuple[int, Int]:
    """Return whether the TIME_HIGH at `i` can be trusted, and the value to use for it."""
    first = high < 0
    value = words[i] % turn
    high = value if first else high
    step = clock_step(value, high, turn)
    votes, against = 0, 0
    nearest: Int = -1
    for j in range(i + 1, words.size):
        if words[j] // turn != 8:
            continue
        later = clock_step(words[j] % turn, high, turn)
        if votes == 0 and 0 <= step <= 1 and later >= step:
            return ACCEPTED, value
        if nearest < 0 and 0 <= later <= 2:
            nearest = later
        votes += 1
        if (later < step) if first else (0 <= later < step or step < 0 <= later):
            against += 1
        elif step <= later <= step + _NEAR_STEPS:  # two damaged words seldom agree
            against -= 1
        if votes == _MAX_VOTES:
            break
    if votes < _MAX_VOTES and not final:
        return UNDECIDED, value
    if against <= 0 and (votes or step >= 0):
        return ACCEPTED, value
    if first or nearest < 0:
        return REJECTED, value
    return ACCEPTED, (high + nearest // 2) % turn  # the clock stood still, or this word lay between two others


@njit(cache=True)
def check_time_low(words: Ints, i: int, high: Int, low: Int, final: bool) -> int:
    """Return whether an EVT3 TIME_LOW can be trusted; it holds for the events up to the next time word.

    Parameters
    ----------
    words : ndarray of int64, shape (n,)
        EVT3 words.
    i : int
        Number of the TIME_LOW in question.
    high, low : int
        Current upper and lower bits of the time.
    final : bool
        True where the file ends after these words.

    Returns
    -------
    int
        REJECTED, ACCEPTED, UNUSED or UNDECIDED.
    """
    value = words[i] & 0xFFF
    votes = 0
    against: Int = 0
    has_events = False
    pending: Int = -1
    for j in range(i + 1, words.size):
        kind, other = words[j] >> 12, words[j] & 0xFFF
        if kind == 2 or kind == 4 or kind == 5 or kind == 10:  # an event, or an external trigger
            has_events = True
            if pending < 0:
                continue
            if pending >= value >= low and value - low <= _SMALL_STEP_US and votes == 0:
                return ACCEPTED
            votes += 1
            against += (low <= pending < value) if value >= low else (pending >= low)
            pending = -1
            if votes == _MAX_VOTES:
                break
        elif kind == 6 and not has_events:
            return UNUSED
        elif kind == 8 and other != high & 0xFFF and not has_events:
            return ACCEPTED if value >= low else UNUSED  # if that TIME_HIGH is right, it sets the low bits anew
        elif kind == 6:
            pending = other
        elif kind == 8 and other != high & 0xFFF:
            votes += 1
            against += value < low
            break
    else:
        if not final:
            return UNDECIDED
    if votes == 0:
        return ACCEPTED if value >= low else REJECTED
    return REJECTED if 2 * against > votes else ACCEPTED


@njit(cache=True)
def _set_time_high(state: Ints, value: Int, turn: Int, answer: int) -> None:
    """Set the clock to a TIME_HIGH, or mark the clock as not trusted where the word is rejected."""
    if answer == REJECTED:
        state[TRUSTED] = 0
        return
    step = clock_step(value, state[HIGH], turn) if state[HIGH] >= 0 else value + 1
    state[TRUSTED] |= HIGH_TRUSTED
    if step:
        state[HIGH] += step
        if state[HIGH] < 0:
            state[HIGH] += turn
        state[LOW], state[TRUSTED] = 0, BOTH_TRUSTED


@njit(cache=True)
def read_time_high(words: Ints, i: int, state: Ints, tally: Ints, turn: int, final: bool, place: int) -> bool:
    """Read the TIME_HIGH at `i`: use it, replace it or ignore it.

    Parameters
    ----------
    words : ndarray of int64, shape (n,)
        EVT2 or EVT3 words.
    i : int
        Number of the TIME_HIGH.
    state, tally : ndarray of int64
        See `validate.validate_event`; changed in place.
    turn : int
        Number of values of the clock: 2^12 (EVT3) or 2^28 (EVT2).
    final : bool
        True where the file ends after these words.
    place : int
        Byte of the word in the file.

    Returns
    -------
    bool
        False where the words that decide have not been read yet; then nothing is changed.
    """
    value = words[i] % turn
    answer, mended = ACCEPTED, value
    if state[HIGH] < 0 or value != state[HIGH] % turn:
        answer, mended = _check_time_high(words, i, state[HIGH], turn, final)
    if answer == UNDECIDED:
        return False
    if answer == REJECTED or mended != value:
        count_offence(tally, DOUBTFUL, state[EVENTS], place, words[i])
    if state[LENIENT]:
        _set_time_high(state, mended, turn, answer)
    else:
        _set_time_high(state, value, turn, ACCEPTED)
    return True
