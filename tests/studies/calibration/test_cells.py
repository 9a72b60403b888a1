"""The cells of Fig. 8: their seeds, what a frame of 13.2 ms needs, and what a candidate does to its accuracy."""

from __future__ import annotations

from dataclasses import replace

from bicode_lab import paper
from bicode_studies.calibration.candidates import Candidate
from bicode_studies.calibration.cells import (
    FIRST_SEED,
    FRAMES,
    NEAR_PX,
    SEEDS,
    cell_accuracy,
    seeds_of,
)
from bicode_studies.paper_experiments.grids import conditions, seeds

PLAIN = Candidate(
    led_to_ambient=1.3, blur_px=0.7, halo_fraction=0.02, time_constant_us=200.0, threshold=0.25,
    threshold_spread=0.03, noise=0.04, refractory_us=50.0, aruco_id=17, min_region_pixels=3, opening_px=3,
)  # fmt: skip


def test_only_conditions_of_fig_8_are_tried_with_seeds_that_no_figure_uses() -> None:
    grid = {(condition.current_ma, condition.distance_m) for condition in conditions("08")}
    assert {(current_ma, distance_m) for _, current_ma, distance_m in SEEDS} <= grid
    assert NEAR_PX[0] == 1280  # ArUco's least size is a share of the larger side
    assert all(max(seeds(one)) < FIRST_SEED for figure in ("08", "09", "12", "14") for one in conditions(figure))


def test_no_two_trials_share_a_seed() -> None:
    cell = max(SEEDS, key=lambda each: SEEDS[each])
    used = [seed for number in range(5) for seed in seeds_of(cell, number)]
    assert len(used) == len(set(used)) == 5 * SEEDS[cell]
    assert min(used) == FIRST_SEED
    assert all(len(seeds_of(each, 3)) == many for each, many in SEEDS.items())


def test_the_frames_of_a_cell_cover_the_packet_once() -> None:
    phases = {(frame * paper.DELTA_T_2D_US) % paper.PACKET_US for frame in range(FRAMES)}
    step = paper.PACKET_US - paper.DELTA_T_2D_US
    gaps = [b - a for a, b in zip(sorted(phases), [*sorted(phases)[1:], min(phases) + paper.PACKET_US], strict=True)]
    assert len(phases) == FRAMES
    assert max(gaps) <= step


def test_without_light_nothing_is_right_and_with_it_all_is() -> None:
    dark = replace(PLAIN, led_to_ambient=0.001)
    for cell in (("ID", 10.7, 20.0), ("2D", 10.7, 1.0)):
        assert cell_accuracy(dark, cell, range(1)) == 0
        assert cell_accuracy(PLAIN, cell, range(1)) == 1


def test_the_receiver_is_the_candidates() -> None:
    far = ("ID", 10.7, 20.0)
    assert cell_accuracy(replace(PLAIN, min_region_pixels=200), far, range(1)) == 0
    assert cell_accuracy(replace(PLAIN, opening_px=9), far, range(1)) == 0
