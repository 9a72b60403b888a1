"""Fig. 13: panels have the paper's conditions, and what counts as the marker's region is in its place."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab import paper
from bicode_lab.camera.truth import packet_starts_us
from bicode_studies.paper_experiments.frames_of_fig_13 import (
    BLINKER_PANELS,
    PANELS,
    _payload_frame_start_us,
    neighbourhood,
    panel_frame,
    panel_table,
)
from bicode_studies.paper_experiments.scenes import scene_of

STATED = {
    "a": {"current_ma": 5.5, "distance_m": 2.5},
    "b": {"current_ma": 10.7, "distance_m": 2.5, "yaw_deg": 0.0, "size_m": 0.05},
    "c": {"current_ma": 21.3, "distance_m": 2.5},
    "d": {"current_ma": 10.7, "distance_m": 2.5, "yaw_deg": 40.0},
    "e": {"current_ma": 10.7, "distance_m": 2.5, "yaw_deg": 80.0},
    "f": {"current_ma": 2.7, "distance_m": 2.5, "size_m": 0.025},
    "g": {"current_ma": 40.9, "distance_m": 2.5, "size_m": 0.1},
    "h": {"speed_m_per_s": 0.105, "distance_m": 2.5},
    "i": {"speed_m_per_s": 0.314, "distance_m": 2.5},
    "j": {"rpm": 16.0, "distance_m": 0.5},
    "k": {"rpm": 16.0, "distance_m": 2.5},
}


def test_each_panel_has_the_paper_s_condition() -> None:
    assert set(PANELS) == set(STATED)
    for panel, stated in STATED.items():
        assert {name: getattr(PANELS[panel], name) for name in stated} == stated
        assert PANELS[panel].illuminance_lux == paper.OFFICE_LUX


@pytest.mark.parametrize("panel", ["b", "e", "h", "k"])
def test_a_frame_is_three_valued_and_its_region_is_counted_around_the_marker(panel: str) -> None:
    found = panel_frame(panel, 1)
    assert found.frame.shape == (720, 1280)
    assert set(np.unique(found.frame)) <= {-1, 0, 1}
    x, y, w, h = found.neighbourhood_px
    assert found.region_px == np.count_nonzero(found.frame[y : y + h, x : x + w])
    left, top, width, height = found.box_px
    assert x < left < left + width < x + w
    assert y < top < top + height < y + h
    assert found.kind == ("blinker" if panel in BLINKER_PANELS else "2d")
    assert found.region_px <= np.count_nonzero(found.frame) <= found.events


def test_still_panels_are_dark_but_for_the_marker() -> None:
    found = panel_frame("b", 0)
    outside = np.count_nonzero(found.frame) - found.region_px
    pixels, seconds = found.frame.size, paper.DELTA_T_2D_US * 1e-6
    assert outside < 10 * (0.003 * pixels * seconds + 1)  # the rate of stray events, and hot pixels
    plate_px = found.box_px[2] * found.box_px[3]
    assert 0.3 * plate_px < found.region_px < 2 * plate_px


@pytest.mark.parametrize("panel", sorted(BLINKER_PANELS))
def test_a_short_frame_lies_within_the_payload(panel: str) -> None:
    for seed in range(20):
        scene = scene_of(PANELS[panel], seed)
        start_us = _payload_frame_start_us(scene, paper.DELTA_T_BLINKER_US)
        packet_us = packet_starts_us(scene, 0, 10 * paper.PACKET_US)
        into_us = start_us - packet_us[packet_us <= start_us].max()
        payload_us = paper.PAYLOAD_BITS * 1e6 / paper.F_ID_HZ
        assert into_us >= paper.START_US
        assert into_us + paper.DELTA_T_BLINKER_US <= paper.START_US + payload_us
        assert start_us >= paper.PACKET_US


def test_the_table_has_a_row_for_each_panel_and_seed_and_comes_out_the_same_again() -> None:
    table = panel_table(range(2), ["a", "k"])
    assert table[["panel", "seed"]].to_numpy().tolist() == [["a", 0], ["a", 1], ["k", 0], ["k", 1]]
    assert {"region_px", "events", "frame_kind", "current_ma", "distance_m", "rpm", "yaw_deg"} <= set(table)
    assert table.equals(panel_table(range(2), ["a", "k"]))


def test_larger_plates_have_larger_regions_in_proportion_to_their_faces() -> None:
    small, large = panel_frame("f", 0).region_px, panel_frame("g", 0).region_px
    faces = (paper.FIG_10_SIZES_M[2] / paper.FIG_10_SIZES_M[0]) ** 2
    assert faces / 2 < large / small < faces  # light spreads a pixel beyond either, which adds more to the small one


def test_a_neighbourhood_stays_on_the_sensor() -> None:
    x, y, w, h = neighbourhood((-30.0, 700.0, 50.0, 50.0), 1280, 720)
    assert (x, y + h) == (0, 720)
    assert w > 0
    assert h > 0


def test_no_such_panel() -> None:
    with pytest.raises(ValueError, match=r"panel 'z' is not in Fig. 13; choose one of a, b"):
        panel_frame("z", 0)
