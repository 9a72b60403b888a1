"""Laws of a blurred edge seen by a log pixel."""

import numpy as np
import pytest

from bicode_lab.camera import Optics
from bicode_studies.paper_experiments.swelling import edge_contrast, gap_contrast, rim_px, share_beyond

CLEAN = Optics(blur_px=0.8, halo_fraction=0.0)


def test_shares_of_both_sides_of_an_edge_make_one():
    x_px = np.linspace(-5, 5, 21)
    for optics in (CLEAN, Optics()):
        np.testing.assert_allclose(share_beyond(x_px, optics) + share_beyond(-x_px, optics), 1)


def test_the_rim_is_where_the_contrast_is_the_threshold():
    for over_ambient in (0.4, 1.0, 5.0):
        x_px = rim_px(over_ambient, 0.25, CLEAN)
        assert float(edge_contrast(x_px, over_ambient, CLEAN)) == pytest.approx(0.25)


def test_at_twice_the_thresholds_light_the_rim_is_the_edge():
    assert rim_px(2 * np.expm1(0.25), 0.25, CLEAN) == pytest.approx(0, abs=1e-9)


def test_more_light_swells_and_a_sharper_lens_swells_in_proportion_to_its_blur():
    assert rim_px(0.5, 0.25, CLEAN) < rim_px(1.0, 0.25, CLEAN) < rim_px(2.0, 0.25, CLEAN)
    sharp = Optics(blur_px=0.4, halo_fraction=0.0)
    assert rim_px(2.0, 0.25, sharp) == pytest.approx(rim_px(2.0, 0.25, CLEAN) / 2)


def test_light_below_the_threshold_has_no_rim():
    assert np.isnan(rim_px(0.1, 0.25, CLEAN))


def test_a_gap_of_no_width_is_as_bright_as_the_face_and_a_wide_one_dark():
    none, wide = gap_contrast([0.0, 50.0], 1.5, CLEAN)
    assert none == pytest.approx(np.log1p(1.5))
    assert wide == pytest.approx(0, abs=1e-9)
