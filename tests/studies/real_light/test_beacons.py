"""Tests of the paper's rule on a beacon, and of the measurement of its transmitter."""

import numpy as np
import pytest

from bicode_lab.events import make_events, no_events
from bicode_studies.real_light.beacons import measure_transmitter, read_letters_by_rule
from bicode_studies.real_light.text_score import SONNET_18


def light_of(text, rate_hz, *, events_per_edge=20, spread_us=20, idle_chips=5, seed=0):
    """Return events of an LED that sends a text; each edge makes a burst of events."""
    chips = [1] * idle_chips
    for letter in text:
        bits = [int(b) for b in f"{ord(letter):07b}"]
        chips += [0, *bits, sum(bits) % 2, 1, 1]
    chips += [1] * idle_chips
    edges = np.flatnonzero(np.diff(chips)) + 1
    rng = np.random.default_rng(seed)
    t_us = edges[:, None] * 1e6 / rate_hz + rng.uniform(0, spread_us, (edges.size, events_per_edge))
    p = np.repeat(np.array(chips)[edges], events_per_edge)
    order = np.argsort(t_us.ravel(), kind="stable")
    zeros = np.zeros(order.size)
    return make_events(zeros, zeros, p[order], t_us.ravel()[order].astype(np.int64))


@pytest.mark.parametrize("rate_hz", [504, 3125, 9600])
@pytest.mark.parametrize("bins_per_chip", [2, 3, 4, 8])
def test_the_rule_reads_a_clean_light_at_every_rate(rate_hz, bins_per_chip):
    text = SONNET_18[:120]
    letters = read_letters_by_rule(light_of(text, rate_hz), rate_hz, bins_per_chip=bins_per_chip)
    assert "".join(letter.letter for letter in letters) == text
    assert all(letter.parity_ok for letter in letters)


def test_the_rule_says_when_a_letter_began():
    letters = read_letters_by_rule(light_of("ab", 500), 500, bins_per_chip=4)
    apart_us = letters[1].t_us - letters[0].t_us
    assert apart_us == pytest.approx(22_000, abs=500)


def test_the_rule_reads_a_clock_half_a_percent_off():
    text = SONNET_18[:60]
    letters = read_letters_by_rule(light_of(text, 3125 * 1.005), 3125, bins_per_chip=4)
    assert "".join(letter.letter for letter in letters) == text


def test_no_events_are_no_letters_and_a_rate_of_nothing_is_refused():
    assert read_letters_by_rule(no_events(), 504) == []
    with pytest.raises(ValueError, match="rate above 0"):
        read_letters_by_rule(no_events(), 0)
    with pytest.raises(ValueError, match="2 bins"):
        read_letters_by_rule(no_events(), 504, bins_per_chip=1)


def frames_of(text):
    return [[0, *map(int, f"{ord(c):07b}"), f"{ord(c):07b}".count("1") % 2, 1, 1] for c in text]


@pytest.mark.parametrize("ppm", [-900, 0, 350])
def test_the_transmitters_clock_and_edges_are_measured(ppm):
    text = SONNET_18[:200]
    rate_hz = 3125 / (1 + ppm * 1e-6)
    events = light_of(text, rate_hz, events_per_edge=12)
    t_us = 5e6 / rate_hz + np.arange(len(text)) * 11e6 / rate_hz
    found = measure_transmitter(events, t_us.astype(int), frames_of(text), 3125)
    assert found.n_letters == 200
    assert found.slower_ppm == pytest.approx(ppm, abs=20)
    assert found.on_per_rise == pytest.approx(12, abs=0.2)
    assert found.off_per_fall == pytest.approx(12, abs=0.2)


def test_the_longest_run_without_a_pause_is_taken():
    t_us = np.concatenate([np.arange(5) * 22_000, 10**6 + np.arange(9) * 22_000])
    found = measure_transmitter(light_of("a" * 50, 500), t_us, frames_of("a" * 14), 500)
    assert found.n_letters == 9
    assert measure_transmitter(no_events(), [], [], 500) is None
