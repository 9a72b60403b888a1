"""One trial: all receivers read the same recording, and what they read is counted against the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab import paper
from bicode_lab.camera import Optics, Readout, Scene, record
from bicode_lab.events import Events, no_events
from bicode_lab.recognition import ReceiverSettings, recognise
from bicode_lab.soft_receiver import SoftSettings
from bicode_studies.score import Periods
from bicode_studies.trial import PERIOD_S, Settings, read, record_and_read, run

OPTICS = Optics(width=160, height=120)
SCENE = Scene(optics=OPTICS)  # the paper's marker at its nearest
PAPER = ReceiverSettings(width=OPTICS.width, height=OPTICS.height)
ID_ALONE = replace(PAPER, detect_2d=False)
RECEIVERS: dict[str, Settings] = {
    "paper": PAPER,
    "soft": SoftSettings(receiver=ID_ALONE, evidence_periods=2, region_periods=0),
}
THREE = Periods(start_us=0, count=3)


def test_the_paper_s_period_is_33_ms() -> None:
    assert pytest.approx(0.033) == PERIOD_S


def test_all_receivers_read_one_recording_with_the_camera_s_own_seed() -> None:
    trial = record_and_read(SCENE, RECEIVERS, periods=THREE, seed=4)
    events = record(SCENE, 3 * PERIOD_S, np.random.default_rng([4, 2]))
    assert trial.n_events == events.size
    for name, settings in RECEIVERS.items():
        reading = trial.readings[name]
        assert reading.sightings == tuple(recognise(events, settings, t0_us=0))
        again = read(events, SCENE, settings, THREE)
        assert again.scores.equals(reading.scores)
        assert again.wrong_ids == reading.wrong_ids
    assert trial.readings["paper"].right() == 3
    assert trial.readings["paper"].right("marker_2d_right") == trial.readings["paper"].scores["marker_2d_right"].sum()


def test_a_table_has_a_row_for_each_receiver() -> None:
    table = run(SCENE, RECEIVERS, periods=3, seed=4)
    trial = record_and_read(SCENE, RECEIVERS, periods=THREE, seed=4)
    assert table["receiver"].tolist() == ["paper", "soft"]
    for row, reading in zip(table.to_dict("records"), trial.readings.values(), strict=True):
        assert (row["seed"], row["periods"], row["events"], row["lost"]) == (4, 3, trial.n_events, 0)
        assert row["id_right"] == reading.right()
        assert row["marker_2d_right"] == reading.right("marker_2d_right")
        assert row["wrong_ids"] == reading.wrong_ids == 0
    assert table.equals(run(SCENE, RECEIVERS, periods=3, seed=4))
    assert run(SCENE, RECEIVERS, periods=3, seed=5)["events"][0] != table["events"][0]


def test_periods_of_the_warm_up_are_read_and_not_judged() -> None:
    warm = run(SCENE, {"paper": PAPER}, periods=2, seed=4, warm_up=3)
    assert warm["periods"].tolist() == [2]
    five = run(SCENE, {"paper": PAPER}, periods=5, seed=4)
    assert warm["events"].tolist() == five["events"].tolist()
    judged = Periods(start_us=3 * paper.DELTA_T_WHOLE_US, count=2)
    reading = record_and_read(SCENE, {"paper": PAPER}, periods=judged, seed=4).readings["paper"]
    assert reading.scores["period"].tolist() == [0, 1]
    assert min(sighting.t_us for sighting in reading.sightings) == judged.start_us


def test_a_recording_may_be_longer_than_what_is_judged() -> None:
    trial = record_and_read(SCENE, {"paper": PAPER}, periods=THREE, seed=4, duration_s=5 * PERIOD_S)
    assert trial.n_events == record(SCENE, 5 * PERIOD_S, np.random.default_rng([4, 2])).size
    assert len(trial.readings["paper"].scores) == 3


def test_damage_stands_between_the_camera_and_the_receivers() -> None:
    seen: list[int] = []

    def keep_nothing(events: Events) -> Events:
        seen.append(events.size)
        return no_events()

    trial = record_and_read(SCENE, RECEIVERS, periods=THREE, seed=4, damage=keep_nothing)
    assert seen == [record(SCENE, 3 * PERIOD_S, np.random.default_rng([4, 2])).size]
    assert trial.n_events == 0
    for reading in trial.readings.values():
        assert (reading.right(), len(reading.scores), reading.sightings) == (0, 3, ())


def test_damage_that_changes_nothing_changes_no_result() -> None:
    plain = record_and_read(SCENE, RECEIVERS, periods=THREE, seed=4)
    same = record_and_read(SCENE, RECEIVERS, periods=THREE, seed=4, damage=lambda events: events)
    assert same.n_events == plain.n_events
    for name in RECEIVERS:
        assert same.readings[name].sightings == plain.readings[name].sightings


def test_events_that_the_readout_loses_are_counted() -> None:
    slow = replace(SCENE, readout=Readout(sustained_mev_per_s=0.01, buffer_events=100))
    row = run(slow, {"paper": PAPER}, periods=3, seed=4).iloc[0]
    whole = run(SCENE, {"paper": PAPER}, periods=3, seed=4).iloc[0]
    assert row["lost"] > 0.5 * whole["events"]
    assert row["events"] + row["lost"] <= whole["events"]


def test_an_id_that_no_marker_sends_is_wrong() -> None:
    """The events are those of one payload, and the truth is told another."""
    placed = SCENE.markers[0]
    other = replace(placed, marker=replace(placed.marker, payload=placed.marker.payload ^ 0xFF))
    events = record(SCENE, 3 * PERIOD_S, np.random.default_rng([4, 2]))
    reading = read(events, replace(SCENE, markers=(other,)), ID_ALONE, THREE)
    assert (reading.right(), reading.wrong_ids) == (0, 3)
    two = read(events, replace(SCENE, markers=(other,)), ID_ALONE, Periods(start_us=0, count=2))
    assert two.wrong_ids == 2  # the third period is not judged


def test_a_period_without_an_id_has_no_wrong_id() -> None:
    dark = replace(SCENE, light=replace(SCENE.light, led_to_ambient=1e-6))
    noisy = replace(dark, pixel_model=replace(dark.pixel_model, background_hz=100.0))
    reading = record_and_read(noisy, {"paper": PAPER}, periods=THREE, seed=4).readings["paper"]
    assert len(reading.sightings) > 0
    assert (reading.right(), reading.wrong_ids) == (0, 0)


def test_axes_are_wrong_where_one_points_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    trial = record_and_read(SCENE, {"paper": PAPER}, periods=THREE, seed=4)
    scores = trial.readings["paper"].scores.assign(axis_deg=[30.5, 29.5, np.nan])
    monkeypatch.setattr("bicode_studies.trial.score", lambda *_: scores)
    assert run(SCENE, {"paper": PAPER}, periods=3, seed=4)["axes_wrong"].tolist() == [1]


def test_a_scene_without_a_marker_has_no_periods() -> None:
    row = run(replace(SCENE, markers=()), {"paper": PAPER}, periods=2, seed=4).iloc[0]
    assert (row["periods"], row["id_right"], row["marker_2d_right"], row["axes_wrong"]) == (0, 0, 0, 0)


@pytest.mark.parametrize("receivers", [{}, {"paper": PAPER, "short": replace(PAPER, delta_t_whole_us=30_000)}])
def test_receivers_of_no_or_several_lengths_are_refused(receivers: dict[str, Settings]) -> None:
    with pytest.raises(ValueError, match=r"delta_t_whole_us of .*; give one or more, all of one length"):
        run(SCENE, receivers, periods=2, seed=0)
    with pytest.raises(ValueError, match=r"delta_t_whole_us of"):
        record_and_read(SCENE, receivers, periods=THREE, seed=0)
