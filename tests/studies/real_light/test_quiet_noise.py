"""Tests of the noise of quiet blocks: known noise is measured as it was made, and moving things are left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.camera import Optics, PixelModel, Scene, record
from bicode_lab.events import Events, make_events, no_events
from bicode_studies.real_light.quiet_noise import BLOCK_PX, measure_noise, noise_table

WIDTH, HEIGHT = 200, 110  # the last ten rows are in no block
RATE_HZ, SECONDS = 0.2, 20.0


def even_noise(rng: np.random.Generator, off_share: float = 0.64) -> Events:
    """Return events of a Poisson process with the same rate in every pixel."""
    n = rng.poisson(RATE_HZ * SECONDS * WIDTH * HEIGHT)
    t_us = np.sort(rng.integers(0, round(SECONDS * 1e6), n))
    return make_events(rng.integers(0, WIDTH, n), rng.integers(0, HEIGHT, n), rng.random(n) > off_share, t_us)


def with_more(events: Events, x: object, y: object, t_us: object) -> Events:
    """Return the events together with others at given places and times, in the order of time."""
    both = np.concatenate([events, make_events(x, y, np.ones(np.size(t_us)), t_us)])  # type: ignore[arg-type]
    return both[np.argsort(both["t"], kind="stable")]


def test_even_noise_comes_out_as_it_was_put_in() -> None:
    noise = measure_noise(even_noise(np.random.default_rng(0)), WIDTH, HEIGHT)
    n = noise.pixel_counts.sum()
    assert noise.seconds == pytest.approx(SECONDS / 2, rel=1e-3)
    assert np.median(noise.block_hz) == pytest.approx(RATE_HZ, rel=0.1)
    assert noise.block_hz.mean() == pytest.approx(RATE_HZ, abs=5 * RATE_HZ / np.sqrt(n))  # not below: no block chosen
    assert noise.off_share == pytest.approx(0.64, abs=4 * np.sqrt(0.64 * 0.36 / n))
    assert noise.pixel_counts.var() / noise.pixel_counts.mean() == pytest.approx(1, abs=0.1)  # Poisson
    assert noise.pixel_counts.size == noise.block_hz.size * BLOCK_PX**2
    assert noise.intervals_us.size == n - (noise.pixel_counts > 0).sum()


def test_what_moves_is_not_judged() -> None:
    rng = np.random.default_rng(1)
    events = even_noise(rng)
    t_us = np.arange(0, SECONDS * 1e6, 500).astype(np.int64)
    busy = with_more(events, rng.integers(0, BLOCK_PX, t_us.size), rng.integers(0, BLOCK_PX, t_us.size), t_us)
    assert measure_noise(busy, WIDTH, HEIGHT).block_hz.mean() == pytest.approx(RATE_HZ, rel=0.1)


def test_a_hot_pixel_and_pairs_show() -> None:
    rng = np.random.default_rng(2)
    events = even_noise(rng)
    plain = noise_table({"plain": measure_noise(events, WIDTH, HEIGHT)})["plain"]
    quiet_in_its_first_half = np.arange(SECONDS * 0.5e6 + 1e4, SECONDS * 1e6, 5e3).astype(np.int64)
    counts = np.bincount(events["y"] // BLOCK_PX * (WIDTH // BLOCK_PX) + events["x"] // BLOCK_PX, minlength=50)[:50]
    place = int(counts.argmin())
    x, y = place % 10 * BLOCK_PX, place // 10 * BLOCK_PX
    hot = with_more(events, np.full(quiet_in_its_first_half.size, x), np.full(quiet_in_its_first_half.size, y),
                    quiet_in_its_first_half)  # fmt: skip
    table = noise_table({"hot": measure_noise(hot, WIDTH, HEIGHT)})["hot"]
    assert table["rate of the fastest pixel (Hz)"] == pytest.approx(200, rel=0.02)
    assert table["share of intervals below 10 ms"] > plain["share of intervals below 10 ms"] + 0.05
    assert table["variance over mean of a pixel's events"] > 2


def test_shares_of_pixels_fall_from_one() -> None:
    noise = measure_noise(even_noise(np.random.default_rng(3)), WIDTH, HEIGHT)
    shares = noise.share_above([0, 1, 2, 3, 10**6])
    assert shares[0] == 1
    assert (np.diff(shares) < 0).all()
    assert shares[-1] == 0
    assert shares[1] == pytest.approx((noise.pixel_counts > 0).mean())


def test_the_generator_has_the_noise_it_is_set_to() -> None:
    model = replace(PixelModel(), background_hz=0.5, hot_pixels=0)
    scene = Scene(markers=(), optics=Optics(width=WIDTH, height=HEIGHT), pixel_model=model)
    noise = measure_noise(record(scene, 10.0, rng=0), WIDTH, HEIGHT)
    assert noise.block_hz.mean() == pytest.approx(0.5, rel=0.05)
    assert noise.off_share == pytest.approx(model.background_off_share, abs=0.02)


@pytest.mark.parametrize(("width", "height"), [(WIDTH, HEIGHT), (10, 110)])
def test_nothing_to_judge_is_told_in_words(width: int, height: int) -> None:
    events = no_events() if width == WIDTH else even_noise(np.random.default_rng(0))
    with pytest.raises(ValueError, match="to measure noise takes events and a sensor of 20 px or"):
        measure_noise(events, width, height)
