"""What sets the range: laws of the least region and of the light, and drawings of what was given."""

import pandas as pd
import pytest
from matplotlib.figure import Figure

from bicode_lab.recognition import ReceiverSettings
from bicode_lab.soft_receiver import SoftSettings
from bicode_studies.paper_experiments import range_limits
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.plots_range_limits import draw_far_accuracy, draw_ranges
from bicode_studies.paper_experiments.range_limits import (
    DEFAULT,
    LEAST_REGIONS_PX,
    OF_THE_FIGURES,
    RECEIVERS,
    SOFT,
    FarMarker,
    far_scene,
    id_ranges,
    inverse_square_range_m,
    least_in_use,
    read_far,
    receivers_of,
)
from bicode_studies.paper_experiments.scenes import window_scene
from bicode_studies.trial import run

NEAR_M, FAR_M = 20.0, 30.0


@pytest.fixture(scope="module")
def table():
    """Two distances, two currents, two seeds."""
    trials = [
        (FarMarker(distance_m=distance_m, current_ma=current_ma, periods=8), seed)
        for current_ma in (10.7, 21.3) for distance_m in (NEAR_M, FAR_M) for seed in (0, 1)
    ]  # fmt: skip
    return pd.DataFrame([row for marker, seed in trials for row in read_far(marker, seed)])


def test_every_receiver_and_least_region_reads_the_same_recording(table):
    each = table.groupby(["current_ma", "distance_m", "seed"])
    assert (each["events"].nunique() == 1).all()
    assert (each.size() == len(RECEIVERS) * len(LEAST_REGIONS_PX)).all()
    scene = far_scene(FarMarker(distance_m=FAR_M, current_ma=21.3, periods=8), 1)
    assert (scene.markers[0].marker.current_ma, scene.markers[0].path.pose.position_m[2]) == (21.3, FAR_M)
    own = window_scene(FAR_M, 1).markers[0]
    assert scene.markers[0].marker.payload == own.marker.payload  # what the seed draws stays
    assert (scene.markers[0].path.pose.position_m == own.path.pose.position_m).all()
    alone = run(scene, {"one": receivers_of([15])[f"{OF_THE_FIGURES}, 15 px"]}, periods=8, seed=1)
    there = table.query("current_ma == 21.3 and distance_m == @FAR_M and seed == 1 and min_region_pixels == 15")
    assert there["events"].unique().tolist() == alone["events"].tolist()
    assert there[there["receiver"] == OF_THE_FIGURES]["id_right"].tolist() == alone["id_right"].tolist()


def test_the_receivers_are_the_three_of_the_glossary():
    found = receivers_of([least_in_use(name) for name in (DEFAULT, OF_THE_FIGURES)])
    figures = found[f"{OF_THE_FIGURES}, {least_in_use(OF_THE_FIGURES)} px"]
    theirs = receiver_settings(Condition(figure="08", distance_m=1.0))
    for name in ("opening_px", "min_region_pixels", "led_gate", "frame_rule_blinker", "min_blink_fraction"):
        assert getattr(figures, name) == getattr(theirs, name)
        assert getattr(found[f"{DEFAULT}, {least_in_use(DEFAULT)} px"], name) == getattr(ReceiverSettings(), name)
    soft = found[f"{SOFT}, {least_in_use(SOFT)} px"]
    assert isinstance(soft, SoftSettings)
    assert soft.evidence_periods == SoftSettings().evidence_periods
    assert soft.receiver == found[f"{DEFAULT}, {least_in_use(DEFAULT)} px"]


def test_the_range_does_not_fall_when_the_least_region_shrinks(table):
    ranges = id_ranges(table)
    for _, mine in ranges.groupby(["receiver", "current_ma"]):
        assert mine.sort_values("min_region_pixels")["range_m"].is_monotonic_decreasing
    widest = ranges.pivot(index=["receiver", "current_ma"], columns="min_region_pixels", values="range_m")
    assert (widest[3] > widest[20]).any()  # and for some receiver it does rise


def test_more_light_and_a_receiver_that_asks_for_less_read_no_less_far(table):
    ranges = id_ranges(table).pivot(index=["receiver", "min_region_pixels"], columns="current_ma", values="range_m")
    assert (ranges[21.3] >= ranges[10.7]).all()
    by_receiver = id_ranges(table).pivot(
        index=["current_ma", "min_region_pixels"], columns="receiver", values="range_m"
    )
    assert (by_receiver[DEFAULT] >= by_receiver[OF_THE_FIGURES]).all()


def test_an_opened_region_has_nine_pixels_so_a_smaller_least_region_changes_nothing(table):
    opened = table[table["receiver"] == OF_THE_FIGURES]
    read = opened.pivot(index=["current_ma", "distance_m", "seed"], columns="min_region_pixels", values="id_right")
    assert read[3].tolist() == read[6].tolist()
    assert read[3].tolist() != read[20].tolist()


def test_a_marker_without_light_has_the_range_0():
    marker = FarMarker(distance_m=NEAR_M, current_ma=1e-6, periods=3)
    dark = id_ranges(pd.DataFrame(read_far(marker, 0)))
    assert len(dark) == len(RECEIVERS) * len(LEAST_REGIONS_PX)
    assert not dark[["range_m", "low"]].to_numpy().any()
    assert not dark["beyond"].any()


def test_a_range_lies_where_the_mean_over_seeds_crosses_one_half():
    rows = [
        {"receiver": "r", "current_ma": 1.0, "min_region_pixels": 3, "seed": seed, "distance_m": d, "periods": 10,
         "id_right": right}
        for d, by_seed in ((10.0, (10, 10)), (20.0, (10, 6)), (40.0, (4, 0))) for seed, right in enumerate(by_seed)
    ]  # fmt: skip
    (found,) = id_ranges(pd.DataFrame(rows)).to_dict("records")
    assert found["range_m"] == pytest.approx(20 + 20 * (0.8 - 0.5) / (0.8 - 0.2))
    assert found["low"] < found["range_m"] < found["high"]  # the seeds differ
    assert found["beyond"] is False
    (cut,) = id_ranges(pd.DataFrame(rows).query("distance_m < 30")).to_dict("records")
    assert (cut["range_m"], cut["beyond"]) == (20.0, True)


def test_light_alone_reads_twice_as_far_with_four_times_the_current():
    assert inverse_square_range_m(10.7) == 20.0
    assert inverse_square_range_m(4 * 10.7) == pytest.approx(40.0)


def test_the_short_version_has_its_own_distances(monkeypatch):
    asked = []
    monkeypatch.setattr(range_limits, "read_far", lambda marker, seed: asked.append((marker, seed)) or [{"n": 1}])
    assert len(range_limits.far_readings(quick=True)) == len(asked)
    assert {marker.distance_m for marker, _ in asked} == set(range_limits.QUICK_DISTANCES_M)
    assert {marker.current_ma for marker, _ in asked} == {10.7, 21.3}


def test_ranges_are_drawn_over_the_least_region_with_the_light_and_the_paper():
    rows = [
        (receiver, current_ma, least_px, current_ma + least_px, current_ma, current_ma + 30,
         receiver == SOFT and least_px == 3)
        for receiver in RECEIVERS for current_ma in (10.7, 21.3) for least_px in (3, 15)
    ]  # fmt: skip
    columns = ["receiver", "current_ma", "min_region_pixels", "range_m", "low", "high", "beyond"]
    stated = pd.DataFrame({"min_region_pixels": [15, 15], "range_m": [20.0, 30.0]})
    ax = draw_ranges(pd.DataFrame(rows, columns=columns), Figure().subplots(), light_m={10.7: 20.0}, stated=stated)
    drawn = {bars.get_label(): bars.lines[0].get_ydata().tolist() for bars in ax.containers}
    assert drawn == {f"{r}, {ma:g} mA": [ma + 3, ma + 15] for r in RECEIVERS for ma in (10.7, 21.3)}
    lines = {line.get_label(): line.get_ydata() for line in ax.lines}
    assert set(lines["light alone, 10.7 mA"]) == {20.0}
    assert lines["the paper"].tolist() == [20.0, 30.0]
    triangles = [line for line in ax.lines if line.get_marker() == "^"]
    assert [line.get_xdata().tolist() for line in triangles] == [[3]] * 2  # an empty line would spoil the layout


def test_accuracies_are_drawn_over_distance():
    table = pd.DataFrame({"receiver": [SOFT] * 2, "current_ma": 10.7, "distance_m": [20.0, 60.0], "accuracy": [1, 0.4]})
    ax = draw_far_accuracy(table.assign(low=0.3, high=1.0), Figure().subplots())
    (bars,) = ax.containers
    assert (bars.lines[0].get_xdata().tolist(), bars.lines[0].get_ydata().tolist()) == ([20.0, 60.0], [1, 0.4])
    assert bars.get_label() == f"{SOFT}, 10.7 mA"
    assert ax.get_xlim()[1] > 60
