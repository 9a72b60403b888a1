"""Evidence beyond Fig. 8: arithmetic by hand, signs, and a blink curve of the model's own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bicode_studies.calibration import evidence
from bicode_studies.calibration.candidates import Candidate
from bicode_studies.calibration.evidence import (
    blink_misfit,
    either,
    implied_time_constant,
    latency_misfit,
    measured,
    quiet_misfit,
    quiet_rate_hz,
    read_measured,
    refractory_misfit,
    shape_difference,
)

PLAIN = Candidate(
    led_to_ambient=1.0, blur_px=0.8, halo_fraction=0.03, time_constant_us=250.0, threshold=0.25,
    threshold_spread=0.03, noise=0.03, refractory_us=100.0, aruco_id=5, min_region_pixels=12, opening_px=3,
)  # fmt: skip


def test_every_fact_has_a_source_and_is_read() -> None:
    table = read_measured()
    assert (table["source"].str.len() > 5).all()
    assert not table.duplicated(["quantity", "at"]).any()
    code = evidence.__loader__.get_source(evidence.__name__)  # type: ignore[union-attr]
    assert [name for name in table["quantity"].unique() if name not in code] == []
    with pytest.raises(ValueError, match="not enough values"):
        measured("unknown")


def test_latencies_imply_a_time_constant_between_those_of_dark_and_bright_walls() -> None:
    middle_us, spread = implied_time_constant()
    ends = [
        np.sqrt(3.66 * 4.14) / (350 / 325 * reflectance * 0.9 / (4 * 5.6**2)) for reflectance in (0.5, 0.2)
    ]  # fmt: skip
    assert middle_us == pytest.approx(np.sqrt(ends[0] * ends[1]))
    assert spread == pytest.approx(np.hypot(np.log(ends[1] / ends[0]) / 2, np.hypot(0.07, np.log(4.14 / 3.66) / 2)))
    assert 900 < ends[0] < ends[1] < 2600


def test_a_shorter_time_constant_counts_negative_deviations() -> None:
    middle_us, spread = implied_time_constant()
    assert latency_misfit(replace(PLAIN, time_constant_us=middle_us * np.exp(-2 * spread))) == pytest.approx(-2)
    assert latency_misfit(replace(PLAIN, time_constant_us=middle_us * np.exp(1 * spread))) == pytest.approx(1)


def test_two_readings_saturate_at_the_odds() -> None:
    assert either(0) == 0
    assert either(-2.0) == either(2.0) == pytest.approx(-2 * np.log((1 + np.exp(-2)) / 2))
    assert either(40) == pytest.approx(2 * np.log(2))


def test_the_quiet_rate_is_rices_averaged_over_pixels() -> None:
    even = replace(PLAIN, threshold_spread=1e-9, noise=0.05, time_constant_us=1e6 / (2 * np.pi * 1000))
    assert quiet_rate_hz(even) == pytest.approx(2000 * np.exp(-12.5), rel=1e-6)
    spread = replace(even, threshold_spread=0.03)
    drawn = np.random.default_rng(0).normal(0.25, 0.03, 2_000_000)
    rates = 2000 * np.exp(-(drawn**2) / (2 * 0.05**2))
    assert quiet_rate_hz(spread) == pytest.approx(rates.mean(), rel=4 * rates.std() / rates.mean() / np.sqrt(2e6))


def test_more_events_than_a_quiet_recording_are_a_misfit_and_fewer_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evidence, "quiet_rate_hz", lambda candidate: candidate.noise)
    assert quiet_misfit(replace(PLAIN, noise=0.003 * 9)) == pytest.approx(2)
    assert quiet_misfit(replace(PLAIN, noise=0.003 / 9)) == 0
    assert quiet_misfit(replace(PLAIN, noise=0.0)) == 0


@pytest.mark.parametrize(("refractory_us", "z"), [(100, 0), (150, 0), (150 * 1.2**2, 2)])
def test_a_refractory_period_is_bounded_from_above(refractory_us: float, z: float) -> None:
    assert refractory_misfit(replace(PLAIN, refractory_us=refractory_us)) == pytest.approx(z, abs=1e-9)


def test_shapes_differ_by_the_spread_of_their_ratio() -> None:
    theirs = np.array([100.0, 10.0, 1.0])
    assert shape_difference(7 * theirs, theirs) == pytest.approx(0)
    assert shape_difference(theirs * [2, 1, 0.5], theirs) == pytest.approx(np.log(2) * np.sqrt(2 / 3))
    assert shape_difference(np.array([5.0, 0.5]), np.array([5.0, 0.1])) == pytest.approx(0)


def test_a_curve_that_the_model_made_is_no_misfit_and_another_pixel_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    curve = {250: 974.0, 1250: 261.0, 5000: 49.0}
    scene = {"contrast": 30.0, "dark_us": 1000.0}

    def events(beacon: evidence.Beacon, hz: float, pixels: evidence.PixelModel) -> float:
        contrast = beacon.brightness / (beacon.illuminance_lux / 350)
        dark_us = pixels.time_constant_us / (beacon.illuminance_lux / 350 * (5.6 / 1.6) ** 2)
        off = np.log(contrast / scene["contrast"]) ** 2 + np.log(dark_us / scene["dark_us"]) ** 2
        return float(3 * curve[int(hz)] * np.exp((off + 10 * (pixels.refractory_us - 100) ** 2) * hz / 5000))

    table = pd.DataFrame(
        {"quantity": "events_per_blink", "at": [str(hz) for hz in curve], "value": list(curve.values())}
    )
    factor = pd.DataFrame({"quantity": ["blink_factor"], "at": [""], "value": [1.4]})
    monkeypatch.setattr(evidence, "read_measured", lambda: pd.concat([table, factor]))
    monkeypatch.setattr(evidence, "events_per_blink", events)
    assert blink_misfit(PLAIN) == pytest.approx(0, abs=1e-9)
    spread = np.std([10 * hz / 5000 for hz in curve])
    assert blink_misfit(replace(PLAIN, refractory_us=101.0)) == pytest.approx(spread / np.log(1.4))


def test_the_camera_is_the_candidates(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    monkeypatch.setattr(evidence, "events_per_blink", lambda beacon, hz, pixels: seen.append(pixels) or 1.0)
    blink_misfit(PLAIN)
    (model,) = set(seen)
    assert (model.threshold_on, model.threshold_off, model.threshold_spread) == (0.25, 0.25, 0.03)
    assert (model.noise, model.refractory_us, model.time_constant_us) == (0.03, 100.0, 250.0)
