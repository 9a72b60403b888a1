"""Lights of known kinds, seen by pixels that are not the project's camera, have their right names."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.events import Events, make_events, no_events, slice_time
from bicode_lab.lights.moving import comes_by_chance, moving_gain
from bicode_lab.lights.name import LOOK_US, SURE, name_light, name_region
from bicode_lab.lights.sample import candidate_rates_hz, onsets, take_sample, usual_run
from bicode_studies.light_kinds.lights import Light, level_of
from bicode_studies.light_kinds.plate import Sensor, see
from bicode_studies.light_kinds.trials import is_right

CLEAR = (
    Light(kind="pwm", rate_hz=400, duty=0.2),
    Light(kind="pwm", rate_hz=1000, duty=0.8),
    Light(kind="constant_frequency", rate_hz=300),
    Light(kind="constant_frequency", rate_hz=3000),
    Light(kind="interval", rate_hz=5000),
    Light(kind="bicode", rate_hz=700),
    Light(kind="bicode", rate_hz=2500),
    Light(kind="uart", rate_hz=2400),
    Light(kind="uart", rate_hz=9600),
)


def events_of(light: Light, seed: int, sensor: Sensor | None = None, length_us: float = LOOK_US) -> Events:
    rng = np.random.default_rng(seed)
    return see(level_of(light, length_us, rng), sensor or Sensor(n_pixels=4, events_per_edge=12), rng)


@pytest.mark.parametrize("light", CLEAR, ids=lambda light: f"{light.kind}_{light.rate_hz:g}")
def test_a_clear_light_has_its_name_and_its_rate(light: Light) -> None:
    names = [name_light(events_of(light, seed)) for seed in range(6)]
    assert sum(is_right(light, name) for name in names) >= 4, names
    assert all(is_right(light, name) or name.kind == "unknown" for name in names), names


@pytest.mark.parametrize("rate_hz", [100.0, 120.0])
def test_a_ripple_of_the_mains_is_no_led(rate_hz: float) -> None:
    sensor = Sensor(n_pixels=40, events_per_edge=400)
    names = [name_light(events_of(Light(kind="mains", rate_hz=rate_hz, depth=0.9), seed, sensor)) for seed in range(6)]
    assert any(name.kind == "mains" for name in names), names
    assert not {name.kind for name in names} & {"pwm", "constant_frequency"}, names
    led = name_light(events_of(Light(kind="constant_frequency", rate_hz=rate_hz), 0, sensor))
    assert led.likely == "constant_frequency"


def test_a_duty_is_told_with_its_error() -> None:
    for seed in range(5):
        name = name_light(events_of(Light(kind="pwm", rate_hz=500, duty=0.25), seed))
        assert name.duty is not None
        assert name.duty_error is not None
        assert abs(name.duty - 0.25) < 2.6 * name.duty_error < 0.25


def test_nothing_and_noise_are_no_lights() -> None:
    assert name_light(no_events()).kind == "none"
    sensor = Sensor(n_pixels=9, stray_hz=4000)
    for seed in range(5):
        events = events_of(Light(kind="noise"), seed, sensor)
        assert comes_by_chance(events)
        assert name_light(events).kind == "noise"
    assert not comes_by_chance(events_of(CLEAR[1], 0))


def test_an_edge_that_moves_is_no_light() -> None:
    rng = np.random.default_rng(0)
    x, y = rng.integers(0, 12, 300), rng.integers(0, 12, 300)
    t = 3000 * x + 500 * y + rng.normal(0, 300, 300) + 5000
    order = np.argsort(t)
    events = make_events(x[order], y[order], rng.integers(0, 2, 300)[order], t[order].astype(np.int64))
    assert name_light(events).kind == "moving_edge"
    assert moving_gain(events_of(CLEAR[1], 0)) < 20 < moving_gain(events)


def test_a_code_that_is_not_known_is_not_named() -> None:
    """Runs of 1, 2 or 5 ticks, in no order, are none of the codes."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        runs = rng.choice([1, 2, 5], 200)
        chips = np.repeat(np.arange(200) % 2, runs)
        level = chips[(np.arange(0, LOOK_US, 2.0) * 2e-3).astype(int)].astype(float)
        name = name_light(see(level, Sensor(n_pixels=4, events_per_edge=12), rng))
        assert name.kind == "unknown", name
        assert name.rate_hz is not None
        assert abs(name.rate_hz / 2000 - 1) < 0.01


def test_a_shift_in_time_and_place_changes_nothing() -> None:
    events = events_of(CLEAR[5], 1)
    moved = make_events(events["x"] + 100, events["y"] + 7, events["p"], events["t"] + 123_456_789)
    one, other = name_light(events), name_light(moved)
    assert (one.kind, one.rate_hz, one.margin) == (other.kind, other.rate_hz, other.margin)


def test_several_looks_are_surer_than_one() -> None:
    events = events_of(Light(kind="uart", rate_hz=1200), 3, length_us=400_000)
    start = int(events["t"][0])
    one = name_light(slice_time(events, start, start + LOOK_US))
    several = name_region(events)
    assert several.kind == "uart"
    assert several.margin > max(one.margin, 2 * SURE)
    assert name_region(no_events()).kind == "none"


def test_the_sample_finds_the_clock_of_a_light_and_keeps_few_events() -> None:
    events = events_of(Light(kind="uart", rate_hz=4000), 0, Sensor(n_pixels=40, events_per_edge=300))
    sample = take_sample(events)
    assert sample.on_us.size + sample.off_us.size <= 1_602
    assert 0 < sample.trust < 1
    assert any(abs(rate / 4000 - 1) < 0.002 for rate in candidate_rates_hz(sample))
    assert usual_run(events["p"]) > 20
    begins = onsets(events)
    assert 0 < begins.size < events.size / 4
    assert onsets(events_of(Light(kind="noise"), 0, Sensor(stray_hz=3000))).size == 0
