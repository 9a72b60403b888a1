"""Tests of the arithmetic of packets in periods, against a count of one packet after the other."""

import numpy as np
import pytest

from bicode_studies.what_if.packet_timing import rate_bounds_hz, waiting_us, whole_packet_probability

LENGTHS = [(33_000, 14_000), (21_000, 14_000), (17_000, 14_000), (28_000, 14_000), (60_000, 7_000), (15_100, 14_000)]


def packets_in(period_start_us, delta_t_whole_us, packet_us, phase_us):
    """Count the packets that lie whole in a period."""
    starts = phase_us + packet_us * np.arange(-2, 400)
    return np.sum((starts >= period_start_us) & (starts + packet_us <= period_start_us + delta_t_whole_us))


@pytest.mark.parametrize(("whole_us", "packet_us"), LENGTHS)
def test_the_probability_is_the_counted_share(whole_us, packet_us):
    phases = (np.arange(5000) + 0.5) / 5000 * packet_us
    share = np.mean([packets_in(0, whole_us, packet_us, phase) > 0 for phase in phases])
    assert whole_packet_probability(whole_us, packet_us) == pytest.approx(share, abs=1 / 5000)


@pytest.mark.parametrize(("whole_us", "packet_us"), LENGTHS)
def test_the_waiting_time_is_the_simulated_one(whole_us, packet_us):
    rng = np.random.default_rng(0)
    waits = []
    for _ in range(2000):
        appears_us, phase_us = rng.uniform(0, whole_us), rng.uniform(0, packet_us)
        starts = phase_us + packet_us * np.arange(0, 400)
        starts = starts[starts >= appears_us]
        inside = starts // whole_us == np.ceil((starts + packet_us) / whole_us) - 1
        waits.append((starts[inside][0] // whole_us + 1) * whole_us - appears_us)
    mean_us, longest_us = waiting_us(whole_us, packet_us)
    assert mean_us == pytest.approx(np.mean(waits), abs=4 * np.std(waits) / np.sqrt(2000))
    assert max(waits) <= longest_us * 1.01


def test_the_paper_period_always_holds_its_packet_and_at_most_two():
    counts = {packets_in(0, 33_000, 14_000, phase) for phase in np.arange(0, 14_000, 10)}
    assert counts == {1, 2}


def test_the_bounds_are_where_the_probability_leaves_0_and_reaches_1():
    some_hz, all_hz = rate_bounds_hz(33_000, 14)
    assert (round(some_hz), round(all_hz)) == (424, 848)
    for rate_hz, probability in ((some_hz, 0.0), (some_hz * 1.5, 0.5), (all_hz, 1.0), (all_hz * 2, 1.0)):
        assert whole_packet_probability(33_000, 14e6 / rate_hz) == pytest.approx(probability, abs=1e-9)


def test_a_packet_that_never_fits_is_never_read():
    assert waiting_us(13_000, 14_000) == (np.inf, np.inf)
    with pytest.raises(ValueError, match="above 0"):
        whole_packet_probability(0, 14_000)
