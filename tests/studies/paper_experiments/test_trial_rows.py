"""One trial: its rows have every field, and it depends on nothing but its condition and seed."""

from __future__ import annotations

from dataclasses import asdict, replace
from functools import partial

import numpy as np
import pytest

from bicode_lab.camera import PlacedMarker, Pose, Still, record
from bicode_lab.events import merge, slice_time
from bicode_lab.recognition import Receiver
from bicode_studies.paper_experiments import trial_rows
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.grids import FIGURES, conditions
from bicode_studies.paper_experiments.scenes import motion_duration_s, scene_of
from bicode_studies.paper_experiments.trial_rows import BOTH_FRAMES, Marker2dSettings, run_trial
from bicode_studies.trial import PERIOD_S

CHEAP = {  # a condition of each figure that takes no second
    "08": {"distance_m": 10.0, "current_ma": 10.7},
    "09": {"distance_m": 10.0, "yaw_deg": 80.0},
    "10": {"distance_m": 2.5, "size_m": 0.025},
    "11": {"distance_m": 1.0, "band": "red"},
    "12": {"distance_m": 10.0, "speed_m_per_s": 0.105},
    "14": {"distance_m": 2.5, "rpm": 16.0},
}
ROW = {"seed", "periods", "events", "lost", "mev_per_s", "corner_px", "wrong_ids", "receiver", "frame_rule_2d",
       "id_right", "marker_2d_right"}  # fmt: skip


def cheap(figure: str, periods: int = 3) -> Condition:
    matching = [c for c in conditions(figure) if CHEAP[figure].items() <= asdict(c).items()]
    return replace(matching[0], duration_s=periods * PERIOD_S)


@pytest.fixture(scope="module")
def rows() -> dict[str, list[dict[str, object]]]:
    """A cheap trial of each figure."""
    return {figure: run_trial(cheap(figure), seed=1) for figure in FIGURES}


@pytest.mark.parametrize("figure", FIGURES)
def test_a_trial_s_rows_have_every_field(figure: str, rows: dict[str, list[dict[str, object]]]) -> None:
    condition = cheap(figure)
    kinds = [(row["receiver"], row["frame_rule_2d"]) for row in rows[figure]]
    assert kinds == [("ours", "any")] + ([("ours", "count"), ("authors", "any")] if figure in BOTH_FRAMES else [])
    for row in rows[figure]:
        assert set(row) == ROW | set(asdict(condition))
        assert {name: row[name] for name in asdict(condition)} == asdict(condition)
        assert row["seed"] == 1
        assert row["periods"] == 3
        assert 0 <= row["id_right"] <= 3  # type: ignore[operator]
        assert 0 <= row["marker_2d_right"] <= 3  # type: ignore[operator]
        assert row["mev_per_s"] == pytest.approx(row["events"] / condition.duration_s / 1e6, rel=1e-3, abs=1e-6)  # type: ignore[operator]


@pytest.mark.parametrize("figure", BOTH_FRAMES)
def test_one_recording_serves_all_receivers(figure: str, rows: dict[str, list[dict[str, object]]]) -> None:
    ours, graded, authors = rows[figure]
    assert ours["events"] == graded["events"] == authors["events"]
    assert graded["id_right"] == ours["id_right"]
    assert authors["id_right"] <= ours["id_right"]  # type: ignore[operator]
    assert authors["marker_2d_right"] <= ours["marker_2d_right"]  # type: ignore[operator]


def test_nothing_is_lost_without_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trial_rows, "periods_lost", lambda *_: 10**6)
    ours, _, authors = run_trial(cheap("08"), seed=0)
    assert ours["id_right"] == 3
    assert authors["id_right"] == ours["id_right"]
    assert authors["marker_2d_right"] == ours["marker_2d_right"]


@pytest.mark.parametrize("figure", ["12", "14"])
@pytest.mark.parametrize("lost", [0, 2, 10**6])
def test_motion_loses_the_first_periods_of_the_whole_way(
    monkeypatch: pytest.MonkeyPatch, figure: str, lost: int
) -> None:
    monkeypatch.setattr(trial_rows, "periods_lost", lambda *_: lost)
    condition = cheap(figure)
    way_periods = motion_duration_s(condition) / PERIOD_S
    ours, _, authors = run_trial(condition, seed=0)
    assert ours["id_right"] == 3
    assert authors["id_right"] == pytest.approx(3 * max(0, 1 - lost / way_periods), abs=1e-3)


@pytest.mark.parametrize("as_sent", [True, False])
def test_ids_that_no_marker_sends_are_counted_wherever_they_are_read(
    monkeypatch: pytest.MonkeyPatch, as_sent: bool
) -> None:
    """A second marker blinks beside the scene's own, which the truth does not know of."""
    condition = cheap("08")
    scene = scene_of(condition, 0)
    own = scene.markers[0]
    payload = own.marker.payload if as_sent else own.marker.payload ^ 1
    beside = PlacedMarker(
        marker=replace(own.marker, payload=payload), path=Still(Pose.facing(condition.distance_m, x_m=1.0))
    )
    more = record(replace(scene, markers=(beside,)), 3 * PERIOD_S, np.random.default_rng(0))
    read = partial(trial_rows.record_and_read, damage=lambda events: merge(events, more))
    monkeypatch.setattr(trial_rows, "record_and_read", read)
    for row in run_trial(condition, seed=0):
        assert row["id_right"] == 3
        assert row["wrong_ids"] == (0 if as_sent else 3)


@pytest.mark.parametrize("figure", ["08", "12", "14"])
def test_a_trial_is_a_pure_function_of_condition_and_seed(
    figure: str, rows: dict[str, list[dict[str, object]]]
) -> None:
    assert run_trial(cheap(figure), seed=1) == rows[figure]
    assert run_trial(cheap(figure), seed=2)[0]["events"] != rows[figure][0]["events"]


def test_the_receiver_of_2d_markers_finds_in_each_period_what_the_whole_receiver_finds() -> None:
    condition = Condition(figure="08", distance_m=1.0)
    scene, settings = scene_of(condition, 0), replace(receiver_settings(condition), frame_rule_2d="count")
    alone, whole = Marker2dSettings(receiver=settings), Receiver(settings, 0)
    assert alone.delta_t_whole_us == settings.delta_t_whole_us
    read = alone.start(0)
    events = record(scene, 2 * PERIOD_S, np.random.default_rng(0))
    for k in range(2):
        start_us = k * settings.delta_t_whole_us
        period = slice_time(events, start_us, start_us + settings.delta_t_whole_us)
        (found,) = read(start_us, period)
        (expected,) = [each for each in whole(start_us, period) if each.marker_2d_id is not None]
        for name in ("t_us", "marker_2d_id", "corners", "rvec", "tvec"):
            assert getattr(found, name) == getattr(expected, name)
        assert found.id is None
