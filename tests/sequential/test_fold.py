"""Events on chips, and the clock that puts them there."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.marker import PacketFormat
from bicode_lab.sequential.fold import OFF, ON, PHASES, UNSEEN_EVENTS, Bins, Clock, Folded, find_clock, fold, line_power

from .light import bins_of, marker


def some_bins(seed: int, n: int = 2000) -> Bins:
    """Return bins with random counts at random ascending times."""
    rng = np.random.default_rng(seed)
    return Bins(np.sort(rng.uniform(-20, 90, n)), rng.poisson(0.7, (n, 2)).astype(float))


@pytest.mark.parametrize("first", [None, -3, 5])
def test_folding_is_the_plain_count(first: int | None) -> None:
    bins, clock, n = some_bins(0), Clock(1.0007, np.array([0.3, -0.6])), 28
    sums, squares, exposure = (np.zeros((n, 2, PHASES)) for _ in range(3))
    for chip, counts in zip(bins.chips, bins.counts, strict=True):
        for side in (ON, OFF):
            k, phase = divmod(int(np.floor((1.0007 * chip - clock.origin[side]) * PHASES)), PHASES)
            k = k % n if first is None else k - first
            if 0 <= k < n:
                sums[k, side, phase] += counts[side]
                squares[k, side, phase] += counts[side] ** 2
                exposure[k, side, phase] += 1
    folded = fold(bins, clock, n, first)
    assert (folded.sums == sums).all()
    assert (folded.squares == squares).all()
    assert (folded.exposure == exposure).all()
    assert (folded.rolled(3).sums[0] == sums[3]).all()
    assert (folded.part(4, 2).squares == squares[4:6]).all()
    rate = (sums.sum(axis=(0, 2)) + 0.5) / (exposure.sum(axis=(0, 2)) + 1)
    assert folded.mean_rate() == pytest.approx(rate)


@pytest.mark.parametrize("error_ppm", [-1000, -400, 0, 130, 1000])
@pytest.mark.parametrize("payload", [0, 37, 255])
def test_the_clock_is_found_whatever_is_sent(error_ppm: float, payload: int) -> None:
    """A tenth of a chip over the second that is seen are 50 ppm."""
    packet_format = PacketFormat()
    rng = np.random.default_rng(payload)
    events = marker(payload, packet_format, 1_000_000, rng, error_ppm=error_ppm, on=3, off=2)
    clock = find_clock(bins_of(events, 500.0))
    assert clock.error_ppm == pytest.approx(error_ppm, abs=50)
    assert clock.later_off(1).origin.tolist() == [clock.origin[ON], clock.origin[OFF] + 1]


def test_each_polarity_begins_where_it_is_quiet() -> None:
    """ON comes 0.1 chip after its edge and OFF 0.6; the chips of either begin before this, in the quiet part."""
    rng = np.random.default_rng(1)
    events = marker(37, PacketFormat(), 500_000, rng, latency_us=(50, 300), jitter_us=20, on=20, off=20)
    origin = find_clock(bins_of(events, 500.0)).origin
    for side, arrives in ((ON, 0.1), (OFF, 0.6)):
        assert 0.25 < (arrives - origin[side]) % 1 < 0.75
    assert (origin[OFF] - origin[ON]) % 1 == pytest.approx(0.5, abs=0.13)


def test_line_power_is_that_of_independent_events() -> None:
    """The power is chi-squared with 4 degrees of freedom: mean 4, variance 8; the ratio is 1 on average."""
    rng = np.random.default_rng(2)
    chips = (np.arange(528) + 0.5) / PHASES
    n = 400
    powers, ratios = np.array([line_power(Bins(chips, rng.poisson(1.0, (528, 2)).astype(float)), 28)
                               for _ in range(n)]).T  # fmt: skip
    assert powers.mean() == pytest.approx(4, abs=4 * np.sqrt(8 / n))
    assert powers.var() == pytest.approx(8, rel=0.5)
    assert ratios.mean() == pytest.approx(1, abs=0.2)


def test_line_power_is_the_plain_sum() -> None:
    bins = some_bins(3)
    beside = [sign * (k + 1.5) / 28 for sign in (-1, 1) for k in range(4)]
    power, ratio = 0.0, []
    for side in (ON, OFF):
        counts, total = bins.counts[:, side], bins.counts[:, side].sum()
        lines = [abs(sum(c * np.exp(2j * np.pi * rate * t) for c, t in zip(counts, bins.chips, strict=True))) ** 2
                 for rate in [1, *(1 + b for b in beside)]]  # fmt: skip
        power += 2 * lines[0] / total
        ratio.append(lines[0] / max(np.mean(lines[1:]), total / 2))
    assert line_power(bins, 28) == pytest.approx((power, np.mean(ratio)))


def test_a_gap_that_the_code_cannot_have_was_not_seen() -> None:
    """At 2 events per chip, 14 events take 7 chips: a gap may be 10 + 7 chips long."""
    assert UNSEEN_EVENTS == 14
    for gap, left_out in ((14, False), (20, True)):
        chips = np.arange(0, 400) / 4.0
        counts = np.full((400, 2), 0.25)
        counts[(chips > 40) & (chips < 40 + gap)] = 0
        seen = Bins(chips, counts * 100 / (100 - gap)).seen(10)
        assert (seen.chips.size < 400) == left_out
        assert seen.counts.sum() == pytest.approx(counts.sum() * 100 / (100 - gap))
        if left_out:
            assert not ((seen.chips > 40) & (seen.chips < 40 + gap)).any()
            assert seen.chips.size == (counts > 0).all(axis=1).sum()


def test_the_time_before_the_first_event_and_after_the_last_was_not_seen() -> None:
    chips = np.arange(400) / 4.0
    counts = np.zeros((400, 2))
    counts[200:240] = 3
    assert Bins(chips, counts).seen(8).chips.tolist() == chips[200:240].tolist()
    nothing = Bins(chips, np.zeros((400, 2)))
    assert nothing.seen(8) is nothing


def test_a_burst_counts_as_no_more_than_three_usual_bins() -> None:
    counts = np.array([[4, 1], [4, 1], [4, 1], [4, 1], [4, 1], [13, 4], [0, 0]], float)
    usual = [4, 1]  # half of the events lie in bins of no more than so many
    capped = Bins(np.arange(7.0), counts).capped().counts
    for side in (ON, OFF):
        some = sorted(counts[counts[:, side] > 0, side])
        half = next(value for k, value in enumerate(some) if sum(some[: k + 1]) >= sum(some) / 2)
        assert capped[:, side].tolist() == np.minimum(counts[:, side], 3 * half).tolist()
        assert half == usual[side]
    assert counts[5, 1] == 4  # the given counts are as they were


def test_scatter_is_the_variance_from_frame_to_frame() -> None:
    """Three counts of 5, 7, 9 vary by 8 / 14 of their mean; a bin that was seen once says nothing."""
    shape = (1, 2, 1)
    sums, squares, seen = np.full(shape, 21.0), np.full(shape, 155.0), np.full(shape, 3.0)
    assert Folded(sums, squares, seen).scatter() == pytest.approx([1.0, 1.0])  # less than Poisson counts vary
    assert Folded(sums, squares + 40, seen).scatter() == pytest.approx([48 / 14, 48 / 14])
    assert Folded(sums, squares + 40, np.ones(shape)).scatter() == pytest.approx([1.0, 1.0])
