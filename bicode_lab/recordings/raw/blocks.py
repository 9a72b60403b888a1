"""Read a file or a stream of bytes in blocks, and decode its words: RAW (EVT2, EVT2.1, EVT3, EVT4), DAT and ES.

One block is held in memory at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bicode_lab.events import EVENT_DTYPE, Events, copy_events
from bicode_lab.recordings.decode import Decoder
from bicode_lab.recordings.raw import dat_fast, evt2_fast, evt3_fast
from bicode_lab.recordings.raw.dat_es import decode_atis, decode_dat, decode_es
from bicode_lab.recordings.raw.evt21_evt4 import decode_evt4, decode_evt21
from bicode_lab.recordings.raw.evt_read import decode_evt2, decode_evt3
from bicode_lab.recordings.validate import CUT, KEPT, KIND, MARKS, VECTOR

_BLOCK_BYTES = 1 << 18
_MAX_WAITING_BYTES = 1 << 22  # a kernel that waits for words which decide about a time word waits no longer than this
_BUFFER_EVENTS = 1 << 16
_BUFFER_MARKS = 1 << 12
_PLAIN_EVENTS = 1 << 16
_CLOSER_LOOK = 256  # words; most of what needs a closer look is over after so many

KERNELS: dict[str, tuple[str, Callable[..., Any]]] = {
    "EVT2": ("<u4", decode_evt2),
    "EVT2.1": ("<u8", decode_evt21),
    "EVT3": ("<u2", decode_evt3),
    "EVT4": ("<u4", decode_evt4),
    "DAT": ("<u8", decode_dat),
    "ES": ("u1", decode_es),
    "ATIS": ("u1", decode_atis),
}
"""Type of a word, and the function that decodes words by all rules, of each format."""

PLAIN_KERNELS: dict[str, Callable[..., tuple[int, bool]]] = {
    "EVT2": evt2_fast.decode_plain,
    "EVT3": evt3_fast.decode_plain,
    "DAT": dat_fast.decode_plain,
}
"""The function that decodes words quickly up to the first that needs a closer look."""

Words = npt.NDArray[np.unsignedinteger]


def read_words(decoder: Decoder, kind: str, blocks: Iterable[bytes], place: int = 0) -> Iterator[Events]:
    """Yield the good events of each block of words.

    Parameters
    ----------
    decoder : Decoder
        It keeps account of what is found.
    kind : str
        A key of `KERNELS`.
    blocks : iterable of bytes
        The bytes of the stream; a word may lie in two blocks.
    place : int
        Byte of the file at which the first block begins.

    Yields
    ------
    ndarray of EVENT_DTYPE, shape (n,), n >= 0
    """
    word, _ = KERNELS[kind]
    size = np.dtype(word).itemsize
    reader, data = _WordReader(decoder, kind), b""
    for block in _then_end(blocks):
        data, final = data + (block or b""), block is None
        words = np.frombuffer(data, word, count=len(data) // size)
        if kind == "EVT2.1" and decoder.header.swapped:
            words = (words << np.uint64(32)) | (words >> np.uint64(32))
        used, n = 0, -1
        while n and used < words.size:
            n, events = reader(words[used:], place + used * size, final or len(data) > _MAX_WAITING_BYTES)
            used += n
            yield decoder.in_order(events)
        data, place = data[used * size :], place + used * size
    if data:
        decoder.note_end(CUT, len(data), place)
    elif kind == "EVT3" and decoder.state[KIND] in (3, 4):
        decoder.note_end(VECTOR, 1, place)


class _WordReader:
    """Decodes words with the fast kernel of their format, and with the one that knows all rules where that stops.

    Parameters
    ----------
    decoder : Decoder
    kind : str
        A key of `KERNELS`.
    """

    def __init__(self, decoder: Decoder, kind: str) -> None:
        self._decoder = decoder
        self._kernel = KERNELS[kind][1]
        self._plain = None if decoder.lenient else PLAIN_KERNELS.get(kind)
        self._out = np.empty(_BUFFER_EVENTS, EVENT_DTYPE)
        self._marks = np.empty((_BUFFER_MARKS, 3), np.int64)

    def __call__(self, words: Words, place: int, final: bool) -> tuple[int, Events]:
        """Decode some of the words; return how many, 0 where more are needed, and their good events."""
        if self._plain is not None:
            self._decoder.state[KEPT] = 0
            out = np.empty((_PLAIN_EVENTS, 2), np.int64)
            n, waits = self._plain(words, self._decoder.state, out)
            if n or (waits and not final):
                return n, out[: self._decoder.state[KEPT]].view(EVENT_DTYPE)[:, 0]
            n, events = self._look_closely(words[:_CLOSER_LOOK], place, final and words.size <= _CLOSER_LOOK)
            if n or words.size <= _CLOSER_LOOK:
                return n, events
        return self._look_closely(words, place, final)

    def _look_closely(self, words: Words, place: int, final: bool) -> tuple[int, Events]:
        """Decode some of the words by all rules."""
        state, tally = self._decoder.state, self._decoder.tally
        state[[KEPT, MARKS]] = 0
        n = self._kernel(words.astype(np.int64), place, final, state, tally, self._out, self._marks)
        self._decoder.add_triggers(self._marks[: state[MARKS]])
        return n, copy_events(self._out[: state[KEPT]])


def read_file_of_words(path: Path, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of a file of words.

    Parameters
    ----------
    path : Path
        The file to read.
    decoder : Decoder
        It validates the events, and knows the header of the file.

    Yields
    ------
    ndarray of EVENT_DTYPE, shape (n,), n >= 0
    """
    header = decoder.header
    with path.open("rb") as file:
        file.seek(header.offset)
        blocks = iter(lambda: file.read(_BLOCK_BYTES), b"")
        yield from read_words(decoder, "ATIS" if header.atis else header.format, blocks, header.offset)


def _then_end(blocks: Iterable[bytes]) -> Iterator[bytes | None]:
    """Yield the blocks, and None after the last."""
    yield from blocks
    yield None
