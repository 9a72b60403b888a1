"""Lamps, hot pixels, bursts of moving edges and noise have no ID and make no row."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.events import make_events, merge

from .light import PERIOD_US, lamp, noise, receive, settings_of

END_US = 12 * PERIOD_US


RATES_HZ = (100.0, 120.0, 1000.0, 980.0, 1020.0, 2000.0, 1960.0, 2040.0)
LAMPS = [(rate_hz, seed) for rate_hz in RATES_HZ for seed in range(3)]


def lamp_events(rate_hz: float, seed: int):
    """Return the events of a lamp of drawn strength and duty, amid noise."""
    rng = np.random.default_rng(seed)
    strength = float(np.exp(rng.uniform(np.log(3), np.log(60))))
    events = lamp(rate_hz, float(rng.uniform(0.1, 0.9)), END_US, rng, on=strength, off=strength)
    return merge(events, noise(2000, END_US, rng))


@pytest.mark.parametrize(("rate_hz", "seed"), LAMPS)
def test_a_lamp_makes_no_row(rate_hz: float, seed: int) -> None:
    """1 kHz and 2 kHz are the rates of bits and of chips: the worst that a dimmer can have."""
    assert receive(lamp_events(rate_hz, seed), settings_of()) == []


def test_hot_pixels_make_no_row() -> None:
    rng = np.random.default_rng(0)
    parts = []
    for k, rate_hz in enumerate((500, 2000, 20_000)):
        n = int(rate_hz * END_US * 1e-6)
        zeros = np.zeros(n, int)
        parts.append(make_events(zeros + 10 + 25 * k, zeros + 30, rng.integers(0, 2, n), rng.integers(0, END_US, n)))
    assert receive(merge(*parts), settings_of()) == []


@pytest.mark.parametrize("seed", range(4))
def test_bursts_of_moving_edges_make_no_row(seed: int) -> None:
    """A hand shakes: for 2 to 15 ms at a time a place makes events of mostly one polarity."""
    rng = np.random.default_rng(seed)
    parts = []
    for begin in np.sort(rng.uniform(0, END_US - 15_000, 40)):
        n = int(rng.integers(20, 400))
        parts.append(make_events(
            rng.integers(30, 50, n), rng.integers(20, 40, n), rng.random(n) < rng.choice([0.1, 0.9]),
            begin + rng.uniform(0, rng.uniform(2000, 15_000), n),
        ))  # fmt: skip
    assert receive(merge(*parts), settings_of()) == []


@pytest.mark.parametrize("n_per_s", [500, 20_000, 200_000])
def test_noise_makes_no_row(n_per_s: float) -> None:
    assert receive(noise(n_per_s, END_US, np.random.default_rng(1)), settings_of()) == []
