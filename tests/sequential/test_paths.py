"""The most likely path, against all frames of a small format one by one."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.marker import PacketFormat
from bicode_lab.marker.manchester import manchester_encode
from bicode_lab.sequential.levels import MEMORY
from bicode_lab.sequential.paths import FIRST, best_contexts, score_places
from bicode_lab.soft_receiver.line_code import BicodeLine
from bicode_lab.soft_receiver.viterbi import path_score

LINES = [
    BicodeLine(packet_format=PacketFormat(payload_bits=payload, checksum_bits=check, start_bits=start))
    for payload, check, start in ((3, 1, 2), (4, 1, 3), (3, 2, 3))
]


def all_contexts(line: BicodeLine) -> np.ndarray:
    """Return the contexts of every frame, whatever its check says, from chip `FIRST` on, one row each."""
    n = line.packet_format.data_bits
    rows = []
    for value in range(2**n):
        data = manchester_encode(np.array([value >> k & 1 for k in range(n)], np.uint8), "ieee")
        chips = [*line.start_chips, *data.tolist()]
        rows.append([
            sum(chips[(k - back) % len(chips)] << back for back in range(MEMORY))
            for k in range(FIRST, FIRST + len(chips))
        ])  # fmt: skip
    return np.array(rows)


@pytest.mark.parametrize("line", LINES)
def test_the_best_path_is_the_best_of_all_frames(line: BicodeLine) -> None:
    rng = np.random.default_rng(0)
    every = all_contexts(line)
    n = line.frame_chips
    for _ in range(10):
        scores = rng.normal(size=(n, 1 << MEMORY))
        totals = scores[np.arange(n), every].sum(axis=1)
        contexts, total = best_contexts(scores, line)
        assert total == pytest.approx(totals.max())
        assert contexts.tolist() == every[totals.argmax()].tolist()
        assert path_score(scores, contexts) == pytest.approx(total)


@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("extra", [0, 1, 7, 40])
def test_each_place_has_the_best_of_all_frames_that_begin_there(line: BicodeLine, extra: int) -> None:
    """As many chips as a frame has are a ring; more chips are a row, in which a frame must end."""
    every, n = all_contexts(line), line.frame_chips
    scores = np.random.default_rng(extra).normal(size=(n + extra, 1 << MEMORY))
    count = n if extra == 0 else max(0, extra - FIRST + 1)
    expected = [
        max(scores[(start + FIRST + np.arange(n)) % (n + extra), contexts].sum() for contexts in every)
        for start in range(count)
    ]
    assert score_places(scores, line) == pytest.approx(np.array(expected))


def test_a_row_shorter_than_a_frame_has_no_place() -> None:
    assert score_places(np.zeros((LINES[0].frame_chips - 1, 1 << MEMORY)), LINES[0]).size == 0
