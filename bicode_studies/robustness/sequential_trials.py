"""Trials of the sequential receiver: links, distances, and clutter without a marker."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bicode_lab.camera import Recorder
from bicode_lab.events import Events, join
from bicode_lab.recognition import ReceiverSettings, Sighting, recognise
from bicode_lab.sequential import SequentialSettings
from bicode_studies.paper_experiments.scenes import WINDOW_RECEIVER
from bicode_studies.robustness.clutter import CLUTTER_KINDS, clutter_scene
from bicode_studies.robustness.false_ids import (
    CHECKSUMS,
    KIND_OF_PIECE,
    SCENE_S,
    SCENES_PER_PIECE,
    Count,
    add_up,
    clutter_trials,
)
from bicode_studies.robustness.link_conditions import LinkCondition
from bicode_studies.robustness.link_scenes import settings_of
from bicode_studies.robustness.link_trials import link_rows, range_rows
from bicode_studies.robustness.stressors import StressCondition

NAME = "sequential"


def read_link_by_sequential(condition: LinkCondition, seed: int) -> list[dict[str, Any]]:
    """Read a link with the sequential receiver, see `link_trials.link_rows`."""
    return link_rows(condition, seed, {NAME: SequentialSettings(receiver=settings_of(condition))})


def read_distance_by_sequential(condition: StressCondition, seed: int) -> list[dict[str, Any]]:
    """Read the paper's marker at a distance from one period's evidence and from a second's; see `range_rows`."""
    receivers = {
        f"{NAME}, 1 period": SequentialSettings(receiver=WINDOW_RECEIVER, evidence_periods=1),
        f"{NAME}, 30 periods": SequentialSettings(receiver=WINDOW_RECEIVER, evidence_periods=30),
    }
    return range_rows(condition, seed, receivers)


@dataclass(frozen=True, kw_only=True)
class Piece:
    """A piece of clutter without a marker; its number is the seed of the trial, as for `false_ids.ClutterPiece`.

    Attributes
    ----------
    scene_s : float
        Length of a scene [s].
    scenes : int
        Scenes in the piece.
    """

    scene_s: float = SCENE_S
    scenes: int = SCENES_PER_PIECE


def pieces(hours: float) -> list[tuple[Piece, int]]:
    """Return the pieces that make up some hours of clutter, each with its number.

    Parameters
    ----------
    hours : float
        More than 0; rounded up to whole pieces.

    Raises
    ------
    ValueError
        If `hours` is not more than 0.
    """
    return [(Piece(), number) for _, number in clutter_trials(hours, (NAME,))]


def count_piece_by_sequential(condition: Piece, seed: int) -> list[dict[str, Any]]:
    """Record a piece of clutter, the same as `false_ids.count_piece`, and count what the sequential receiver reads.

    Parameters
    ----------
    condition : Piece
    seed : int
        Number of the piece.

    Returns
    -------
    list of dict
        One row for each checksum, as `false_ids.count_piece` returns them.
    """
    kind = CLUTTER_KINDS[KIND_OF_PIECE[seed % len(KIND_OF_PIECE)]]
    counts: list[Count] = []
    n_events = 0
    for k in range(condition.scenes):
        rng = np.random.default_rng([seed, k])
        scene = clutter_scene(kind, rng)
        events = join(Recorder(scene, condition.scene_s, rng))
        n_events += events.size
        counts += _count(events, condition.scene_s, scene.optics.width, scene.optics.height)
    rows = add_up(counts).to_dict("records")
    return [
        {"piece": seed, "clutter": kind, **{str(name): value for name, value in row.items()}, "events": n_events}
        for row in rows
    ]


def _count(events: Events, seconds: float, width: int, height: int) -> Iterator[Count]:
    """Yield the counts with each kind of checksum; where nothing was looked at, no checksum makes a difference."""
    plain = ReceiverSettings(width=width, height=height, detect_2d=False)
    sightings: list[Sighting] | None = None
    for checksum in CHECKSUMS:
        if sightings is None or sightings:
            settings = replace(plain, packet_format=replace(plain.packet_format, checksum=checksum))
            sightings = list(recognise(events, SequentialSettings(receiver=settings), t0_us=0))
        read = [sighting.id for sighting in sightings if sighting.id is not None]
        yield Count(
            receiver=NAME, checksum=checksum, seconds=seconds, looked_at=len(sightings),
            structures=sum(sighting.reason in (None, "checksum", "conflict") for sighting in sightings),
            passed=len(read), ids=len(read), zeros=read.count(0),
        )  # fmt: skip
