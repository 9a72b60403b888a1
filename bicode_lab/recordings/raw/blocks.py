"""Read a file or a stream of bytes in blocks, and decode its words: RAW (EVT2, EVT2.1, EVT3, EVT4), DAT and ES.

One block is held in memory at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bicode_lab.events import EVENT_DTYPE, Events, copy_events
from bicode_lab.recordings.decode import Decoder
from bicode_lab.recordings.raw.dat_es import decode_atis, decode_dat, decode_es
from bicode_lab.recordings.raw.evt21_evt4 import decode_evt4, decode_evt21
from bicode_lab.recordings.raw.evt_read import decode_evt2, decode_evt3
from bicode_lab.recordings.validate import CUT, KEPT, KIND, MARKS, VECTOR

_BLOCK_BYTES = 1 << 17
_MAX_WAITING_BYTES = 1 << 22  # a kernel that waits for words which decide about a time word waits no longer than this
_BUFFER_EVENTS = 1 << 16
_BUFFER_MARKS = 1 << 12

KERNELS: dict[str, tuple[str, Callable[..., Any]]] = {
    "EVT2": ("<u4", decode_evt2),
    "EVT2.1": ("<u8", decode_evt21),
    "EVT3": ("<u2", decode_evt3),
    "EVT4": ("<u4", decode_evt4),
    "DAT": ("<u8", decode_dat),
    "ES": ("u1", decode_es),
    "ATIS": ("u1", decode_atis),
}
"""Type of a word, and the function that decodes words, of each format."""


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
    word, kernel = KERNELS[kind]
    size = np.dtype(word).itemsize
    out, marks = np.empty(_BUFFER_EVENTS, EVENT_DTYPE), np.empty((_BUFFER_MARKS, 3), np.int64)
    state, data = decoder.state, b""
    for block in _then_end(blocks):
        data, final = data + (block or b""), block is None
        words = np.frombuffer(data, word, count=len(data) // size).astype(np.int64)
        if kind == "EVT2.1" and decoder.header.swapped:
            words = (words << 32) | ((words >> 32) & 0xFFFFFFFF)
        used, n = 0, -1
        while n and used < words.size:
            state[[KEPT, MARKS]] = 0
            no_more_waiting = final or len(data) > _MAX_WAITING_BYTES
            n = kernel(words[used:], place + used * size, no_more_waiting, state, decoder.tally, out, marks)
            used += n
            decoder.add_triggers(marks[: state[MARKS]])
            yield decoder.in_order(copy_events(out[: state[KEPT]]))
        data, place = data[used * size :], place + used * size
    if data:
        decoder.note_end(CUT, len(data), place)
    elif kind == "EVT3" and state[KIND] in (3, 4):
        decoder.note_end(VECTOR, 1, place)


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
