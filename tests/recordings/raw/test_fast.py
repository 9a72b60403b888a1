"""The fast kernels against those that know all rules: the same events, errors and triggers for any words."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from bicode_lab.events import make_events
from bicode_lab.recordings import RecordingError, open_recording, write_recording
from bicode_lab.recordings.raw import blocks
from bicode_lab.recordings.raw.evt3_write import evt3_header, write_evt3

WIDTH, HEIGHT = 640, 480
HEAD = {
    "EVT3": evt3_header(WIDTH, HEIGHT),
    "EVT2": b"% evt 2.0\n% geometry 640x480\n% end\n",
    "DAT": b"% Data file containing CD events.\n% Version 2\n% Width 640\n% Height 480\n\x0c\x08",
}
WORD = {"EVT3": "<u2", "EVT2": "<u4", "DAT": "<u8"}
SUFFIX = {"EVT3": ".raw", "EVT2": ".raw", "DAT": ".dat"}


def good_words(kind: str, rng: np.random.Generator, n: int = 400) -> np.ndarray:
    """Return the words of a good file with single events, vectors, repeated time words and a turn of the clock."""
    t = np.sort(rng.integers(16_770_000, 16_790_000, n))
    t[n // 2 : n // 2 + 60] = t[n // 2]
    t = np.sort(t)
    x, y, p = rng.integers(0, WIDTH, n), rng.integers(0, HEIGHT, n), rng.integers(0, 2, n)
    x[n // 2 : n // 2 + 60], y[n // 2 : n // 2 + 60], p[n // 2 : n // 2 + 60] = np.arange(60) + 100, 7, 1
    if kind == "EVT2":
        return np.stack([0x80000000 | t >> 6, p << 28 | (t & 63) << 22 | x << 11 | y], axis=1).ravel().astype("<u4")
    if kind == "DAT":
        return (t | x << 32 | y << 46 | p << 60).astype("<u8")
    file = BytesIO()
    write_evt3(file, iter([make_events(x, y, p, t)]), WIDTH, HEIGHT)
    return np.frombuffer(file.getvalue()[len(HEAD[kind]) :], "<u2").copy()


def damaged(words: np.ndarray, kind: str, rng: np.random.Generator) -> np.ndarray:
    """Return words of which some are flipped, doubled, dropped, moved, blank, or of a rarer kind."""
    words = words.copy()
    bits = words.itemsize * 8
    for _ in range(int(rng.integers(0, 4))):
        at = int(rng.integers(0, words.size))
        what = rng.integers(0, 7)
        if what == 0:
            words[at] ^= words.dtype.type(1 << int(rng.integers(0, bits)))
        elif what == 1:
            words = np.insert(words, at, words[at])
        elif what == 2:
            words = np.delete(words, np.arange(at, min(at + int(rng.integers(1, 9)), words.size)))
        elif what == 3:
            words[at : at + int(rng.integers(1, 8))] = 0
        elif what == 4:
            words = np.roll(words, at)
        elif what == 5:  # a trigger, a word that pads, one of no known kind, a continued one
            words[at] = int(rng.choice([10, 9, 12, 14, 7])) << (bits - 4) | int(rng.integers(0, 200))
        else:
            words = words[: at + 1]
    return words


def outcome(path: Path) -> tuple[object, ...]:
    """Return all that a strict reading of a file tells."""
    try:
        recording = open_recording(path)
        parts = [part.copy() for part in recording]
        return (
            [part.tolist() for part in parts if part.size], str(recording.dropped), str(recording.remarks),
            recording.triggers.tolist(),
        )  # fmt: skip
    except RecordingError as error:
        return (str(error),)


@pytest.mark.parametrize("kind", [*HEAD])
@pytest.mark.parametrize("block_bytes", [64, 1 << 19])
def test_any_words_give_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, block_bytes: int) -> None:
    path = tmp_path / f"any{SUFFIX[kind]}"
    monkeypatch.setattr(blocks, "_BLOCK_BYTES", block_bytes)
    n_good = n_bad = 0
    for seed in range(400):
        rng = np.random.default_rng([seed, block_bytes])
        words = damaged(good_words(kind, rng, 120), kind, rng)
        path.write_bytes(HEAD[kind] + words.astype(WORD[kind]).tobytes())
        fast = outcome(path)
        with monkeypatch.context() as plain:
            plain.setattr(blocks, "PLAIN_KERNELS", {})
            assert outcome(path) == fast, seed
        n_good, n_bad = n_good + (len(fast) > 1), n_bad + (len(fast) == 1)
    assert min(n_good, n_bad) >= 100


@pytest.mark.parametrize("kind", [*HEAD])
def test_a_good_file_is_read_by_the_fast_kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    """Of 40,000 events, the other kernel decodes those of the first buffer at most."""
    path = tmp_path / f"good{SUFFIX[kind]}"
    words = good_words(kind, np.random.default_rng(1), 4000)
    path.write_bytes(HEAD[kind] + words.tobytes())
    closely: list[int] = []
    look = blocks._WordReader._look_closely

    def watched(self: blocks._WordReader, words: blocks.Words, place: int, final: bool) -> tuple[int, object]:
        n, events = look(self, words, place, final)
        closely.append(n)
        return n, events

    monkeypatch.setattr(blocks._WordReader, "_look_closely", watched)
    assert sum(part.size for part in open_recording(path)) == 4000
    assert sum(closely) < 0.2 * words.size


def test_what_was_written_is_read(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    n = 300_000
    events = make_events(
        *(rng.integers(0, side, n) for side in (WIDTH, HEIGHT, 2)), np.sort(rng.integers(0, 30_000_000, n))
    )
    path = tmp_path / "m.raw"
    write_recording(path, events, WIDTH, HEIGHT)
    assert open_recording(path).read().tolist() == events.tolist()
