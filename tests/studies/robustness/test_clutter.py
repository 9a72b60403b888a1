"""Scenes of clutter hold no marker and make events."""

import numpy as np
import pytest

from bicode_lab.camera import record
from bicode_studies.robustness.clutter import CLUTTER_KINDS, clutter_scene


@pytest.mark.parametrize("kind", CLUTTER_KINDS)
def test_clutter_holds_no_marker_and_makes_events(kind: str) -> None:
    rng = np.random.default_rng(3)
    scene = clutter_scene(kind, rng)
    assert scene.markers == ()
    assert scene.lamps
    assert (scene.wall is not None) == (kind == "moving edges")
    assert record(scene, 0.2, rng).size > 100
