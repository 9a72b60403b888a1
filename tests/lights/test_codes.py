"""The codes of lights are probabilities, and allow what their lights send and nothing else."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from bicode_lab.lights.codes import (
    BOTH,
    FALL,
    NOTHING,
    RISE,
    Code,
    bicode_code,
    free_code,
    interval_code,
    repeated_bicode_code,
    standard_bicode_code,
    uart_code,
)
from bicode_lab.lights.edges import refine_period
from bicode_lab.lights.forward import fold, likely_repetitions, sum_over_paths
from bicode_lab.lights.interval_line import IntervalLine
from bicode_lab.marker import PacketFormat, encode_packet
from bicode_lab.soft_receiver.line_code import UartLine

RING = repeated_bicode_code(28)
assert RING is not None
CODES = {
    "free": free_code(),
    "bicode": bicode_code(),
    "paper": standard_bicode_code(),
    "ring": RING,
    "uart": uart_code(7, 2, True),
    "uart8": uart_code(8, 1, False),
    "interval": interval_code(),
}


def evidence(code: Code, deeds: np.ndarray) -> float:
    """Log-probability of deeds that were seen for certain."""
    weights = np.full((len(deeds), 4), -200.0)
    weights[np.arange(len(deeds)), deeds] = 0.0
    return float(sum_over_paths(weights, code.source, code.target, code.share, code.deed, code.start))


def deeds_of(chips: np.ndarray) -> np.ndarray:
    change = np.diff(chips.astype(int))
    return np.where(change > 0, RISE, np.where(change < 0, FALL, NOTHING))


@pytest.mark.parametrize("name", CODES)
def test_shares_are_probabilities(name: str) -> None:
    code = CODES[name]
    leaves = np.bincount(code.source, code.share, code.n_states)
    np.testing.assert_allclose(leaves, 1)
    np.testing.assert_allclose(code.start.sum(), 1)
    after = np.bincount(code.target, code.share * code.start[code.source], code.n_states)
    np.testing.assert_allclose(after, code.start, atol=1e-9)


@pytest.mark.parametrize("name", ["free", "interval"])
def test_the_sum_over_paths_is_that_over_every_path(name: str) -> None:
    code, rng = CODES[name], np.random.default_rng(0)
    weights = rng.normal(0, 1, (4, 4))
    total = 0.0
    for steps in itertools.product(range(code.source.size), repeat=4):
        if all(code.target[a] == code.source[b] for a, b in itertools.pairwise(steps)):
            chance = code.start[code.source[steps[0]]]
            for tick, step in enumerate(steps):
                chance *= code.share[step] * math.exp(weights[tick, code.deed[step]])
            total += chance
        if name == "interval" and steps[0] > 6:
            break
    whole = sum_over_paths(weights, code.source, code.target, code.share, code.deed, code.start)
    if name == "free":
        assert math.isclose(whole, math.log(total))
    else:
        assert math.exp(whole) >= total


def test_each_code_allows_what_its_light_sends() -> None:
    packet = np.tile(encode_packet(0x5A, PacketFormat()), 3)
    text = np.concatenate([UartLine(rate_hz=1).encode(ord(letter)) for letter in "Event beacons"])
    for name, chips, others in (
        ("paper", packet, ("uart", "free")),
        ("bicode", packet, ("uart", "free")),
        ("ring", packet, ("uart", "free")),
        ("uart", text, ("bicode", "paper", "free")),
    ):
        mine = evidence(CODES[name], deeds_of(chips))
        assert mine > max(evidence(CODES[other], deeds_of(chips)) for other in others) + 3, name
    word = np.tile(IntervalLine().encode(0xB4), 2)
    deeds = np.where(word == 1, BOTH, NOTHING)
    assert evidence(interval_code(), deeds) > -20
    assert evidence(interval_code(), np.where(np.arange(40) % 2 == 0, BOTH, NOTHING)) < -100
    assert repeated_bicode_code(27) is None
    assert repeated_bicode_code(6) is None


def test_repetitions_are_found_and_folded() -> None:
    chips = np.tile(encode_packet(37, PacketFormat()), 5)
    weights = np.zeros((chips.size - 1, 4))
    weights[np.arange(chips.size - 1), deeds_of(chips)] = 4
    assert 28 in likely_repetitions(weights, 20, 60)
    assert likely_repetitions(weights[:20], 20, 60) == (0, 0)
    np.testing.assert_allclose(fold(weights, 28).sum(0), weights.sum(0))
    np.testing.assert_array_equal(fold(weights, 28)[3], weights[3::28].sum(0))


def test_a_period_is_refined_in_spite_of_stray_events() -> None:
    rng = np.random.default_rng(1)
    tick = rng.choice(500, 200, replace=False)
    on = np.sort(np.concatenate([tick * 99.9 + rng.normal(30, 3, 200), rng.uniform(0, 50_000, 40)]))
    off = np.sort(tick * 99.9 + rng.normal(70, 3, 200))
    assert abs(refine_period(on, off, 99.95) - 99.9) < 0.003
