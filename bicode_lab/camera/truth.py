"""Ground truth of a simulated scene.

It is used for scoring; the receiver never sees it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from bicode_lab.camera.motion import Floats, Pose
from bicode_lab.camera.plate_image import image_corners
from bicode_lab.camera.scene import Scene

SAMPLE_US = 1000  # interval between samples of a moving marker's truth


@dataclass(frozen=True, eq=False)
class MarkerTruth:
    """The truth about one marker of a scene at one moment.

    Parameters
    ----------
    payload, aruco_id : int
        The blinked ID and the id of the ArUco pattern.
    corners_px : ndarray, shape (4, 2)
        Corners of the pattern in the image, clockwise from its top left [px]; nan behind the camera.
    box_px : tuple of 4 floats
        Left, top, width and height of the image of the plate [px].
    pose : Pose
        In camera axes.
    in_view : bool
        True where the whole plate is on the sensor.
    """

    payload: int
    aruco_id: int
    corners_px: Floats
    box_px: tuple[float, float, float, float]
    pose: Pose
    in_view: bool


def truth_at(scene: Scene, t_us: float, clock_start_us: float = 0.0) -> list[MarkerTruth]:
    """Return the truth about every marker of a scene at one moment.

    Parameters
    ----------
    scene : Scene
    t_us : float
        Moment on the clock of the recording [us].
    clock_start_us : float
        Time on that clock when the scene starts [us].

    Returns
    -------
    list of MarkerTruth
        In the order of the scene's markers.
    """
    found = []
    optics = scene.optics
    for number, placed in enumerate(scene.markers):
        board = placed.marker.board
        pose = scene.marker_pose(number, (t_us - clock_start_us) * 1e-6)
        plate = image_corners(board, pose, optics)
        low, high = plate.min(0), plate.max(0)
        inside = bool((low >= 0).all() and (high <= [optics.width - 1, optics.height - 1]).all())
        found.append(
            MarkerTruth(
                payload=placed.marker.payload,
                aruco_id=board.aruco_id,
                corners_px=optics.project(pose.apply(board.pattern_corners_m())),
                box_px=(float(low[0]), float(low[1]), float(high[0] - low[0]), float(high[1] - low[1])),
                pose=pose,
                in_view=inside,
            )
        )
    return found


def packet_starts_us(scene: Scene, number: int, duration_us: float, clock_start_us: float = 0.0) -> Floats:
    """Return the moments at which the packets of a marker begin.

    Parameters
    ----------
    scene : Scene
    number : int
        Index of the marker.
    duration_us : float
        Length of the recording [us].
    clock_start_us : float
        See `truth_at`.

    Returns
    -------
    ndarray of float64, shape (n,)
        [us]
    """
    return scene.markers[number].marker.waveform.packet_starts(0, duration_us) + clock_start_us


def truth_table(scene: Scene, duration_us: int, clock_start_us: int = 0) -> dict[str, Any]:
    """Return the whole truth of a scene as plain lists and numbers, for a file beside the recording.

    Parameters
    ----------
    scene : Scene
    duration_us : int
        Length of the recording [us].
    clock_start_us : int
        See `truth_at`.

    Returns
    -------
    dict
        "t0_us", "duration_us" and "markers". Each marker has its IDs, the times of its packets, and "samples" with
        moment, box, corners and pose: one where nothing moves, else one every `SAMPLE_US`.
    """
    moments = [0] if scene.is_still else range(0, duration_us, SAMPLE_US)
    sampled = [truth_at(scene, t + clock_start_us, clock_start_us) for t in moments]
    markers = []
    for number, placed in enumerate(scene.markers):
        marker = placed.marker
        samples = [
            {
                "t_us": int(t + clock_start_us),
                "box_px": _numbers(np.array(truth[number].box_px)),
                "corners_px": _numbers(truth[number].corners_px),
                "rvec": _numbers(truth[number].pose.rvec(), 6),
                "tvec": _numbers(truth[number].pose.position_m, 6),
                "in_view": truth[number].in_view,
            }
            for t, truth in zip(moments, sampled, strict=True)
        ]
        markers.append(
            {
                "id": marker.payload,
                "aruco_id": marker.board.aruco_id,
                "size_m": marker.board.size_m,
                "pattern_size_m": marker.board.pattern_size_m,
                "current_ma": marker.current_ma,
                "packet_us": marker.waveform.packet_us,
                "packet_starts_us": _numbers(packet_starts_us(scene, number, duration_us, clock_start_us)),
                "samples": samples,
            }
        )
    return {"t0_us": clock_start_us, "duration_us": duration_us, "markers": markers}


def _numbers(values: npt.NDArray[np.float64], digits: int = 3) -> Any:
    """Return an array as nested lists of rounded numbers, with None for nan, so that the file is plain JSON."""
    rounded = np.round(values, digits).tolist()

    def plain(value: Any) -> Any:
        if isinstance(value, list):
            return [plain(v) for v in value]
        return None if value != value else value

    return plain(rounded)
