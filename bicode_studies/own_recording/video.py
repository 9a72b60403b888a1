"""Write a recording with the results of the receiver as a video, and the results as a table.

The video is slowed down: each picture shows the events of `frame_us`, and `fps` pictures are shown per second. Boxes,
track numbers and IDs are those of the period in which a picture lies.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events
from bicode_lab.recognition import ReceiverSettings, Sighting, frames, to_table
from bicode_studies.plots.frames import BACKGROUND, FOUND, OFF, ON

Picture = npt.NDArray[np.uint8]

FONT = cv2.FONT_HERSHEY_SIMPLEX
NO_ID = "#9AA3B2"
MIN_WIDTH_PX = 640  # a smaller picture is enlarged, so that the text can be read


def write_video(
    path: Path,
    chunks: Iterable[Events] | Events,
    sightings: Sequence[Sighting],
    settings: ReceiverSettings,
    *,
    frame_us: int = 3000,
    fps: float = 25.0,
    zoom: Sequence[int] | None = None,
    max_frames: int | None = None,
) -> int:
    """Write the events of a recording and the results of the receiver as an mp4 video.

    Parameters
    ----------
    path : Path
        The file to write; it ends in .mp4. Its folder is made where it is missing.
    chunks : iterable of ndarray of EVENT_DTYPE, or one such array
        Events in the order of time.
    sightings : sequence of Sighting
        What the receiver read in them.
    settings : ReceiverSettings
        Settings of the receiver; the sensor size and the length of a period are used.
    frame_us : int
        Time span of one picture [us].
    fps : float
        Pictures per second; 3000 us at 25 pictures per second is slowed down 13 times.
    zoom : sequence of int, optional
        Part of the sensor to show, x, y, w, h [px]; None shows all of it.
    max_frames : int, optional
        Number of pictures after which to stop.

    Returns
    -------
    int
        Number of pictures.

    Raises
    ------
    ValueError
        If the name does not end in .mp4, or the video cannot be written.
    """
    if path.suffix != ".mp4":
        raise ValueError(f"{path.name} does not end in .mp4; only mp4 videos can be written")
    view = (0, 0, settings.width, settings.height) if zoom is None else tuple(int(v) for v in zoom)
    scale = max(1, -(-MIN_WIDTH_PX // view[2]))
    size = (view[2] * scale // 2 * 2, view[3] * scale // 2 * 2)
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), fps, size)
    if not writer.isOpened():
        raise ValueError(f"OpenCV cannot write {path.name}; check that the folder can be written to")
    n = 0
    try:
        for picture in draw_pictures(chunks, sightings, settings, frame_us=frame_us, view=view, scale=scale):
            writer.write(picture[: size[1], : size[0]])
            n += 1
            if max_frames is not None and n >= max_frames:
                break
    finally:
        writer.release()
    return n


def draw_pictures(
    chunks: Iterable[Events] | Events,
    sightings: Sequence[Sighting],
    settings: ReceiverSettings,
    *,
    frame_us: int,
    view: Sequence[int],
    scale: int = 1,
) -> Iterator[Picture]:
    """Yield the pictures of a video.

    Parameters
    ----------
    chunks, sightings, settings, frame_us
        See `write_video`.
    view : sequence of int
        Part of the sensor to show, x, y, w, h [px].
    scale : int
        Width of a sensor pixel in the picture [px].

    Yields
    ------
    ndarray of uint8, shape (h * scale, w * scale, 3)
        A picture in OpenCV's order: blue, green, red.
    """
    left, top, width, height = view
    colors = np.array([_bgr(OFF), _bgr(BACKGROUND), _bgr(ON)], np.uint8)
    by_period: dict[int, list[Sighting]] = {}
    for sighting in sightings:
        by_period.setdefault(sighting.t_us, []).append(sighting)
    starts = np.array(sorted(by_period), np.int64)
    first_us: int | None = None
    for t_us, frame in frames(chunks, frame_us, settings.width, settings.height, "last"):
        first_us = t_us if first_us is None else first_us
        picture = colors[frame[top : top + height, left : left + width] + 1]
        picture = np.ascontiguousarray(picture.repeat(scale, axis=0).repeat(scale, axis=1))
        at = int(np.searchsorted(starts, t_us + frame_us // 2, side="right")) - 1
        if at >= 0 and t_us < starts[at] + settings.delta_t_whole_us:
            for sighting in by_period[int(starts[at])]:
                _draw_sighting(picture, sighting, left, top, scale)
        _write(picture, f"{(t_us - first_us) / 1e3:.1f} ms", (8, picture.shape[0] - 10), ON)
        yield picture


def write_table(path: Path, sightings: Sequence[Sighting]) -> Path:
    """Write the results of the receiver as a CSV file with one row per track and period.

    Parameters
    ----------
    path : Path
        The file to write. Its folder is made where it is missing.
    sightings : sequence of Sighting
        What the receiver read.

    Returns
    -------
    Path
        The file.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    to_table(sightings).to_csv(path, index=False, lineterminator="\n")
    return path


def _draw_sighting(picture: Picture, sighting: Sighting, left: int, top: int, scale: int) -> None:
    """Draw a box with the number of its track and its ID, or the reason why it has none."""
    x, y = (sighting.x - left) * scale - 1, (sighting.y - top) * scale - 1
    w, h = sighting.w * scale + 1, sighting.h * scale + 1
    color = FOUND if sighting.id is not None else NO_ID
    text = f"ID {sighting.id}" if sighting.id is not None else str(sighting.reason)
    cv2.rectangle(picture, (x, y), (x + w, y + h), _bgr(color), 2)
    _write(picture, f"#{sighting.track} {text}", (max(x, 2), y - 6 if y > 24 else y + h + 20), color)
    if sighting.corners is not None:
        corners = (np.array(sighting.corners) - [left, top]) * scale
        cv2.polylines(picture, [corners.round().astype(np.int32)], True, _bgr(FOUND), 1, cv2.LINE_AA)


def _write(picture: Picture, text: str, place: tuple[int, int], color: str) -> None:
    """Draw a text with a dark outline, so that it can be read on top of events."""
    cv2.putText(picture, text, place, FONT, 0.6, _bgr(BACKGROUND), 4, cv2.LINE_AA)
    cv2.putText(picture, text, place, FONT, 0.6, _bgr(color), 1, cv2.LINE_AA)


def _bgr(color: str) -> tuple[int, int, int]:
    """Return a colour #RRGGBB as OpenCV's blue, green, red.

    Examples
    --------
    >>> _bgr("#1E2534")
    (52, 37, 30)
    """
    red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
    return blue, green, red
