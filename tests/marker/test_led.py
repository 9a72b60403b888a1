"""Tests of the LED: two ways to ask for its state agree, and its luminance is as in the paper."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.marker import LedWaveform, Marker, PacketFormat, encode_packet, luminance_ratio
from bicode_lab.marker.board import Board
from bicode_lab.marker.led import RISE_STEPS

waves = st.builds(
    LedWaveform,
    payload=st.integers(0, 255),
    packet_format=st.builds(
        PacketFormat,
        f_id_hz=st.sampled_from([100.0, 1000.0, 3000.0, 7777.0]),
        manchester=st.sampled_from(["ieee", "thomas"]),
        checksum=st.sampled_from(["sum", "crc3"]),
    ),
    phase_us=st.floats(-1e5, 1e5),
    clock_error_ppm=st.floats(-1e4, 1e4),
)


def level_of(steps, t_us):
    """Return the light's level at some moments from a list of steps."""
    times, levels = steps
    return levels[np.searchsorted(times, t_us, side="right") - 1]


@given(waves, st.floats(-1e6, 1e6), st.floats(1, 5e4), st.integers(0, 2**32 - 1))
def test_steps_tell_the_same_as_state(wave, start, length, seed):
    times, levels = steps = wave.steps(start, start + length)
    assert times[0] == start
    assert (np.diff(times) > 0).all()
    assert times[-1] < start + length
    assert set(levels) <= {0.0, 1.0}
    assert (np.diff(levels) != 0).all()  # a step is a change
    t = start + np.random.default_rng(seed).random(300) * length
    # On an edge itself both may round either way: leave out a nanosecond around each.
    apart = np.abs((t - wave.phase_us) / wave.chip_us % 1 * wave.chip_us)
    t = t[(apart > 1e-3) & (apart < wave.chip_us - 1e-3)]
    np.testing.assert_array_equal(level_of(steps, t), wave.state(t))


@given(waves, st.integers(-50, 50), st.integers(0, 2**32 - 1))
def test_the_light_repeats_every_packet(wave, packets, seed):
    t = wave.phase_us + (np.random.default_rng(seed).integers(0, 500, 50) + 0.5) * wave.chip_us
    np.testing.assert_array_equal(wave.state(t), wave.state(t + packets * wave.packet_us))


@given(waves)
def test_the_state_over_a_packet_is_its_chips(wave):
    chips = encode_packet(wave.payload, wave.packet_format)
    middles = wave.phase_us + (np.arange(chips.size) + 0.5) * wave.chip_us
    np.testing.assert_array_equal(wave.state(middles), chips)


@given(waves, st.floats(-1e6, 1e6), st.floats(1, 1e6))
def test_packet_starts_are_all_those_inside(wave, start, length):
    end = start + length
    starts = wave.packet_starts(start, end)
    number = (starts - wave.phase_us) / wave.packet_us
    np.testing.assert_allclose(number, np.round(number), atol=1e-6)
    assert abs(starts.size - length / wave.packet_us) <= 1
    if starts.size:
        assert (np.diff(starts) > 0).all()
        slack = 1e-6 * wave.packet_us
        assert start - slack <= starts[0] < start + wave.packet_us + slack
        assert end - wave.packet_us - slack <= starts[-1] < end + slack


@given(waves, st.floats(-1e6, 1e6))
def test_a_clock_error_is_a_share_of_time(wave, ppm):
    ppm = ppm / 2  # -500000 .. 500000
    exact = LedWaveform(payload=wave.payload, packet_format=wave.packet_format)
    fast = LedWaveform(payload=wave.payload, packet_format=wave.packet_format, clock_error_ppm=ppm)
    # One second of the transmitter takes 1 / (1 + error) of true time.
    assert fast.packet_us * (1 + ppm * 1e-6) == pytest.approx(exact.packet_us, rel=1e-12)


@given(
    st.integers(0, 255),
    st.floats(0.5, 249),
    st.floats(0, 14_000),
    st.integers(0, 2**32 - 1),
    st.floats(-400_000, 400_000),
)
def test_a_slow_edge_is_a_first_order_step_of_the_right_length(payload, rise_us, phase_us, seed, ppm):
    wave = LedWaveform(payload=payload, phase_us=phase_us, rise_time_us=rise_us, clock_error_ppm=ppm)
    sharp = LedWaveform(payload=payload, phase_us=phase_us, clock_error_ppm=ppm)
    start, end = 20_000.0, 60_000.0
    steps = wave.steps(start, end)
    assert (np.diff(steps[0]) > 0).all()
    assert (steps[1] >= 0).all()
    assert (steps[1] <= 1).all()
    # An oracle: 1 - exp(-t / tau) from the last sharp edge on, tau from "10-90 % rise time".
    edges, levels = sharp.steps(start - sharp.packet_us, end)
    t = start + np.random.default_rng(seed).random(400) * (end - start)
    last = np.searchsorted(edges, t, side="right") - 1
    tau = rise_us / (np.log(0.9) - np.log(0.1))
    risen = 1 - np.exp(-(t - edges[last]) / tau)
    expected = np.where(levels[last] > 0, risen, 1 - risen)
    # Drawn as RISE_STEPS equal steps, each taken where half of it is reached.
    assert np.abs(level_of(steps, t) - expected).max() <= 0.5 / RISE_STEPS + 1e-6


@given(waves, st.floats(-1e5, 1e5), st.floats(0.1, 0.9))
def test_two_spans_are_one_span_cut(wave, start, share):
    end = start + 20_000
    middle = start + share * 20_000
    t = start + (np.arange(1000) + 0.5) * 20
    whole = level_of(wave.steps(start, end), t)
    halves = np.where(
        t < middle,
        level_of(wave.steps(start, middle), np.minimum(t, np.nextafter(middle, start))),
        level_of(wave.steps(middle, end), np.maximum(t, middle)),
    )
    # The two may differ only where a moment falls on an edge to the last bits.
    assert np.count_nonzero(whole != halves) <= 1


# -- brightness (IV-A, IV-C)


def test_the_three_plates_of_the_paper_are_equally_bright():
    # 2.7, 10.7, 40.9 mA on 2.5, 5, 10 cm: 0.432, 0.428, 0.409 mA/cm2.
    per_area = np.array([2.7 / 2.5**2, 10.7 / 5**2, 40.9 / 10**2])
    ratios = [luminance_ratio(i, s) for i, s in [(2.7, 0.025), (10.7, 0.05), (40.9, 0.1)]]
    np.testing.assert_allclose(ratios, per_area / per_area[1])
    np.testing.assert_allclose(ratios, 1, atol=0.05)
    assert ratios[1] == 1.0


@given(st.floats(0, 100), st.floats(0.001, 1), st.floats(0.1, 10))
def test_luminance_goes_as_current_over_area(current_ma, size_m, factor):
    one = luminance_ratio(current_ma, size_m)
    assert luminance_ratio(current_ma * factor, size_m) == pytest.approx(one * factor)
    assert luminance_ratio(current_ma, size_m * factor) == pytest.approx(one / factor**2)


def test_a_marker_hands_its_settings_on():
    marker = Marker(
        payload=0xA5, current_ma=21.4, board=Board(size_m=0.1), phase_us=7.0, clock_error_ppm=300.0, rise_time_us=5.0
    )
    wave = marker.waveform
    assert (wave.payload, wave.phase_us, wave.clock_error_ppm, wave.rise_time_us) == (0xA5, 7.0, 300.0, 5.0)
    assert marker.luminance_ratio == pytest.approx(2 / 4)


# -- misuse


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: LedWaveform(payload=300), ["payload=300", "0 .. 255"]),
        (lambda: LedWaveform(payload=1, clock_error_ppm=600_000), ["clock_error_ppm=600000", "-500000 .. 500000"]),
        (lambda: LedWaveform(payload=1, rise_time_us=250.0), ["rise_time_us=250.0", "0 .. 250", "f_id_hz=1000"]),
        (lambda: LedWaveform(payload=1, rise_time_us=-1.0), ["rise_time_us=-1.0"]),
        (lambda: luminance_ratio(-1.0, 0.05), ["current_ma=-1.0", "0 or more"]),
        (lambda: luminance_ratio(1.0, 0.0), ["size_m=0.0", "more than 0"]),
        (lambda: Marker(current_ma=-1.0), ["current_ma=-1.0", "0 or more"]),
        (lambda: Marker(payload=256), ["payload=256", "0 .. 255"]),
        (lambda: Marker(band="uv"), ["'uv'", "'visible' or 'infrared'"]),
    ],
)
def test_settings_that_cannot_be_are_refused(make, words):
    with pytest.raises(ValueError) as refused:
        make()
    assert all(word in str(refused.value) for word in words), refused.value
