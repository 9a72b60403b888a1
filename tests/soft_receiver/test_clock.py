"""The transmitter's clock, found in marks."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.marker import PacketFormat
from bicode_lab.soft_receiver.clock import find_chips, lead_marks
from bicode_lab.soft_receiver.levels import PHASES, count_marks, guess_levels, learn_levels
from bicode_lab.soft_receiver.line_code import BicodeLine, UartLine

from .light import light_events

LINE = BicodeLine(packet_format=PacketFormat())
BIN_US = 31


def marks_of(events, bin_us=BIN_US):
    """Return the marks of events from time 0 on."""
    number = events["t"] // bin_us
    n = int(number.max()) + 1
    is_on = events["p"] > 0
    return lead_marks(np.bincount(number[is_on], minlength=n), np.bincount(number[~is_on], minlength=n))


@pytest.mark.parametrize("error_ppm", [-1000, -337, 0, 60, 401, 1000])
def test_clock_error_is_found_whatever_is_sent(error_ppm: float) -> None:
    rng = np.random.default_rng(0)
    for line in (LINE, UartLine(rate_hz=2000)):
        chips = np.concatenate([line.encode(int(v)) for v in rng.integers(0, 128, 2000 // line.frame_chips)])
        events = light_events(chips, 500.0, rng, error_ppm=error_ppm, on_per_edge=0.5, off_per_edge=0.3)
        numbers, found_ppm, _ = find_chips(marks_of(events), BIN_US, 500.0)
        assert found_ppm == pytest.approx(error_ppm, abs=50)  # a tenth of a chip over a second
        assert np.diff(numbers).mean() == pytest.approx(BIN_US / 500 / (1 + error_ppm * 1e-6), rel=5e-5)


def test_without_a_light_there_is_no_power() -> None:
    rng = np.random.default_rng(0)
    powers = []
    for _ in range(50):
        marks = np.where(rng.random(30_000) < 0.005, rng.choice([-1, 1], 30_000), 0).astype(np.int8)
        powers.append(find_chips(marks, BIN_US, 500.0)[2])
    assert max(powers) < 40
    assert find_chips(np.zeros(100, np.int8), BIN_US, 500.0)[1:] == (0.0, 0.0)


@pytest.mark.parametrize("fold_chips", [None, 28])
def test_counting_marks_is_the_plain_count(fold_chips: int | None) -> None:
    rng = np.random.default_rng(1)
    marks = rng.integers(-1, 2, 3000).astype(np.int8)
    chips = np.sort(rng.uniform(-5, 70, 3000))
    n = 28 if fold_chips else 60
    expected = np.zeros((n, PHASES, 3))
    for mark, chip in zip(marks, chips, strict=True):
        k, phase = divmod(int(np.floor((chip - 2) * PHASES)), PHASES)
        if fold_chips:
            k %= fold_chips
        if 0 <= k < n:
            expected[k, phase, {0: 0, 1: 1, -1: 2}[int(mark)]] += 1
    assert (count_marks(marks, chips, 2, n, fold_chips=fold_chips) == expected).all()


def test_levels_learn_what_on_and_off_look_like() -> None:
    """ON comes sooner and more often than OFF: the levels show this, and the tails in the context of the next chip."""
    rng = np.random.default_rng(2)
    line = UartLine(rate_hz=2000)
    chips = np.concatenate([line.encode(int(v)) for v in rng.integers(32, 127, 300)])
    events = light_events(chips, 500.0, rng, before=1, on_delay=0.3, off_delay=0.8, on_per_edge=2, off_per_edge=1)
    numbers = (np.arange(marks_of(events).size) + 0.5) * BIN_US / 500
    counts = count_marks(marks_of(events), numbers, 0, chips.size)
    levels = learn_levels(counts, line, 3, 4)
    phases = np.arange(PHASES)
    rise, fall, after_fall = levels[0b001, :, 1], levels[0b110, :, 2], levels[0b100, :, 2]
    assert np.average(phases, weights=rise) < np.average(phases, weights=fall) - 2
    assert rise.sum() > 1.3 * fall.sum()
    assert after_fall[:8].sum() > 5 * levels[0b111, :8, 2].sum()
    assert np.allclose(levels.sum(axis=2), 1)
    assert np.allclose(guess_levels(counts, 3).sum(axis=2), 1)
