"""The table of names: its lights, its counts, and the command that writes it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bicode_lab.lights.name import LightName
from bicode_studies.cli.main import cli
from bicode_studies.light_kinds import table as tables
from bicode_studies.light_kinds.lights import Light, level_of
from bicode_studies.light_kinds.plate import SAMPLE_US, Sensor, see
from bicode_studies.light_kinds.trials import NameTrial, conditions, events_of, is_right

QUIET = Sensor(n_pixels=3, events_per_edge=30, stray_hz=0, noise=0, jitter_us=0, refractory_us=0, spread=0)


def test_lights_switch_as_often_as_they_should() -> None:
    for light, rises in (
        (Light(kind="constant_frequency", rate_hz=1000), 50),
        (Light(kind="pwm", rate_hz=400, duty=0.1), 20),
        (Light(kind="interval", rate_hz=5000), 250 / 2.5),
        (Light(kind="uart", rate_hz=4800), 240 / 4.2),
        (Light(kind="bicode", rate_hz=1000), 50 / 1.7),
    ):
        counts = []
        for seed in range(8):
            level = level_of(light, 50_000, np.random.default_rng(seed))
            assert level.size == 50_000 / SAMPLE_US
            counts.append(np.count_nonzero(np.diff(level) > 0))
        assert abs(np.mean(counts) / rises - 1) < 0.2, (light, counts)
    ripple = level_of(Light(kind="mains", rate_hz=100, depth=0.6), 50_000, np.random.default_rng(0))
    assert ripple.min() == pytest.approx(0.4, abs=0.01)
    assert ripple.max() == pytest.approx(1.0, abs=0.01)


def test_pixels_make_on_events_after_rises_and_as_many_as_wanted() -> None:
    level = np.zeros(10_000)
    level[2_000:6_000] = 1
    events = see(level, QUIET, np.random.default_rng(0))
    rise_us, fall_us = 2_000 * SAMPLE_US, 6_000 * SAMPLE_US
    on, off = events["t"][events["p"] == 1], events["t"][events["p"] == 0]
    assert (on >= rise_us + QUIET.latency_on_us).all()
    assert (on < rise_us + 500).all()
    assert (off >= fall_us + QUIET.latency_off_us).all()
    assert abs(on.size - 30) <= 8
    assert (np.diff(events["t"]) >= 0).all()


def test_every_condition_has_its_own_events_and_repeats() -> None:
    listed = conditions()
    assert len(set(listed)) == len(listed)
    assert {each.light.kind for each in listed} == {
        "noise", "mains", "pwm", "constant_frequency", "interval", "bicode", "uart",
    }  # fmt: skip
    trial = NameTrial(light=Light(kind="uart", rate_hz=2400), events_per_edge=3)
    np.testing.assert_array_equal(events_of(trial, 1), events_of(trial, 1))
    assert events_of(trial, 1).size != events_of(trial, 2).size


@pytest.mark.parametrize(
    ("light", "name", "right"),
    [
        (Light(kind="noise"), LightName(kind="none", margin=0), True),
        (Light(kind="noise"), LightName(kind="pwm", margin=9, rate_hz=100), False),
        (Light(kind="uart", rate_hz=1000), LightName(kind="uart", margin=9, rate_hz=1019), True),
        (Light(kind="uart", rate_hz=1000), LightName(kind="uart", margin=9, rate_hz=1021), False),
        (Light(kind="uart", rate_hz=1000), LightName(kind="unknown", likely="uart", margin=1, rate_hz=1000), False),
        (
            Light(kind="pwm", rate_hz=1000, duty=0.4),
            LightName(kind="constant_frequency", margin=9, rate_hz=1000, duty=0.5, duty_error=0.05),
            True,
        ),
        (
            Light(kind="pwm", rate_hz=1000, duty=0.3),
            LightName(kind="constant_frequency", margin=9, rate_hz=1000, duty=0.5, duty_error=0.05),
            False,
        ),
    ],
)
def test_what_counts_as_right(light: Light, name: LightName, right: bool) -> None:
    assert is_right(light, name) is right


def test_the_command_writes_both_tables(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    few = [
        NameTrial(light=Light(kind="constant_frequency", rate_hz=1000), events_per_edge=10),
        NameTrial(light=Light(kind="noise"), events_per_edge=1),
    ]
    monkeypatch.setattr(tables, "conditions", lambda: few)
    words = [
        "name-lights",
        "--seeds",
        "2",
        "--jobs",
        "1",
        "--out",
        str(tmp_path),
        "--store",
        str(tmp_path / "s.sqlite"),
    ]
    with cli.make_context("bicode", words) as context:
        cli.invoke(context)
    rows, counted = (pd.read_csv(tmp_path / name) for name in (tables.TABLE, tables.CONFUSION))
    assert len(rows) == 4
    assert counted["lights"].tolist() == [2, 2]
    assert counted["right"].tolist() == rows.groupby("kind", sort=False)["right"].mean().tolist()
    assert (counted["right_low"] < counted["right"]).all()
    assert counted["wrong"].tolist() == [0, 0]
