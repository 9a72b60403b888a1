"""Regions that keep the clock, against a plain computation of the powers."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.boxes import Box
from bicode_lab.events import Events, make_events, merge, no_events
from bicode_lab.marker import PacketFormat
from bicode_lab.sequential.lattice import BLOCK_PX, MIN_POWER, MIN_SHARE, LatticeFinder

from .light import HEIGHT, WIDTH, marker, noise


def plain_powers(events: Events, chip_us: float, width: int, height: int) -> np.ndarray:
    """Return the power of ON and OFF in each window of 2 x 2 blocks, shape (rows, columns, 2)."""
    rows, columns = -(-height // BLOCK_PX), -(-width // BLOCK_PX)
    phasors = np.exp(2j * np.pi * (events["t"] - events["t"][0]) / chip_us)
    powers = np.zeros((max(rows - 1, 1), max(columns - 1, 1), 2))
    for r in range(powers.shape[0]):
        for c in range(powers.shape[1]):
            inside = (events["y"] // BLOCK_PX - r) // 2 == 0
            inside &= (events["x"] // BLOCK_PX - c) // 2 == 0
            for p in (0, 1):
                own = phasors[inside & (events["p"] == p)]
                powers[r, c, p] = 2 * abs(own.sum()) ** 2 / max(own.size, 1)
    return powers


@pytest.mark.parametrize("chip_us", [500.0, 333.3, 2000.0])
def test_the_power_of_a_region_is_the_plain_one(chip_us: float) -> None:
    rng = np.random.default_rng(0)
    packet_format = PacketFormat(f_id_hz=5e5 / chip_us)
    events = merge(marker(37, packet_format, 33_000 * chip_us / 500, rng, on=8, off=6), noise(20_000, 33_000, rng))
    regions = LatticeFinder(chip_us, 28, WIDTH, HEIGHT)(events)
    weaker = plain_powers(events, chip_us, WIDTH, HEIGHT).min(axis=2)
    assert len(regions) == 1
    assert regions[0].power == pytest.approx(weaker.max(), rel=0.02)  # angles are rounded to 1 / 256 of a turn
    box = regions[0].box
    assert box.x <= 38
    assert box.right >= 42
    assert box.y <= 28
    assert box.bottom >= 32
    assert max(box.w, box.h) <= 4 * BLOCK_PX


def test_noise_makes_no_region() -> None:
    """Noise makes exp(-16) windows of this kind in each: with 345 windows, one in 25 000 periods."""
    rng = np.random.default_rng(1)
    finder = LatticeFinder(500.0, 28, WIDTH, HEIGHT)
    assert not any(finder(noise(rate, 33_000, rng)) for rate in (300, 10_000, 1_000_000) for _ in range(20))
    assert MIN_POWER == 16


def test_both_polarities_are_needed() -> None:
    """One hundred events of one polarity have a power of 200; those of the other decide at 16, which are 8 events."""
    finder = LatticeFinder(500.0, 28, WIDTH, HEIGHT)

    def region(n_off: int) -> bool:
        t = 500 * np.concatenate([np.arange(100) % 60, np.arange(n_off) % 60])
        p = np.repeat([1, 0], [100, n_off])
        return bool(finder(make_events(np.full(t.size, 20), np.full(t.size, 20), p, t)))

    assert not region(0)
    assert not region(7)
    assert region(9)


def test_regions_are_apart_and_the_strongest_comes_first() -> None:
    rng = np.random.default_rng(2)
    weak = marker(37, PacketFormat(), 33_000, rng, centre=(14, 14), on=5, off=5)
    strong = marker(90, PacketFormat(), 33_000, rng, centre=(70, 40), on=60, off=60)
    regions = LatticeFinder(500.0, 28, WIDTH, HEIGHT)(merge(weak, strong))
    assert [region.box.x > 40 for region in regions] == [True, False]
    assert regions[0].power > regions[1].power


def test_blocks_that_do_not_blink_do_not_belong() -> None:
    """A block belongs if it has a tenth of the strongest one's light, and one event."""
    finder = LatticeFinder(500.0, 28, WIDTH, HEIGHT)
    for n_weak, width in ((2, 4), (20, 8)):
        assert MIN_SHARE == 0.1
        t = 500 * np.concatenate([np.arange(100) % 60, np.arange(n_weak)])
        x = np.repeat([21, 25], [100, n_weak])
        both = [make_events(x, np.full(x.size, 21), np.full(x.size, p), t + 20 * p) for p in (0, 1)]
        assert finder(merge(*both))[0].box.w == width


def test_a_finder_forgets_the_period_before_and_may_see_nothing() -> None:
    finder = LatticeFinder(500.0, 28, 3, 3)
    events = make_events(np.zeros(60), np.zeros(60), np.arange(60) % 2, 500 * np.arange(60))
    assert not finder(no_events())
    assert len(finder(events)) == 1
    assert not finder(events[:4])
    assert finder(events)[0].box == Box(0, 0, 3, 3)


@pytest.mark.parametrize(("jitter_us", "seconds"), [(40, 0.3), (300, 0.6)])
@pytest.mark.parametrize("error_ppm", [0, 900])
def test_a_faint_marker_is_found_in_a_second(jitter_us: float, seconds: float, error_ppm: float) -> None:
    """One event in four edges; with a jitter of 150 us (standard deviation) the line at the chip rate is lost."""
    rng = np.random.default_rng(3)
    look = {"on": 0.25, "off": 0.25, "jitter_us": jitter_us, "radius_px": 1.5, "centre": (61.0, 20.0)}
    faint = marker(37, PacketFormat(), 1e6 * seconds, rng, error_ppm=error_ppm, **look)
    finder = LatticeFinder(500.0, 28, WIDTH, HEIGHT)
    boxes = [region.box for region in finder.faint(merge(faint, noise(3000, 1e6 * seconds, rng)))]
    assert any(box.x <= 61 < box.right and box.y <= 20 < box.bottom for box in boxes)


def test_noise_and_hot_pixels_are_no_faint_markers() -> None:
    """Noise makes 0.1 windows in a search of 57,600; here there are 345, searched 20 times."""
    rng = np.random.default_rng(4)
    finder = LatticeFinder(500.0, 28, WIDTH, HEIGHT)
    found = 0
    for _ in range(20):
        hot = make_events(np.full(400, 30), np.full(400, 30), rng.integers(0, 2, 400), rng.integers(0, 1_000_000, 400))
        found += len(finder.faint(merge(noise(20_000, 1e6, rng), hot)))
    assert found <= 1
    assert finder.faint(no_events()) == []
