"""The receiver in plain NumPy and OpenCV, to compare with.

It is what an experienced engineer writes first: a frame is a `bincount`, morphology and components come from OpenCV and
run on every frame of delta_t_blinker, and no Python loop runs over events. It decides as `bicode_lab.recognition` does
(both polarities near a pixel, votes over the frames of a period) and takes tracks and packets from there, because these
cost next to nothing.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events
from bicode_lab.recognition import ReceiverSettings, Tracker, decode_packets

NEAR = np.ones((3, 3), np.uint8)
LONE_PAIR_PX = 8  # a pair of events alone covers up to 9 pixels and more after dilation

Box = tuple[int, int, int, int]
Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]


class PlainReceiver:
    """A receiver of one period after the other, without 2D markers.

    Parameters
    ----------
    settings : ReceiverSettings
    """

    def __init__(self, settings: ReceiverSettings) -> None:
        self.settings = settings
        self._tracker = Tracker(settings.max_age, settings.min_iou)
        self._closing = np.ones((settings.closing_px + 1,) * 2, np.uint8)

    def __call__(self, start_us: int, events: Events) -> list[tuple[int, Box, set[int]]]:
        """Read one period.

        Parameters
        ----------
        start_us : int
            Start of the period [us].
        events : ndarray of EVENT_DTYPE, shape (n,)
            The events of the period.

        Returns
        -------
        list of (int, (int, int, int, int), set of int)
            For each region: number of its track; left, top, width and height [px]; IDs that were read.
        """
        x, y, t = (events[name].astype(np.int64) for name in "xyt")
        is_on = events["p"] > 0
        boxes = self._boxes(x, y, t, is_on, start_us)
        tracks = self._tracker.update(boxes)
        return [
            (track.number, box, self._read(x, y, t, is_on, box, start_us))
            for track, box in zip(tracks, boxes, strict=True)
        ]

    def _boxes(self, x: Ints, y: Ints, t: Ints, is_on: Mask, start_us: int) -> list[Box]:
        """Find the blinking regions by frames, morphology, components and votes."""
        s = self.settings
        size, shape = s.width * s.height, (s.height, s.width)
        pixel = y * s.width + x
        step_us = s.delta_t_blinker_us // 2
        starts = start_us + np.arange(0, s.delta_t_whole_us - s.delta_t_blinker_us + 1, step_us)
        firsts, lasts = np.searchsorted(t, starts), np.searchsorted(t, starts + s.delta_t_blinker_us)
        votes = np.zeros(shape, np.uint8)
        for first, last in zip(firsts, lasts, strict=True):
            here, on = pixel[first:last], is_on[first:last]
            n_on = np.bincount(here[on], minlength=size).reshape(shape)
            n_off = np.bincount(here[~on], minlength=size).reshape(shape)
            near_on, near_off = (cv2.dilate((n > 0).astype(np.uint8), NEAR) for n in (n_on, n_off))
            blinks = cv2.bitwise_and(near_on, near_off)
            blinks = cv2.morphologyEx(blinks, cv2.MORPH_CLOSE, self._closing)
            _, labels, stats, _ = cv2.connectedComponentsWithStats(blinks, connectivity=8)
            large = stats[:, cv2.CC_STAT_AREA] >= s.min_region_pixels + LONE_PAIR_PX
            large[0] = False
            votes += large[labels]
        kept = (votes >= np.ceil(s.min_blink_fraction * starts.size)).astype(np.uint8)
        kept = cv2.morphologyEx(kept, cv2.MORPH_CLOSE, self._closing)
        _, _, stats, _ = cv2.connectedComponentsWithStats(kept, connectivity=8)
        found = stats[1:][stats[1:, cv2.CC_STAT_AREA] >= s.min_region_pixels + LONE_PAIR_PX]
        found = found[np.argsort(-found[:, cv2.CC_STAT_AREA])][: s.max_regions]
        return [(int(left), int(top), int(width), int(height)) for left, top, width, height, _ in found]

    def _read(self, x: Ints, y: Ints, t: Ints, is_on: Mask, box: Box, start_us: int) -> set[int]:
        """Count ON and OFF pixels in the 3-valued delta_t_ID frames of a box and decode its packets."""
        s = self.settings
        x0, y0, w, h = box
        inside = (x >= x0) & (x < x0 + w) & (y >= y0) & (y < y0 + h)
        n_bins = s.delta_t_whole_us // s.delta_t_id_us
        number = (t[inside] - start_us) // s.delta_t_id_us
        cell = (number * h + (y[inside] - y0)) * w + (x[inside] - x0)
        sums = np.bincount(cell, np.where(is_on[inside], 1.0, -1.0), minlength=n_bins * h * w)
        frames = sums.reshape(n_bins, h * w)
        n_on, n_off = (frames > 0).sum(axis=1), (frames < 0).sum(axis=1)
        packets, _ = decode_packets(n_on, n_off, start_us, s.delta_t_id_us, s.packet_format, gate=s.led_gate)
        return {p.payload for p in packets if p.checksum_ok and p.payload is not None and p.start_us >= start_us}
