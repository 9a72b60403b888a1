"""Lights that are made, not recorded: each setting does what it says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.soft_receiver import UartLine
from bicode_studies.real_light.synthetic_lights import Light, send

CLEAN = Light(rate_hz=1000, length_s=4, events=20, event_jitter=0.02, latency_on=0.3, latency_off=0.3)


def delays_of(light: Light, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return for every event how long after the latest edge of its side it comes [chips], and whether it is ON."""
    sent = send(light, np.random.default_rng(seed))
    t, is_on = sent.events["t"] + 0.5, sent.events["p"] > 0
    delay = np.empty(t.size)
    for side in (True, False):
        edges = sent.edge_us[sent.rises == side]
        at = np.searchsorted(edges, t[is_on == side] + 200) - 1  # events may come a little before their edge
        delay[is_on == side] = (t[is_on == side] - edges[at]) * light.rate_hz * 1e-6
    return delay, is_on


def test_edges_are_those_of_the_text() -> None:
    light = replace(CLEAN, clock_ppm=800.0, idle=0.3)
    sent = send(light, np.random.default_rng(1))
    line, chip_us = UartLine(rate_hz=1000), 1000 * (1 + 800e-6)
    assert sent.start_us.size == len(sent.text) > 200
    assert (np.diff(sent.start_us) > 11 * chip_us - 1).all()
    assert np.allclose(np.diff(sent.start_us) / chip_us % 1, np.round(np.diff(sent.start_us) / chip_us % 1))
    for k in (0, 50, 199):
        at = np.flatnonzero(np.diff(line.encode(ord(sent.text[k])).astype(int), prepend=1))
        inside = (sent.edge_us > sent.start_us[k] - 1) & (sent.edge_us < sent.start_us[k] + 10.5 * chip_us)
        assert sent.edge_us[inside] == pytest.approx(sent.start_us[k] + at * chip_us)
        assert not sent.rises[inside][0]
    share = 1 - len(sent.text) * 11 * chip_us / 4e6
    assert share == pytest.approx(0.3, abs=0.05)


@pytest.mark.parametrize("ratio", [0.3, 1.0, 3.0])
def test_events_of_an_edge_latency_and_jitter(ratio: float) -> None:
    light = replace(CLEAN, ratio=ratio, latency_off=0.6, event_jitter=0.1)
    delay, is_on = delays_of(light)
    sent = send(light, np.random.default_rng(0))
    assert is_on.sum() / sent.rises.sum() == pytest.approx(20 * ratio**0.5, rel=0.05)
    assert (~is_on).sum() / (~sent.rises).sum() == pytest.approx(20 / ratio**0.5, rel=0.05)
    assert delay[is_on].mean() == pytest.approx(0.3, abs=0.01)
    assert delay[~is_on].mean() == pytest.approx(0.6, abs=0.01)
    assert delay[is_on].std() == pytest.approx(0.1, abs=0.01)


def test_a_whole_edge_scatters_by_edge_jitter() -> None:
    sent = send(replace(CLEAN, edge_jitter=0.1, event_jitter=0.01), np.random.default_rng(2))
    rises = sent.edge_us[sent.rises]
    t = sent.events["t"][sent.events["p"] > 0]
    first = np.searchsorted(t, rises - 200)
    means = np.array([np.median(t[a : a + 12]) for a in first[:-1]]) - rises[:-1]
    assert means.std() == pytest.approx(100, rel=0.25)
    assert means.mean() == pytest.approx(300, abs=20)


@pytest.mark.parametrize(
    ("changes", "n_events"),
    [
        ({"stray_hz": 3000.0}, (1.1, 2.0)),
        ({"lamp_hz": 100.0, "lamp_events": 10.0}, (1.1, 2.0)),
        ({"missing": 0.3}, (0.6, 0.8)),
        ({"refractory": 1.5}, (0.6, 0.95)),
        ({"comb_us": 500.0}, (0.95, 1.05)),
        ({"burst": 1.0}, (0.85, 1.15)),
        ({"tail_off": 0.5}, (0.95, 1.05)),
    ],
)
def test_each_habit_changes_the_events(changes: dict[str, float], n_events: tuple[float, float]) -> None:
    plain = send(CLEAN, np.random.default_rng(3))
    other = send(replace(CLEAN, **changes), np.random.default_rng(3))  # type: ignore[arg-type]
    assert n_events[0] < other.events.size / plain.events.size < n_events[1]
    if "comb_us" in changes:
        assert (other.events["t"] % 500 == 0).all()
    if "tail_off" in changes:
        delay, is_on = delays_of(replace(CLEAN, tail_off=0.5))
        assert delay[~is_on].mean() > delay[is_on].mean() + 0.2
    if "missing" in changes:
        begin, end = other.missing_us[0]
        assert not ((other.events["t"] >= begin) & (other.events["t"] < end)).any()


def test_a_clock_that_drifts_changes_its_rate() -> None:
    sent = send(replace(CLEAN, drift_ppm=400.0, length_s=20), np.random.default_rng(4))
    steps = np.diff(sent.start_us)
    assert steps[-50:].mean() / steps[:50].mean() == pytest.approx(1 + 400e-6, abs=60e-6)
