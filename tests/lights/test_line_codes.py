"""The interval code and lights of one frequency: what is sent is read, and what is not sent is refused."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.events import Events, no_events
from bicode_lab.lights.interval_line import IntervalLine
from bicode_lab.lights.readers import OTHER_LIGHT, TOO_FEW, read_frequency, read_interval, stretches
from bicode_lab.lights.waveform import ChipWaveform, constant_frequency, text_waveform
from bicode_lab.soft_receiver.line_code import UartLine
from bicode_studies.light_kinds.plate import SAMPLE_US, Sensor, see

LOOK_US = 50_000


def seen(waveform: ChipWaveform, seed: int, length_us: float = LOOK_US) -> Events:
    times, levels = waveform.steps(0, length_us)
    level = levels[np.searchsorted(times, np.arange(0, length_us, SAMPLE_US), side="right") - 1]
    return see(level, Sensor(n_pixels=4, events_per_edge=12), np.random.default_rng(seed))


@pytest.mark.parametrize("bits", [1, 8, 12])
def test_every_number_is_what_its_gaps_say(bits: int) -> None:
    line = IntervalLine(bits=bits)
    for value in range(0, 2**bits, max(1, 2**bits // 256)):
        chips = np.tile(line.encode(value), 2)
        rises = np.flatnonzero(np.diff(np.concatenate([[0], chips])) == 1)
        gaps = np.diff(rises).tolist()[: bits + 1]
        assert gaps == line.gaps(value)
        assert line.decode(gaps) == value
    assert line.decode([3] * (bits + 1)) is None
    assert line.decode([4] * (bits + 1)) is None
    assert line.decode([4]) is None


@pytest.mark.parametrize(("call", "word"), [
    (lambda: IntervalLine(rate_hz=0), "rate_hz=0"),
    (lambda: IntervalLine(bits=17), "bits=17"),
    (lambda: IntervalLine().encode(256), "value=256"),
    (lambda: ChipWaveform(chips=[1, 1], chip_us=5), "never switches"),
    (lambda: ChipWaveform(chips=[1, 0], chip_us=0), "chip_us=0"),
    (lambda: ChipWaveform(chips=[1, 0], chip_us=1, clock_error_ppm=1e6), "clock_error_ppm"),
    (lambda: constant_frequency(0), "rate_hz=0"),
    (lambda: text_waveform("", UartLine(rate_hz=300)), "one letter"),
])  # fmt: skip
def test_what_cannot_be_sent_is_refused(call, word: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match=word):
        call()


@pytest.mark.parametrize("start_us", [0.0, 137.0, 999.5])
def test_the_steps_of_a_waveform_are_its_levels(start_us: float) -> None:
    wave = ChipWaveform(chips=[1, 0, 0, 1, 1, 0], chip_us=70, phase_us=33, clock_error_ppm=400)
    times, levels = wave.steps(start_us, start_us + 1000)
    assert times[0] == start_us
    assert (np.diff(times) > 0).all()
    assert (np.diff(levels) != 0).all()
    moments = np.arange(start_us, start_us + 1000, 3.7)
    chip_us = 70 / 1.0004
    wanted = np.array(wave.chips)[np.floor((moments - 33) / chip_us).astype(int) % 6]
    np.testing.assert_array_equal(levels[np.searchsorted(times, moments, side="right") - 1], wanted)


@pytest.mark.parametrize("rate_hz", [1000.0, 5000.0])
def test_numbers_of_the_interval_code_are_read(rate_hz: float) -> None:
    line = IntervalLine(rate_hz=rate_hz)
    for seed, value in enumerate((0, 37, 170, 255)):
        wave = ChipWaveform(chips=line.encode(value), chip_us=line.chip_us, phase_us=311.0 * seed, clock_error_ppm=250)
        events = seen(wave, seed)
        for reading in (read_interval(events), read_interval(events, line)):
            assert reading.value == value, reading
            assert reading.rate_hz is not None
            assert abs(reading.rate_hz / rate_hz - 1) < 1e-3


def test_frequencies_are_read_and_told_apart() -> None:
    for rate_hz in (430.0, 437.0, 2000.0):
        reading = read_frequency(seen(constant_frequency(rate_hz), 1))
        assert reading.reason is None
        assert reading.rate_hz is not None
        assert abs(reading.rate_hz - rate_hz) < 1


def test_a_light_of_another_kind_is_not_read() -> None:
    text = seen(text_waveform("Hello, world! ", UartLine(rate_hz=4800)), 0)
    word = seen(ChipWaveform(chips=IntervalLine().encode(37), chip_us=200), 0)
    steady = seen(constant_frequency(700), 0)
    for reading in (read_interval(text), read_interval(steady), read_frequency(text), read_frequency(word)):
        assert reading.reason == OTHER_LIGHT
        assert reading.value is None
    assert read_interval(no_events()).reason == read_frequency(no_events()).reason == TOO_FEW


def test_stretches_hold_all_events_but_a_short_rest() -> None:
    events = seen(constant_frequency(700), 0, 220_000)
    parts = list(stretches(events))
    assert len(parts) == 4
    np.testing.assert_array_equal(np.concatenate(parts)["t"], events["t"][: sum(part.size for part in parts)])
    assert list(stretches(no_events())) == []
