"""Estimate the pose of a marker from the events around its track: the whole way from a sighting to poses with odds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box
from bicode_lab.events import Events
from bicode_lab.pose.fit import Look, start_light
from bicode_lab.pose.led_clock import LedClock, fit_clock
from bicode_lab.pose.lock_in import LockIn, lock_in
from bicode_lab.pose.moving import moving_lock_in
from bicode_lab.pose.result import PlatePose, PoseEstimate
from bicode_lab.pose.search import Solution, search
from bicode_lab.pose.settings import PoseSettings
from bicode_lab.pose.starts import PoseStart, affine_maps, best_turns, moments, pattern_moments, poses_of
from bicode_lab.recognition.sighting import Sighting

Floats = npt.NDArray[np.float64]

BORDER_PX = 6  # around the box of the track: the blur and what the regions leave out
MOST_PIXELS = 5000  # a look at a larger box leaves pixels out
N_STARTS = 5  # pairs of mirrored starts
LEAST_LIKENESS = 0.1  # starts whose correlation is worse than the best one by more than this are left out


def estimate_pose(
    events: Events,
    sightings: Sighting | Sequence[Sighting],
    settings: PoseSettings | None = None,
    *,
    period_us: int = 33_000,
    moving: bool = False,
) -> PoseEstimate:
    """Estimate the pose of a marker in one or several periods.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        In the order of time; they span the periods at least.
    sightings : Sighting or sequence of Sighting
        Of one track, in the order of time, see `recognition.recognise`. Those without an ID are left out.
    settings : PoseSettings, optional
        None takes the default settings.
    period_us : int
        Length of a period, delta_t_whole [us].
    moving : bool
        Whether the plate may move: its events are then taken back to the middle of the time along its motion in the
        image, which is found first, with any turn in the image plane. A tilted plate that spins fast is no such motion.
        Give one period.

    Returns
    -------
    PoseEstimate

    Examples
    --------
    >>> from bicode_lab import Board, Marker, PlacedMarker, Pose, Scene, Still, recognise, record
    >>> board = Board(aruco_id=17)
    >>> path = Still(Pose.facing(2.5, yaw_deg=40))
    >>> events = record(Scene(markers=(PlacedMarker(marker=Marker(board=board), path=path),)), 0.2, 0)
    >>> last = list(recognise(events))[-2]
    >>> pose = estimate_pose(events, last, PoseSettings(board=board)).pose
    >>> round(float(pose.position_m[2]), 1), pose.aruco_id
    (2.5, 17)
    """
    settings = settings or PoseSettings()
    given = [sightings] if isinstance(sightings, Sighting) else list(sightings)
    named = [sighting for sighting in given if sighting.id is not None]
    start_us = min((sighting.t_us for sighting in given), default=0)
    end_us = max((sighting.t_us for sighting in given), default=0) + period_us
    t_us = (start_us + end_us) / 2
    clock = clock_of(named, settings)
    if clock is None:
        return PoseEstimate(t_us=t_us, reason="no_id")
    core = Box(named[0].x, named[0].y, named[0].w, named[0].h)
    for sighting in named[1:]:
        core = core.union(Box(sighting.x, sighting.y, sighting.w, sighting.h))
    if moving:
        back = moving_lock_in(events, clock, core, start_us, end_us)
        return PoseEstimate(t_us=t_us, reason="no_edges") if back is None else pose_of_image(back, settings)
    wide = Box(core.x - BORDER_PX, core.y - BORDER_PX, core.w + 2 * BORDER_PX, core.h + 2 * BORDER_PX)
    image = lock_in(events, clock, wide.clipped(settings.width, settings.height), start_us, end_us, core)
    if image is None:
        return PoseEstimate(t_us=t_us, reason="no_edges")
    return pose_of_image(image, settings)


def clock_of(sightings: Sequence[Sighting], settings: PoseSettings) -> LedClock | None:
    """Return the clock of the LED of a track's sightings, or None if none of them has an ID.

    Parameters
    ----------
    sightings : sequence of Sighting
        Of one track; the ID of the most of them counts.
    settings : PoseSettings

    Returns
    -------
    LedClock or None
    """
    ids = [sighting.id for sighting in sightings if sighting.id is not None]
    if not ids:
        return None
    payload = max(set(ids), key=ids.count)
    packets = [packet for each in sightings for packet in (*each.border_packets, *each.packets)]
    return fit_clock(packets, payload, settings.packet_format)


def pose_of_image(image: LockIn, settings: PoseSettings) -> PoseEstimate:
    """Estimate the pose of a plate from its lock-in image.

    Parameters
    ----------
    image : LockIn
    settings : PoseSettings

    Returns
    -------
    PoseEstimate
    """
    light = moments(image.image, np.sqrt(image.variance) + 1 / image.n_edges, start_light(settings.priors))
    if light is None:
        return PoseEstimate(t_us=image.t_us, reason="no_light", lock_in=image)
    found: list[tuple[Solution, int]] = []
    for aruco_id, starts in _starts(image, light, settings).items():
        look = look_of(image, aruco_id, settings)
        found += [(each, aruco_id) for each in search(look, starts, start_light(settings.priors))]
    if not found:
        return PoseEstimate(t_us=image.t_us, reason="no_fit", lock_in=image)
    found.sort(key=lambda pair: pair[0].cost)
    odds = np.exp([found[0][0].cost - each.cost for each, _ in found])
    cell_m = settings.board.size_m / settings.board.cells().shape[0]
    poses = tuple(
        _plate_pose(each, cell_m, float(share), aruco_id, np.array(image.doubt_px) / settings.focal_px)
        for (each, aruco_id), share in zip(found, odds / odds.sum(), strict=True)
    )
    return PoseEstimate(t_us=image.t_us, poses=poses, lock_in=image)


def look_of(image: LockIn, aruco_id: int, settings: PoseSettings) -> Look:
    """Return a lock-in image with camera and plate, as poses are fitted to it.

    Parameters
    ----------
    image : LockIn
        Of a large box, only every second or third pixel is used.
    aruco_id : int
        The pattern.
    settings : PoseSettings

    Returns
    -------
    Look
        With the variance of the background.
    """
    board = replace(settings.board, aruco_id=aruco_id)
    cells = board.cells().astype(np.float64)
    step = max(1, math.ceil(math.sqrt(image.image.size / MOST_PIXELS)))
    return Look(
        seen=np.ascontiguousarray(image.image[::step, ::step]),
        variance=np.ascontiguousarray(image.variance[::step, ::step]),
        x=image.box.x, y=image.box.y, step_px=step, camera=settings.camera,
        cells=cells, thickness=board.thickness_m / board.size_m * cells.shape[0], priors=settings.priors,
    )  # fmt: skip


def _starts(image: LockIn, light: tuple[Floats, Floats], settings: PoseSettings) -> dict[int, list[PoseStart]]:
    """Return the starts for each pattern that may stand on the plate; those whose turns fit best."""
    blur_px = math.exp(settings.priors.log_blur[0])
    middle, spread = light
    place = middle + [image.box.x, image.box.y]
    ranked: list[tuple[float, int, list[PoseStart]]] = []
    for aruco_id in settings.candidates:
        cells = replace(settings.board, aruco_id=aruco_id).cells().astype(np.float64)
        offset, pattern = pattern_moments(cells)
        maps = affine_maps(spread, pattern)
        for k, score in best_turns(image.image, middle, maps, offset, cells, blur_px):
            ranked.append((score, aruco_id, poses_of(maps[k], place, offset, settings.camera)))
    ranked.sort(key=lambda each: -each[0])
    starts: dict[int, list[PoseStart]] = {}
    for score, aruco_id, pair in ranked[:N_STARTS]:
        if score < ranked[0][0] - LEAST_LIKENESS:
            break
        starts.setdefault(aruco_id, []).extend(pair)
    return starts


def _plate_pose(solution: Solution, cell_m: float, probability: float, aruco_id: int, doubt: Floats) -> PlatePose:
    """Return a solution in metres; `doubt` is that of the direction in x and y [rad]."""
    unit = np.diag([1, 1, 1, cell_m, cell_m, cell_m])
    aside = np.diag([0, 0, 0, *(doubt * solution.place[2] * cell_m) ** 2, 0])
    return PlatePose(
        rotation=solution.rotation, position_m=solution.place * cell_m,
        covariance=unit @ solution.covariance @ unit + aside, probability=probability, aruco_id=aruco_id,
    )  # fmt: skip
