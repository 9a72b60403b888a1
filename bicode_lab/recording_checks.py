"""Does a file keep the rules?   its bytes -> how many events break which rule, and where the first is

faery turns the bytes into events, but it passes some files off as good: a time running
backwards is held at its last value, the end of a cut event is dropped, and at a bad
coordinate it gives up without a place. So the bytes are read a second time here, in
step with faery, and only judged. One block is held at a time.

EVT3 time: TIME_HIGH is authoritative. A new one sets the low 12 bits to zero, only the
step from 4095 to 0 is a wrap (24 bits, 16.78 s), and a TIME_LOW that steps back is no
wrap. Real sensors send such steps: a Gen4.1 one sends now and then a TIME_LOW up to
11 us ahead and corrects it in the next word. No event comes between the two, so the
events themselves never step back, and the rule can be strict.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

from bicode_lab.recording_headers import Header, RecordingError

_BLOCK_BYTES = 1 << 20
_UNTIMED, _X, _Y, _P, _BACKWARDS, _IDLE = range(6)  # rows of a tally
_COUNT, _EVENT, _PLACE, _VALUE = range(4)  # columns of a tally; events are counted from 0, lines from 1
# A scan's memory between blocks. HIGH is -1 until a time word came.
_EVENTS, _LAST, _HIGH, _LOW, _WRAPS, _AT_X, _AT_Y, _KIND, _WIDTH, _HEIGHT = range(10)

Ints = npt.NDArray[np.int64]
Int = int | np.int64


@njit(cache=True)
def _note(tally: Ints, rule: Int, event: Int, place: Int, value: Int) -> None:
    """Count one offence, and remember the first of its kind."""
    if tally[rule, _COUNT] == 0:
        tally[rule, _EVENT], tally[rule, _PLACE], tally[rule, _VALUE] = event, place, value
    tally[rule, _COUNT] += 1


@njit(cache=True)
def _judge(state: Ints, tally: Ints, x: Int, y: Int, p: Int, t: Int, place: Int) -> None:
    """One event against the rules; `place` is its byte or line."""
    event = state[_EVENTS]
    if x < 0 or x >= state[_WIDTH]:
        _note(tally, _X, event, place, x)
    if y < 0 or y >= state[_HEIGHT]:
        _note(tally, _Y, event, place, y)
    if p != 0 and p != 1:
        _note(tally, _P, event, place, p)
    if event > 0 and t < state[_LAST]:
        _note(tally, _BACKWARDS, event, place, state[_LAST] - t)
    state[_LAST] = t
    state[_EVENTS] += 1


@njit(cache=True)
def _scan_evt3(words: npt.NDArray[np.uint16], place: int, state: Ints, tally: Ints) -> int:
    """EVT3: 16-bit words, the upper 4 bits say which kind."""
    for i in range(words.size):
        word = np.int64(words[i])
        kind, value = word >> 12, word & 0xFFF
        where = place + 2 * i
        t = (((state[_WRAPS] << 12) | max(state[_HIGH], 0)) << 12) | state[_LOW]
        if kind in (2, 4, 5) and state[_HIGH] < 0:
            _note(tally, _UNTIMED, state[_EVENTS], where, 0)
        if kind == 0:  # row
            state[_AT_Y] = value & 0x7FF
            if state[_AT_Y] >= state[_HEIGHT]:
                _note(tally, _IDLE, state[_EVENTS], where, state[_AT_Y])
        elif kind == 2 or kind == 3:  # one event, or the base of a vector
            state[_AT_X] = value & 0x7FF
            if kind == 2:
                _judge(state, tally, state[_AT_X], state[_AT_Y], 0, t, where)
            elif state[_AT_X] >= state[_WIDTH]:
                _note(tally, _IDLE, state[_EVENTS], where, state[_AT_X])
        elif kind == 4 or kind == 5:  # 12 or 8 pixels side by side
            size = 12 if kind == 4 else 8
            for bit in range(size):
                if (value >> bit) & 1:
                    _judge(state, tally, state[_AT_X] + bit, state[_AT_Y], 0, t, where)
            state[_AT_X] += size
        elif kind == 6:
            state[_LOW] = value
        elif kind == 8 and value != state[_HIGH]:
            if state[_HIGH] == 4095 and value == 0:
                state[_WRAPS] += 1
            if state[_HIGH] < 0 and value >= 4094:  # faery takes this for a step back over the wrap
                _note(tally, _UNTIMED, state[_EVENTS], where, value)
            state[_HIGH], state[_LOW] = value, 0
        state[_KIND] = kind
    return words.size * 2


@njit(cache=True)
def _scan_evt2(words: npt.NDArray[np.uint32], place: int, state: Ints, tally: Ints) -> int:
    """EVT2: 32-bit words; the upper 28 bits of the time come in words of their own and wrap at 34 bits."""
    for i in range(words.size):
        word = np.int64(words[i])
        kind = word >> 28
        if kind == 8:
            if state[_HIGH] - (word & 0xFFFFFFF) > 1 << 27:  # a smaller step back is no wrap
                state[_WRAPS] += 1
            state[_HIGH] = word & 0xFFFFFFF
        elif kind < 2:
            if state[_HIGH] < 0:
                _note(tally, _UNTIMED, state[_EVENTS], place + 4 * i, 0)
            t = (state[_WRAPS] << 34) | (max(state[_HIGH], 0) << 6) | ((word >> 22) & 0x3F)
            _judge(state, tally, (word >> 11) & 0x7FF, word & 0x7FF, kind, t, place + 4 * i)
    return words.size * 4


@njit(cache=True)
def _scan_dat(words: npt.NDArray[np.uint64], place: int, state: Ints, tally: Ints) -> int:
    """DAT: 64-bit words of 32 bits of time, 14 of x, 14 of y and 4 of polarity; the time wraps at 32 bits."""
    for i in range(words.size):
        low = np.int64(words[i] & np.uint64(0xFFFFFFFF))
        rest = np.int64(words[i] >> np.uint64(32))
        if state[_LOW] - low > 1 << 31:
            state[_WRAPS] += 1
        state[_LOW] = low
        t = (state[_WRAPS] << 32) + low
        _judge(state, tally, rest & 0x3FFF, (rest >> 14) & 0x3FFF, rest >> 28, t, place + 8 * i)
    return words.size * 8


@njit(cache=True)
def _scan_es_events(data: npt.NDArray[np.uint8], place: int, state: Ints, tally: Ints, atis: bool) -> int:
    """Event Stream: 5 bytes an event, times as steps; bytes that only lengthen the step stand alone."""
    i = 0
    while i < data.size:
        first = data[i]
        if (first >= 0xFC) if atis else (first >= 0xFE):
            i += 1
            continue
        if i + 5 > data.size:
            break
        if not (atis and first & 1):  # exposures are not contrast events
            x = np.int64(data[i + 1]) | np.int64(data[i + 2]) << 8
            y = np.int64(data[i + 3]) | np.int64(data[i + 4]) << 8
            _judge(state, tally, x, y, 0, 0, place + i)
        i += 5
    return i


def _scan_es(data: npt.NDArray[np.uint8], place: int, state: Ints, tally: Ints) -> int:
    return int(_scan_es_events(data, place, state, tally, False))


def _scan_atis(data: npt.NDArray[np.uint8], place: int, state: Ints, tally: Ints) -> int:
    return int(_scan_es_events(data, place, state, tally, True))


@njit(cache=True)
def _scan_columns(columns: Ints, place: int, state: Ints, tally: Ints) -> None:
    """Rows of x, y, p, t."""
    for i in range(columns.shape[0]):
        x, y, p, t = columns[i]
        _judge(state, tally, x, y, p, t, place + i)


class Check:
    """A file read in blocks, in step with its decoder, and judged; `problem` is None while all is well."""

    def __init__(self, path: Path, header: Header, width: int, height: int) -> None:
        self.path = path
        self.header = header
        self.tally: Ints = np.zeros((6, 4), np.int64)
        self.state: Ints = np.zeros(10, np.int64)
        self.state[_HIGH] = -1
        self.state[_WIDTH], self.state[_HEIGHT] = width, height
        self.place = {"CSV": "line", "AEDAT4": "", "npz": ""}.get(header.format, "byte")
        self._blocks = self._judge_blocks()

    def advance(self, n_events: int | None = None) -> None:
        """Judge the file up to its first `n_events` events, or to the end; complain at the first offence.

        Raises
        ------
        RecordingError
            With the count of offenders in the whole file and the place of the first.
        """
        while n_events is None or self.state[_EVENTS] < n_events:
            if next(self._blocks, None) is None or self.offences:
                break
        if self.offences:
            for _ in self._blocks:
                pass
            self.complain()

    def judge(self, x: Ints, y: Ints, p: Ints, t: Ints) -> None:
        """Judge columns that were decoded elsewhere."""
        columns = np.stack([np.asarray(column, np.int64) for column in (x, y, p, t)], axis=1)
        _scan_columns(columns, int(self.state[_EVENTS]), self.state, self.tally)

    @property
    def offences(self) -> int:
        """Events that broke a rule so far."""
        return int(self.tally[:, _COUNT].sum())

    def complain(self) -> None:
        """Raise the offence that comes first in the file, if there is one."""
        rules = [rule for rule in range(len(self.tally)) if self.tally[rule, _COUNT]]
        if not rules:
            return
        rule = min(rules, key=lambda r: int(self.tally[r, _EVENT]))
        count, event, place, value = (int(number) for number in self.tally[rule])
        n, (width, height) = int(self.state[_EVENTS]), (int(self.state[_WIDTH]), int(self.state[_HEIGHT]))
        size = "check width and height, or export the file again"
        what, found, way_out = {
            _UNTIMED: ("no usable time word before them", f"time word {value}", "export the file again"),
            _X: (f"x outside the {width} px wide sensor", f"x = {value}", size),
            _Y: (f"y outside the {height} px high sensor", f"y = {value}", size),
            _P: ("a polarity that is neither 0 nor 1", f"p = {value}", "store OFF as 0 and ON as 1"),
            _IDLE: (f"a row or vector base outside the {width}x{height} px sensor near them", f"at {value}", size),
            _BACKWARDS: ("a time before the event ahead of it", f"{value:,} us back", "sort the events by time"),
        }[rule]
        where = f" at {self.place} {place:,}" if self.place else ""
        message = f"{count:,} of {n:,} events have {what}; the first is number {event:,}{where} ({found}); {way_out}"
        raise RecordingError(f"{self.path}: {message}")

    def _judge_blocks(self) -> Iterator[bool]:
        """Judge one block a step."""
        if self.header.format == "CSV":
            yield from self._judge_lines()
        elif self.header.format in ("EVT2", "EVT3", "DAT", "ES"):
            yield from self._judge_words()

    def _judge_words(self) -> Iterator[bool]:
        word, scan = self._scan()
        with self.path.open("rb") as file:
            file.seek(place := self.header.offset)
            rest = b""
            while block := file.read(_BLOCK_BYTES):
                data = rest + block
                words = np.frombuffer(data, word, count=len(data) // np.dtype(word).itemsize)
                used = scan(words, place, self.state, self.tally)
                place, rest = place + used, data[used:]
                yield True
        in_vector = self.header.format == "EVT3" and self.state[_KIND] in (3, 4)
        if rest or in_vector:
            what = "inside a vector of events" if in_vector else f"{len(rest)} of the bytes of an event"
            raise RecordingError(f"{self.path}: cut short at byte {place:,}: {what}; copy it again")

    def _scan(self) -> tuple[str, Callable[..., int]]:
        """The word of this format, and what judges a block of them."""
        table: dict[str, tuple[str, Any]] = {
            "EVT2": ("<u4", _scan_evt2),
            "EVT3": ("<u2", _scan_evt3),
            "DAT": ("<u8", _scan_dat),
            "ES": ("u1", _scan_atis if self.header.atis else _scan_es),
        }
        return table[self.header.format]

    def _judge_lines(self) -> Iterator[bool]:
        line_number = 2
        with self.path.open("rb") as file:
            file.seek(self.header.offset)
            while lines := file.readlines(_BLOCK_BYTES):
                columns = self._parse(lines, line_number)
                _scan_columns(columns, line_number, self.state, self.tally)
                line_number += len(lines)
                yield True

    def _parse(self, lines: list[bytes], line_number: int) -> Ints:
        """Lines of a CSV in, rows of x, y, p, t out."""
        wanted = self.header.columns
        try:
            table = np.loadtxt(lines, np.int64, comments=None, delimiter=",", usecols=wanted, ndmin=2)
            if len(table) == len(lines):
                return table
        except ValueError:
            pass
        for i, line in enumerate(lines):
            cells = line.split(b",")
            if len(cells) <= max(wanted) or not all(_is_integer(cells[column]) for column in wanted):
                text = line.decode("utf-8", errors="replace").strip()[:60]
                message = f"line {line_number + i:,} is {text!r}; each line holds whole numbers for x, y, p and t in us"
                raise RecordingError(f"{self.path}: {message}; correct it or export the file again")
        raise RecordingError(f"{self.path}: lines {line_number:,} and on hold no table; export the file again")


def _is_integer(cell: bytes) -> bool:
    try:
        return np.iinfo(np.int64).min <= int(cell) <= np.iinfo(np.int64).max
    except ValueError:
        return False
