"""The check that needs no truth."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.soft_receiver.text.check import MIN_HELD, NEAR, believed_near, doubt_text, variety


@pytest.mark.parametrize(
    ("n", "held", "words"),
    [
        (0, 0, "no letter"),
        (100, 81, None),
        (100, 79, "80 % are needed"),
        (10_000, 7101, None),
        (10_000, 7099, "71 % are needed"),
        (3, 3, "too few"),
        (4, 4, None),
        (10, 9, "100 % are needed"),
        (30, 27, None),
        (30, 26, "88 % are needed"),
    ],
)
def test_a_text_is_doubted_beyond_each_limit(n: int, held: int, words: str | None) -> None:
    codes = np.arange(n) % 40 + 60
    reason = doubt_text(codes, np.arange(n) < held)
    assert reason is None if words is None else words in (reason or "")
    assert MIN_HELD == 0.7


def test_letters_that_are_all_alike_may_be_those_of_a_lamp() -> None:
    held = np.ones(60, bool)
    assert "lamp" in (doubt_text(np.full(60, 85), held) or "")
    assert "lamp" in (doubt_text(np.arange(60) % 2, held) or "")
    assert doubt_text(np.arange(60) % 4, held) is None
    assert doubt_text(np.full(9, 85), held[:9]) is None
    assert variety(np.arange(60) % 4) == pytest.approx(4)


def test_letters_among_letters_that_do_not_hold_are_left_out() -> None:
    held = np.ones(200, bool)
    held[100:150] = np.arange(50) % 3 == 0
    near = believed_near(held)
    assert near[: 100 - NEAR].all()
    assert near[150 + NEAR :].all()
    assert not near[100 + NEAR : 150 - NEAR].any()
    assert believed_near(np.zeros(0, bool)).size == 0
    few = np.ones(7, bool)
    few[0] = False
    assert believed_near(few).all()
