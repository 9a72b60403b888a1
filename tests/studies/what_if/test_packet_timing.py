"""The paper's arithmetic of packets in periods, against one packet after the other."""

import numpy as np
import pytest

from bicode_studies.what_if.packet_timing import rate_bounds_hz, waiting_us, whole_packet_chance

LENGTHS = [(33_000, 14_000), (21_000, 14_000), (17_000, 14_000), (28_000, 14_000), (60_000, 7_000), (15_100, 14_000)]


def packets_in(period_start_us, delta_t_whole_us, packet_us, phase_us):
    """How many packets lie whole in a period: counted one by one."""
    starts = phase_us + packet_us * np.arange(-2, 400)
    return np.sum((starts >= period_start_us) & (starts + packet_us <= period_start_us + delta_t_whole_us))


@pytest.mark.parametrize(("whole_us", "packet_us"), LENGTHS)
def test_the_chance_is_that_of_counting(whole_us, packet_us):
    phases = (np.arange(5000) + 0.5) / 5000 * packet_us
    share = np.mean([packets_in(0, whole_us, packet_us, phase) > 0 for phase in phases])
    assert whole_packet_chance(whole_us, packet_us) == pytest.approx(share, abs=1 / 5000)


@pytest.mark.parametrize(("whole_us", "packet_us"), LENGTHS)
def test_waiting_is_that_of_playing_it_through(whole_us, packet_us):
    rng = np.random.default_rng(0)
    waits = []
    for _ in range(2000):
        seen_us, phase_us = rng.uniform(0, whole_us), rng.uniform(0, packet_us)
        starts = phase_us + packet_us * np.arange(0, 400)
        starts = starts[starts >= seen_us]
        inside = starts // whole_us == np.ceil((starts + packet_us) / whole_us) - 1
        waits.append((starts[inside][0] // whole_us + 1) * whole_us - seen_us)
    mean_us, longest_us = waiting_us(whole_us, packet_us)
    assert mean_us == pytest.approx(np.mean(waits), abs=4 * np.std(waits) / np.sqrt(2000))
    assert max(waits) <= longest_us * 1.01


def test_the_paper_period_always_holds_its_packet_and_at_most_two():
    counts = {packets_in(0, 33_000, 14_000, phase) for phase in np.arange(0, 14_000, 10)}
    assert counts == {1, 2}


def test_the_bounds_are_where_the_chance_leaves_0_and_reaches_1():
    ever_hz, surely_hz = rate_bounds_hz(33_000, 14)
    assert (round(ever_hz), round(surely_hz)) == (424, 848)
    for rate_hz, chance in ((ever_hz, 0.0), (ever_hz * 1.5, 0.5), (surely_hz, 1.0), (surely_hz * 2, 1.0)):
        assert whole_packet_chance(33_000, 14e6 / rate_hz) == pytest.approx(chance, abs=1e-9)


def test_what_never_fits_is_never_known():
    assert waiting_us(13_000, 14_000) == (np.inf, np.inf)
    with pytest.raises(ValueError, match="above 0"):
        whole_packet_chance(0, 14_000)
