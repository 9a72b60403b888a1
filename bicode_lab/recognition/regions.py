"""Find where something blinks in the events of one period (Fig. 2, boxes d, e and the first half of f).

The paper looks for bright spots in one frame of delta_t_blinker = 2 ms, "slightly higher than the blinking duration".
A single frame in 33 ms misses a marker that is in its off time then. So the frame slides over the whole period in
steps of half its length, and each pixel collects votes: one for each frame in which it looks like a blinker.

A blinker switches in every bit, so within the data each frame of two bits holds an ON edge and an OFF edge, whatever
the ID; only the start is quiet. Of the 31 frames of a period, about 21 (68 %) hold both edges. Clutter is different:
an edge of a texture passes a pixel with a few events of one polarity, and a hot pixel fires about 4 times per period,
without its neighbours. So the rule "blink" votes for a pixel if there are events of both polarities among its 3 x 3
neighbours within one frame. It counts ON and OFF separately and never their difference, so that a sensor that makes
as many ON as OFF events cannot hide a marker. A pixel is kept if its votes reach `min_blink_fraction` of the frames.
30 % is less than half of what a marker should show, because the pixels of a far marker miss many edges. The other
rules vote where the 3-valued frame is not zero, as the paper does.

Morphology: kept pixels that lie in no full square of `opening_px` are dropped (opening; off by default, because it
costs the farthest markers). Pixels with no more than `closing_px` other pixels between them belong to one region
(closing, then connected components). Regions of fewer than `min_region_pixels` are dropped. Regions whose boxes
overlap are merged, such as the islands inside the ring of a near marker.

The cost grows with the number of events only: one pass over them sets, for each pixel, one bit per half frame, and
only pixels with events are looked at again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box
from bicode_lab.events import Events
from bicode_lab.kernels import njit
from bicode_lab.recognition.accumulate import accumulate
from bicode_lab.recognition.components import components, merge_overlapping, open_squares
from bicode_lab.recognition.event_codes import AHEAD, ONE, CodedEvents, EventCoder, prefetch
from bicode_lab.recognition.settings import FrameRule, ReceiverSettings

MAX_BINS = 32  # half frames per period, which are the bits of half a word
ON_SHIFT = np.uint64(32)  # the upper half of a pixel's word is for ON, the lower half for OFF
LOWER_HALF = np.uint64(0xFFFFFFFF)
MIN_HALF_FRAMES = 3  # a kept pixel has events of its own in at least this many half frames
CLEAR_ALL = 16  # if more than one pixel in this many has events, all pixels are cleared at once


@dataclass(frozen=True)
class Region:
    """A box in which something blinks in one period.

    Parameters
    ----------
    x, y, w, h : int
        Column and row of the top left pixel, and size [px].
    n_pixels : int
        Number of pixels that look like a blinker.
    votes : float
        Fraction of the frames in which they do so, mean over these pixels, 0 .. 1.
    """

    x: int
    y: int
    w: int
    h: int
    n_pixels: int = 0
    votes: float = 0.0

    @property
    def box(self) -> Box:
        """Box of the region [px]."""
        return Box(self.x, self.y, self.w, self.h)


class RegionFinder:
    """Finder of the regions of one sensor; its memory is used again in every period.

    Parameters
    ----------
    settings : ReceiverSettings

    Attributes
    ----------
    n_bins : int
        Number of half frames per period.
    bin_us : float
        Length of a half frame [us].
    span : int
        Number of half frames per frame.
    n_frames : int
        Number of frames per period.
    min_votes : int
        Number of frames in which a kept pixel looks like a blinker.
    """

    def __init__(self, settings: ReceiverSettings) -> None:
        self.settings = settings
        n_pixels = settings.width * settings.height
        self._coder = EventCoder(settings.width, settings.height)
        self._marks = np.zeros(n_pixels, np.uint64)
        self._eights = np.zeros(n_pixels // 8 + 1, np.uint64)
        self._votes = self._eights.view(np.uint8)[:n_pixels]
        self._touched, self._crowded = np.empty(n_pixels + 1, np.int32), False
        self._kept = np.empty(n_pixels, np.int32)
        self._stack = np.empty(n_pixels, np.int32)
        # If a period holds more than 32 half frames (the paper's has 33), they are made a little longer.
        half_us = settings.delta_t_blinker_us / 2
        self.n_bins = min(MAX_BINS, max(1, int(np.ceil(settings.delta_t_whole_us / half_us))))
        self.bin_us = settings.delta_t_whole_us / self.n_bins
        self.span = max(1, min(self.n_bins, round(settings.delta_t_blinker_us / self.bin_us)))
        self.n_frames = self.n_bins - self.span + 1
        self.min_votes = max(1, int(np.ceil(settings.min_blink_fraction * self.n_frames)))

    def __call__(self, events: Events | CodedEvents, start_us: int) -> list[Region]:
        """Find the regions of one period.

        Parameters
        ----------
        events : ndarray of EVENT_DTYPE, shape (n,), or CodedEvents
            The events of the period.
        start_us : int
            Start of the period [us].

        Returns
        -------
        list of Region
            Up to `max_regions`, the one with the most votes first.

        Raises
        ------
        ValueError
            If events lie outside the sensor.
        """
        s = self.settings
        coded = self._coder(events)
        if s.frame_rule_blinker == "blink":
            n_kept = self._vote_blink(coded, start_us)
        else:
            n_kept = self._vote_frames(coded, start_us, s.frame_rule_blinker)
        if s.opening_px > 1:
            n_kept = open_squares(self._kept[:n_kept], self._votes, s.width, s.height, s.opening_px)
        boxes = components(
            self._kept[:n_kept], self._votes, self._eights, s.width, s.height, s.closing_px + 1, self._stack
        )
        return self._to_regions(boxes)

    def _vote_blink(self, coded: CodedEvents, start_us: int) -> int:
        """Fill in the votes by the rule "blink"; return the number of kept pixels."""
        s = self.settings
        cuts = coded.cuts(start_us + np.ceil(np.arange(self.n_bins + 1) * self.bin_us).astype(np.int64))
        cuts[0], cuts[-1] = 0, coded.events.size  # all events belong to the period, however its borders are rounded
        if self._crowded:  # cleared only now, because this brings the marks into the cache
            self._marks[:] = 0
        n_touched = _mark(coded.codes, cuts, self._marks, self._touched)
        n_asked = _ask(self._touched[:n_touched], self._marks, self._kept)
        n_kept: int = _keep(
            self._kept[:n_asked], self._marks, s.width, s.height, self.span, self.n_frames, self.min_votes, self._votes
        )
        self._crowded = n_touched > self._marks.size // CLEAR_ALL
        if not self._crowded:
            self._marks[self._touched[:n_touched]] = 0
        return n_kept

    def _vote_frames(self, coded: CodedEvents, start_us: int, rule: FrameRule) -> int:
        """Fill in the votes from the paper's 3-valued frames; return the number of kept pixels."""
        s = self.settings
        votes = np.zeros((s.height, s.width), np.uint8)
        for k in range(self.n_frames):
            first_us = start_us + int(np.ceil(k * self.bin_us))
            frame_events = coded.between(first_us, first_us + s.delta_t_blinker_us)
            votes += accumulate(frame_events, s.width, s.height, rule) != 0
        kept = np.flatnonzero(votes.ravel() >= self.min_votes)
        self._kept[: kept.size] = kept
        self._votes[kept] = votes.ravel()[kept]
        return kept.size

    def _to_regions(self, boxes: npt.NDArray[np.int64]) -> list[Region]:
        """Make regions from components, see `components.components`: drop small ones, merge those that overlap."""
        boxes = boxes[boxes[:, 4] >= self.settings.min_region_pixels]
        boxes = boxes[np.argsort(-boxes[:, 5], kind="stable")][: 4 * self.settings.max_regions]
        merged = merge_overlapping(boxes)
        merged = merged[np.argsort(-merged[:, 5], kind="stable")][: self.settings.max_regions]
        return [
            Region(int(x0), int(y0), int(x1 - x0 + 1), int(y1 - y0 + 1), int(n), float(v / (n * self.n_frames)))
            for x0, y0, x1, y1, n, v in merged
        ]


def find_regions(events: Events, start_us: int, settings: ReceiverSettings) -> list[Region]:
    """Find the regions of a single period; a `RegionFinder` is faster for many periods.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        The events of the period.
    start_us : int
        Start of the period [us].
    settings : ReceiverSettings

    Returns
    -------
    list of Region
        Up to `max_regions`, the one with the most votes first.
    """
    return RegionFinder(settings)(events, start_us)


@njit(cache=True, nogil=True)
def _mark(codes, cuts, marks, touched):  # type: ignore[no-untyped-def]
    """Set the bit of the half frame of each event in the mark of its pixel; list the pixels with events.

    ON and OFF have separate bits. `codes` are those of `event_codes`; half frame k is codes[cuts[k]:cuts[k + 1]].
    """
    n_touched = 0
    for k in range(cuts.size - 1):
        part, ahead = codes[cuts[k] : cuts[k + 1]], codes[cuts[k] + AHEAD :]
        for i in range(part.size):
            prefetch(marks, np.uint64(ahead[i]) >> ONE)
            code = np.uint64(part[i])
            pixel = code >> ONE
            mark = marks[pixel]
            touched[n_touched] = np.int32(pixel)
            n_touched += mark == np.uint64(0)
            marks[pixel] = mark | ONE << (np.uint64(k) + ON_SHIFT * (code & ONE))
    return n_touched


@njit(cache=True, nogil=True)
def _popcount(word):  # type: ignore[no-untyped-def]
    """Count the bits of a word that are 1."""
    word = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))


@njit(cache=True, nogil=True)
def _ask(touched, marks, asked):  # type: ignore[no-untyped-def]
    """List the pixels with events of their own in enough half frames; the others, which are most, are noise."""
    n_asked = 0
    for i in range(touched.size):
        prefetch(marks, np.uint64(touched[min(i + AHEAD, touched.size - 1)]))
        own = marks[np.uint64(touched[i])]
        asked[n_asked] = touched[i]
        n_asked += _popcount((own | own >> ON_SHIFT) & LOWER_HALF) >= MIN_HALF_FRAMES
    return n_asked


@njit(cache=True, nogil=True)
def _near(pixel, marks, width, height):  # type: ignore[no-untyped-def]
    """Combine the marks of the 3 x 3 neighbours of a pixel."""
    y, x = pixel // width, pixel % width
    near = np.uint64(0)
    if 0 < x < width - 1 and 0 < y < height - 1:
        for middle in range(pixel - width, pixel + 2 * width, width):
            near |= marks[np.uint64(middle - 1)] | marks[np.uint64(middle)] | marks[np.uint64(middle + 1)]
        return near
    for ny in range(max(y - 1, 0), min(y + 2, height)):
        for neighbour in range(ny * width + max(x - 1, 0), ny * width + min(x + 2, width)):
            near |= marks[neighbour]
    return near


@njit(cache=True, nogil=True)
def _keep(asked, marks, width, height, span, n_frames, min_votes, votes):  # type: ignore[no-untyped-def]
    """Count the votes of each candidate from the marks of its neighbours; those with enough come first in the list."""
    n_kept = 0
    in_period = LOWER_HALF >> np.uint64(32 - n_frames)
    for i in range(asked.size):
        pixel = asked[i]
        near = _near(pixel, marks, width, height)
        off, on = near & LOWER_HALF, near >> ON_SHIFT
        frames_off, frames_on = off, on
        for shift in range(1, span):
            frames_off |= off >> np.uint64(shift)
            frames_on |= on >> np.uint64(shift)
        n_votes = _popcount(frames_off & frames_on & in_period)
        if n_votes >= min_votes:
            votes[np.uint64(pixel)] = n_votes
            asked[n_kept] = pixel
            n_kept += 1
    return n_kept
