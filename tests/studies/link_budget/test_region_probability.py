"""Tests of the probability of a region: the receiver finds one where it is expected, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.events import make_events
from bicode_lab.marker import Marker
from bicode_lab.recognition import ReceiverSettings, find_regions
from bicode_studies.link_budget.region_probability import RegionProbability

SIZE = 24
SETTINGS = ReceiverSettings(width=SIZE, height=SIZE)
MARKER = Marker(payload=0x25)


def square(p: float, side: int) -> np.ndarray:
    """Return probability p at both edges in a square whose first pixel is (8, 8), and 0 elsewhere."""
    fires = np.zeros((2, SIZE, SIZE))
    fires[:, 8 : 8 + side, 8 : 8 + side] = p
    return fires


def found_share(fires: np.ndarray, settings: ReceiverSettings, periods: int = 60) -> float:
    """Return how often the receiver finds a region when pixels fire so probably, 100 us after an edge."""
    rng = np.random.default_rng(0)
    found = 0
    for _ in range(periods):
        wave = Marker(payload=0x25, phase_us=rng.uniform(0, 14_000)).waveform
        times, levels = wave.steps(0, settings.delta_t_whole_us)
        columns = []
        for t_us, level in zip(times[1:], levels[1:], strict=True):
            y, x = np.nonzero(rng.random((SIZE, SIZE)) < fires[int(level > 0)])
            columns.append((x, y, np.full(x.size, int(level > 0)), np.full(x.size, int(t_us) + 100)))
        x, y, p, t = (np.concatenate(column) for column in zip(*columns, strict=True))
        found += bool(find_regions(make_events(x, y, p, t), 0, settings))
    return found / periods


def found_probability(fires: np.ndarray, settings: ReceiverSettings = SETTINGS) -> float:
    boxes = RegionProbability(MARKER, settings)(fires)
    assert sum(weight for weight, _ in boxes) == pytest.approx(1)
    return sum(weight for weight, box in boxes if box)


def test_what_always_fires_is_found_where_it_is_and_what_never_does_is_not() -> None:
    ((weight, box),) = RegionProbability(MARKER, SETTINGS)(square(1.0, 5))
    assert weight == pytest.approx(1)
    assert box == (slice(8, 13), slice(8, 13))
    assert RegionProbability(MARKER, SETTINGS)(square(0.0, 5)) == [(1.0, None)]


@pytest.mark.parametrize("opening_px", [0, 3])
def test_the_receiver_finds_what_is_expected(opening_px: int) -> None:
    """Faint and bright squares agree; nothing is claimed for probabilities between 0.1 and 0.9."""
    settings = ReceiverSettings(width=SIZE, height=SIZE, opening_px=opening_px)
    expected = {p: found_probability(square(p, 3), settings) for p in (0.02, 0.05, 0.1, 0.2, 0.4, 0.8)}
    assert list(expected.values()) == sorted(expected.values())
    assert min(expected.values()) < 0.1
    assert max(expected.values()) > 0.9
    for p, probability in expected.items():
        share = found_share(square(p, 3), settings)
        if probability > 0.9:
            assert share > 0.5, p
        elif probability < 0.1:
            assert share < 0.5, p


def test_an_opening_drops_a_thin_line() -> None:
    line = np.zeros((2, SIZE, SIZE))
    line[:, 10, 4:20] = 1.0
    assert found_probability(line) == pytest.approx(1)
    assert found_probability(line, ReceiverSettings(width=SIZE, height=SIZE, opening_px=3)) == 0
