"""A sound recording has no complaint, and each defect is named by its own line."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bicode_lab.events import Events, make_events
from bicode_lab.marker import PacketFormat
from bicode_studies.inspect.health import Finding, examine
from bicode_studies.inspect.measures import measure
from bicode_studies.inspect.time_unit import remark_on_times
from tests.studies.inspect.lights import HEIGHT, WIDTH, blinking, noise, ordered, together

SOUND = together(blinking(seconds=0.5), noise(20_000, 0.5))


def found(events: Events, **dropped: int) -> dict[str, Finding]:
    """Return the findings by name, from chunks of uneven length."""
    cuts = np.sort(np.random.default_rng(3).integers(0, events.size, 7))
    return {one.name: one for one in examine(np.split(events, cuts), WIDTH, HEIGHT, dropped)}


def complaints(events: Events) -> set[str]:
    """Return the names of the findings that are not ok."""
    return {name for name, one in found(events).items() if one.state != "ok"}


def times_of(events: Events, change: Callable[[np.ndarray], np.ndarray]) -> Events:
    """Return events with other times."""
    changed = events.copy()
    changed["t"] = change(events["t"])
    return changed


def test_a_sound_recording_has_no_complaint() -> None:
    assert complaints(SOUND) == set()
    words = found(SOUND)["blinking"].words
    assert "8 x 8 px at (100, 60)" in words
    assert abs(int(words.split("rises about every ")[1].split()[0]) / 1000 - 1) < 0.03
    assert f"{SOUND.size:,} events in 0.500 s" in found(SOUND)["times"].words


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: t * 1000, "are they in nanoseconds?"),
        (lambda t: t // 1000, "are they in milliseconds or seconds?"),
        (lambda t: t // 1_000_000, "are they in milliseconds or seconds?"),
        (lambda t: t + 5_000_000 * (t > 250_000), "but none for 5.0 s from 0.250 s on"),
        (lambda t: t // 500 * 500, "times in steps of 500 us"),
    ],
)
def test_times_that_are_odd_are_told(change: Callable[[np.ndarray], np.ndarray], said: str) -> None:
    one = found(times_of(SOUND, change))["times"]
    assert one.state != "ok"
    assert said in one.line()


def test_microseconds_are_left_alone() -> None:
    for events in (SOUND, noise(5000, 5.0), blinking(side_px=2)):
        step = int(np.gcd.reduce(events["t"] - events["t"][0]))
        assert remark_on_times(events.size, int(events["t"][-1] - events["t"][0]), step) is None


def test_one_polarity_is_too_little_and_too_much_is_told() -> None:
    on = SOUND[SOUND["p"] == 1]
    assert found(on)["balance"].state == "bad"
    off = SOUND[SOUND["p"] == 0]
    assert found(together(on, off[::2]))["balance"].state == "ok"
    uneven = together(on, off[::5])
    assert "make the ON threshold less sensitive (bias_diff_on)" in found(uneven)["balance"].advice
    assert "bias_diff_off" in found(together(on[::5], off))["balance"].advice


def test_hot_pixels_are_counted_and_the_busiest_is_named() -> None:
    n = 30_000
    hot = ordered(np.full(n, 7), np.full(n, 9), np.arange(n) % 2, np.linspace(0, 499_000, n))
    few = ordered(np.full(50, 200), np.full(50, 100), np.arange(50) % 2, np.linspace(0, 499_000, 50))
    one = found(together(SOUND, hot, few))["hot pixels"]
    assert one.state == "look"
    assert one.words.startswith("2 with ")
    assert "the busiest at (7, 9) with 59,999 events/s" in one.words
    assert found(together(SOUND, few))["hot pixels"].state == "ok"  # some are usual
    assert not len(measure([SOUND], WIDTH, HEIGHT).hot_pixels())


def test_a_row_that_the_readout_fills_is_named() -> None:
    n = 20 * WIDTH
    row = ordered(
        np.arange(n) % WIDTH, np.full(n, 200), np.arange(n) % 2, np.repeat(np.linspace(1000, 400_000, 20), WIDTH)
    )
    one = found(together(SOUND, row))["rows"]
    assert (one.state, one.words) == ("look", "far more events than around in row 200")
    assert found(SOUND)["rows"].state == "ok"


def test_gaps_in_busy_time_are_holes_and_those_of_a_light_are_not() -> None:
    busy = noise(1_000_000, 0.5)
    assert "holes" not in complaints(busy)
    t = busy["t"]
    torn = busy[(t % 100_000 < 40_000) | (t % 100_000 > 41_500)]
    one = found(torn)["holes"]
    assert one.state == "bad"
    assert one.words.startswith("5 gaps in busy time, 7.5 ms in all, the longest of 1.5")
    assert found(blinking(side_px=40, seconds=0.3))["holes"].state == "ok"


@pytest.mark.parametrize("hz", [100, 120, 90])
def test_the_flicker_of_a_lamp_is_told(hz: int) -> None:
    rng = np.random.default_rng(5)
    n = 40_000
    t = rng.uniform(0, 500_000, 3 * n)
    phase = np.sin(2 * np.pi * hz * t * 1e-6)
    polarity = (phase > 0).astype(int)
    kept = rng.uniform(0, 1, t.size) < np.abs(phase)
    lamp = ordered(rng.integers(0, WIDTH, t.size)[kept], rng.integers(0, HEIGHT, t.size)[kept], polarity[kept], t[kept])
    one = found(together(SOUND, lamp))["flicker"]
    assert (one.state == "look") == (hz != 90)
    assert hz == 90 or f"{hz} Hz" in one.words
    assert "too short" in found(SOUND[SOUND["t"] < 150_000])["flicker"].words


def test_a_readout_at_its_limit_is_told() -> None:
    rng = np.random.default_rng(2)
    n = 25_000 * 60
    t = np.sort(rng.integers(0, 60_000, n))
    full = make_events(rng.integers(0, WIDTH, n), rng.integers(0, HEIGHT, n), rng.integers(0, 2, n), t)
    assert found(full)["rate"].state == "bad"
    assert "25 million events/s on average" in found(full)["rate"].words
    assert found(SOUND)["rate"].state == "ok"


@pytest.mark.parametrize(
    ("events", "state", "said"),
    [
        (blinking(spread_us=150), "bad", "raise the bandwidth (bias_fo)"),
        (blinking(spread_us=30), "ok", ""),
        (noise(), "look", "nothing blinks"),
        (blinking(PacketFormat(f_id_hz=150), seconds=1.5), "look", "a slow light"),
    ],
)
def test_whether_biases_suit_1_khz(events: Events, state: str, said: str) -> None:
    one = found(together(events, noise()))["blinking"]
    assert one.state == state
    assert said in one.line()


def test_many_and_few_events_for_each_edge_are_told() -> None:
    light = blinking(spread_us=40)
    many = together(*(times_of(light, lambda t, k=k: t + 7 * k) for k in range(8)))
    assert "lengthen bias_refr" in found(many)["blinking"].advice or "less sensitive" in found(many)["blinking"].advice
    few = light[np.random.default_rng(0).uniform(size=light.size) < 0.3]
    assert "more sensitive" in found(few)["blinking"].advice


def test_what_a_lenient_reading_drops_is_told() -> None:
    one = found(SOUND, **{"steps back in time": 3})["file"]
    assert one.state == "bad"
    assert "3 steps back in time" in one.words
    assert "file" not in found(SOUND)


def test_measures_do_not_depend_on_the_chunks() -> None:
    whole = measure([SOUND], WIDTH, HEIGHT)
    parts = measure(np.array_split(SOUND, 11), WIDTH, HEIGHT)
    busy = noise(1_000_000, 0.2)
    torn = busy[(busy["t"] % 20_000 < 4_000) | (busy["t"] % 20_000 > 4_500)]
    cuts = np.flatnonzero(np.diff(torn["t"]) > 200) + 1  # chunks that end at the gaps
    gaps = [measure(chunks, WIDTH, HEIGHT).holes for chunks in ([torn], np.split(torn, cuts), np.array_split(torn, 99))]
    assert len(gaps[0]) == 10
    assert gaps[0] == gaps[1] == gaps[2]
    for name in ("on", "off", "per_pixel"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(parts, name))
    for name in ("n_events", "n_on", "first_us", "last_us", "step_us", "holes", "longest_gap"):
        assert getattr(whole, name) == getattr(parts, name)
    assert whole.on.sum() == whole.n_on == np.count_nonzero(SOUND["p"] == 1)
    assert whole.per_pixel.sum() == SOUND.size
