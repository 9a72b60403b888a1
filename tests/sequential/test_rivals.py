"""Lamps, bursts and noise, against plain loops."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.marker import PacketFormat
from bicode_lab.sequential.fold import PHASES, Bins
from bicode_lab.sequential.levels import GUESS_CHIPS, GUESS_EVENTS
from bicode_lab.sequential.rivals import LAMP_PHASES, burst_score, lamp_score

from .light import bins_of, lamp, marker, noise

ONES = np.ones(2)


def grouped(bins: Bins, groups: np.ndarray, dispersion: np.ndarray) -> float:
    """Return the log-likelihood of counts whose mean depends on their group, in plain loops."""
    score = 0.0
    for side in (0, 1):
        mean = (bins.counts[:, side].sum() + 0.5) / (bins.chips.size + 1)
        weight = min(GUESS_EVENTS * dispersion[side] / mean, GUESS_CHIPS * PHASES)
        for group in set(groups.tolist()):
            count = bins.counts[groups == group, side]
            rate = (count.sum() + mean * weight) / (count.size + weight)
            score += (count.sum() * np.log(rate) - count.size * rate) / dispersion[side]
    return float(score)


def test_bursts_are_the_plain_sum() -> None:
    rng = np.random.default_rng(0)
    bins = Bins(10 + np.sort(rng.uniform(0, 66, 528)), rng.poisson(1.0, (528, 2)).astype(float))
    groups = np.floor((bins.chips - bins.chips[0]) / 4).astype(int)
    for dispersion in (ONES, np.array([1.5, 4.0])):
        assert burst_score(bins, dispersion) == pytest.approx(grouped(bins, groups, dispersion))


@pytest.mark.parametrize("rate_hz", [100.0, 120.0, 1000.0, 980.0, 2040.0])
def test_a_lamp_is_explained_at_its_own_rate(rate_hz: float) -> None:
    """The rate that is tried may be wrong by a fraction of a cycle over the whole time; the true one is no better."""
    rng = np.random.default_rng(1)
    bins = bins_of(lamp(rate_hz, 0.4, 150_000, rng, on=10, off=10), 500.0)
    groups = np.floor(bins.chips * rate_hz * 500e-6 % 1.0 * LAMP_PHASES).astype(int)
    truth, nothing = grouped(bins, groups, ONES), grouped(bins, np.zeros_like(groups), ONES)
    found = lamp_score(bins, ONES, 28)
    assert found - nothing > 0.8 * (truth - nothing)


def test_noise_is_no_lamp() -> None:
    """A slow lamp has up to 149 phases in 28 chips / 1.5, of ON and OFF; noise gains half a nat for each number."""
    rng = np.random.default_rng(2)
    gains = []
    for _ in range(20):
        bins = bins_of(noise(5000, 150_000, rng), 500.0)
        gains.append(lamp_score(bins, ONES, 28) - grouped(bins, np.zeros(bins.chips.size, int), ONES))
    assert 0 < np.mean(gains) < 2 * 149 / 2


def test_a_packet_is_no_lamp() -> None:
    """A lamp cannot explain the start, in which there are no events."""
    bins = bins_of(marker(37, PacketFormat(), 150_000, np.random.default_rng(3), on=10, off=10), 500.0)
    place = np.floor(bins.chips * PHASES).astype(int) % (28 * PHASES)
    assert grouped(bins, place, ONES) > lamp_score(bins, ONES, 28) + 500
