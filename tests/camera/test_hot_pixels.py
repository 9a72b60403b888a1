"""Hot pixels: their rates lie evenly in the logarithm over two decades, and chance decides which pixels they are."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.camera import Optics, PixelModel, Scene, record

OPTICS = Optics(width=640, height=480)
FASTEST_HZ, N, SECONDS = 200.0, 4000, 2.0


def counts_of_pixels(seed: int) -> np.ndarray:
    """Return the number of events of every pixel in the dark, where only hot pixels fire."""
    model = PixelModel(background_hz=0.0, hot_pixels=N, hot_pixel_hz=FASTEST_HZ)
    events = record(Scene(markers=(), optics=OPTICS, pixel_model=model), SECONDS, np.random.default_rng(seed))
    return np.bincount(events["y"].astype(int) * OPTICS.width + events["x"], minlength=OPTICS.width * OPTICS.height)


def test_rates_lie_evenly_in_the_logarithm_over_two_decades() -> None:
    """With u even in 0 .. 1 a rate is 200 Hz * 10^(-2 u).

    Half of the pixels are then above 20 Hz and a quarter above 63 Hz, with a binomial scatter; the mean is
    (1 - 0.01) / (2 ln 10) = 0.215 of the fastest, the standard deviation 0.25 of it.
    """
    counts = counts_of_pixels(0)
    for rate_hz, share in ((200 * 10**-0.5, 0.25), (20.0, 0.5), (200 * 10**-1.5, 0.75)):
        above = (counts > rate_hz * SECONDS).sum() / N
        assert above == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / N) + 0.01)  # 0.01: pixels hit twice
    mean = counts.sum() / SECONDS / N / FASTEST_HZ
    assert mean == pytest.approx(0.99 / (2 * np.log(10)), abs=4 * 0.25 / np.sqrt(N))
    assert counts.max() < FASTEST_HZ * SECONDS + 5 * np.sqrt(FASTEST_HZ * SECONDS) + FASTEST_HZ * SECONDS / 2


def test_the_slowest_still_fire() -> None:
    """The slowest fire twice a second: of those within a tenth of a decade of 2 Hz, exp(-4.5) = 1 % are never seen."""
    counts = counts_of_pixels(1)
    seen = (counts > 0).sum()
    unseen = np.exp(-FASTEST_HZ * SECONDS * 10 ** (-2 * (np.arange(1000) + 0.5) / 1000)).mean()
    twice = N * N / 2 / counts.size
    assert seen == pytest.approx(N * (1 - unseen) - twice, abs=4 * np.sqrt(N * unseen + twice))


def test_which_pixels_are_hot_is_chance() -> None:
    first, second = (set(np.flatnonzero(counts_of_pixels(seed)).tolist()) for seed in (2, 3))
    shared = len(first & second)
    expected = len(first) * len(second) / OPTICS.width / OPTICS.height
    assert shared == pytest.approx(expected, abs=5 * np.sqrt(expected))
