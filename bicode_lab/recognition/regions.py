"""Fig. 2 d, e, f, first half: where does something blink?   events of one period -> boxes

The paper looks for bright spots in a frame of delta_t_blinker = 2 ms, "slightly higher than
the blinking duration". One such frame in 33 ms misses a marker whose off time it hits, so
the frame slides over the whole period in steps of half its length, and every pixel collects
votes: the frames in which it looked like a blinker.

What a blinker does: every bit switches, so inside the data each frame of two bits holds an
ON and an OFF edge, whatever the ID; only the start is quiet. 31 frames of a period hold about
21 such, 68 %. What clutter does: a texture's edge passes a pixel with a few events of one
polarity; a hot pixel fires some 4 times in a period, alone. Hence the vote of rule "blink":
both polarities within a pixel's 3 x 3 neighbours within one frame. It counts ON and OFF side
by side and never their difference, so a balanced sensor cannot hide a marker. A pixel is kept
where its votes reach `min_blink_fraction` of the frames: 30 % leaves a far marker, whose
pixels miss many edges, the larger half of what it should show. The other rules vote where the
3-valued frame is not zero, as in the paper.

Morphology: kept pixels that lie in no full square of `opening_px` are dropped (opening; off
unless asked for, as it costs the farthest markers); those with no more than `closing_px` dark
ones between them are one region (closing, then connected components); regions of fewer than
`min_region_pixels` are dropped; regions whose boxes overlap are one (the islands inside a near
marker's ring).

All costs follow the events: a pass over them writes, per pixel, one bit per half frame, and
only pixels that were touched are looked at again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit

from bicode_lab.events import Events, slice_time, words
from bicode_lab.recognition.accumulate import accumulate
from bicode_lab.recognition.settings import FrameRule, ReceiverSettings

MAX_BINS = 32  # half frames of a period: bits of half a word
ON_SHIFT = np.uint64(32)  # the upper half of a pixel's word is for ON, the lower for OFF
LOWER_HALF = np.uint64(0xFFFFFFFF)
LOW_16 = np.uint64(0xFFFF)
LEAST_MOMENTS = 3  # half frames with an event of the pixel's own
CLEAR_ALL = 16  # where more than this part of the pixels was touched, all are cleared at once


@dataclass(frozen=True)
class Region:
    """A box in one period in which something blinks.

    Parameters
    ----------
    x, y, w, h : int
        Top left pixel and size [px].
    n_pixels : int
        Pixels that look like a blinker.
    votes : float
        Mean over them of the share of frames they did so in, 0 .. 1.
    """

    x: int
    y: int
    w: int
    h: int
    n_pixels: int = 0
    votes: float = 0.0


class RegionFinder:
    """Memory for one sensor's bit marks, made once and used period after period.

    Parameters
    ----------
    settings : ReceiverSettings
    """

    def __init__(self, settings: ReceiverSettings) -> None:
        self.settings = settings
        n_pixels = settings.width * settings.height
        self._marks = np.zeros(n_pixels, np.uint64)
        self._votes = np.zeros(n_pixels, np.uint8)
        self._touched = np.empty(n_pixels + 1, np.int32)
        self._kept = np.empty(n_pixels, np.int32)
        self._stack = np.empty(n_pixels, np.int32)
        # Half frames; where a period has more than 32 (the paper's has 33), they are a little longer.
        half_us = settings.delta_t_blinker_us / 2
        self.n_bins = min(MAX_BINS, max(1, int(np.ceil(settings.delta_t_whole_us / half_us))))
        self.bin_us = settings.delta_t_whole_us / self.n_bins
        self.span = max(1, min(self.n_bins, round(settings.delta_t_blinker_us / self.bin_us)))
        self.n_frames = self.n_bins - self.span + 1
        self.min_votes = max(1, int(np.ceil(settings.min_blink_fraction * self.n_frames)))

    def __call__(self, events: Events, start_us: int) -> list[Region]:
        """The events of one period in, its regions out, those of most pixels first.

        Parameters
        ----------
        events : ndarray of EVENT_DTYPE, shape (n,)
        start_us : int
            The period's start [us].

        Returns
        -------
        list of Region
        """
        s = self.settings
        if s.frame_rule_blinker == "blink":
            n_kept = self._vote_blink(events, start_us)
        else:
            n_kept = self._vote_frames(events, start_us, s.frame_rule_blinker)
        if s.opening_px > 1:
            n_kept = _open(self._kept[:n_kept], self._votes, s.width, s.height, s.opening_px)
        boxes = _components(self._kept[:n_kept], self._votes, s.width, s.height, s.closing_px + 1, self._stack)
        return self._to_regions(boxes)

    def _vote_blink(self, events: Events, start_us: int) -> int:
        """Fill the votes by rule "blink"; return how many pixels are kept."""
        s = self.settings
        ends = start_us + np.ceil(np.arange(1, self.n_bins + 1) * self.bin_us).astype(np.int64)
        n_touched, outside = _mark(words(events), ends, s.width, s.height, self._marks, self._touched)
        if outside:
            self._marks[:] = 0
            raise ValueError(
                f"{outside} of {events.size} events lie outside the {s.width} x {s.height} px sensor "
                f"(largest x {events['x'].max()}, y {events['y'].max()}); give the recording's width and height"
            )
        touched = self._touched[:n_touched]
        n_kept: int = _keep(
            touched, self._marks, s.width, s.height, self.span, self.n_frames, self.min_votes, self._votes, self._kept
        )
        if n_touched > self._marks.size // CLEAR_ALL:
            self._marks[:] = 0
        else:
            self._marks[touched] = 0
        return n_kept

    def _vote_frames(self, events: Events, start_us: int, rule: FrameRule) -> int:
        """Fill the votes by the paper's 3-valued frames; return how many pixels are kept."""
        s = self.settings
        votes = np.zeros((s.height, s.width), np.uint8)
        for k in range(self.n_frames):
            first_us = start_us + int(np.ceil(k * self.bin_us))
            frame_events = slice_time(events, first_us, first_us + s.delta_t_blinker_us)
            votes += accumulate(frame_events, s.width, s.height, rule) != 0
        kept = np.flatnonzero(votes.ravel() >= self.min_votes)
        self._kept[: kept.size] = kept
        self._votes[kept] = votes.ravel()[kept]
        return kept.size

    def _to_regions(self, boxes: npt.NDArray[np.int64]) -> list[Region]:
        """Components in, as x0 y0 x1 y1 pixels votes; regions out."""
        boxes = boxes[boxes[:, 4] >= self.settings.min_region_pixels]
        boxes = boxes[np.argsort(-boxes[:, 5], kind="stable")][: 4 * self.settings.max_regions]
        merged = _merge_overlapping(boxes)
        merged = merged[np.argsort(-merged[:, 5], kind="stable")][: self.settings.max_regions]
        return [
            Region(int(x0), int(y0), int(x1 - x0 + 1), int(y1 - y0 + 1), int(n), float(v / (n * self.n_frames)))
            for x0, y0, x1, y1, n, v in merged
        ]


def find_regions(events: Events, start_us: int, settings: ReceiverSettings) -> list[Region]:
    """The events of one period in, the boxes in which something blinks out; `RegionFinder` for one period."""
    return RegionFinder(settings)(events, start_us)


@njit(cache=True)
def _mark(events, ends, width, height, marks, touched):  # type: ignore[no-untyped-def]
    """Set the bit of its half frame at each event's pixel, ON and OFF apart; list the pixels touched.

    `events` are words, see `events.words`.
    """
    n_touched = 0
    outside = 0
    k = 0
    bit = np.uint64(1)
    last = ends.size - 1
    for i in range(events.shape[0]):
        while events[i, 1] >= ends[k] and k < last:
            k += 1
            bit = bit << np.uint64(1)
        word = np.uint64(events[i, 0])
        x, y = word & LOW_16, (word >> np.uint64(16)) & LOW_16
        if x >= np.uint64(width) or y >= np.uint64(height):
            outside += 1
            continue
        pixel = y * np.uint64(width) + x
        mark = marks[pixel]
        touched[n_touched] = np.int32(pixel)
        n_touched += mark == np.uint64(0)
        marks[pixel] = mark | (bit << ON_SHIFT if (word >> ON_SHIFT) & np.uint64(1) else bit)
    return n_touched, outside


@njit(cache=True)
def _popcount(word):  # type: ignore[no-untyped-def]
    word = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))


@njit(cache=True)
def _keep(touched, marks, width, height, span, n_frames, min_votes, votes, kept):  # type: ignore[no-untyped-def]
    """Votes of each touched pixel from its 3 x 3 neighbours' marks; list the pixels with enough."""
    n_kept = 0
    in_period = LOWER_HALF >> np.uint64(32 - n_frames)
    for i in range(touched.size):
        pixel = touched[i]
        own = marks[pixel]
        if _popcount((own | own >> ON_SHIFT) & LOWER_HALF) < LEAST_MOMENTS:
            continue  # noise, and most of what is touched in a noisy period
        y, x = pixel // width, pixel % width
        near = np.uint64(0)
        for ny in range(max(y - 1, 0), min(y + 2, height)):
            for neighbour in range(ny * width + max(x - 1, 0), ny * width + min(x + 2, width)):
                near |= marks[neighbour]
        off, on = near & LOWER_HALF, near >> ON_SHIFT
        frames_off, frames_on = off, on
        for shift in range(1, span):
            frames_off |= off >> np.uint64(shift)
            frames_on |= on >> np.uint64(shift)
        n_votes = _popcount(frames_off & frames_on & in_period)
        if n_votes >= min_votes:
            votes[pixel] = n_votes
            kept[n_kept] = pixel
            n_kept += 1
    return n_kept


@njit(cache=True)
def _open(kept, votes, width, height, side):  # type: ignore[no-untyped-def]
    """Kept pixels in, those that lie in a full square of kept ones stay first in the list; their number out."""
    stays = np.zeros(kept.size, np.bool_)
    for i in range(kept.size):
        y, x = kept[i] // width, kept[i] % width
        for y0 in range(max(y - side + 1, 0), min(y, height - side) + 1):
            for x0 in range(max(x - side + 1, 0), min(x, width - side) + 1):
                full = True
                for ny in range(y0, y0 + side):
                    for nx in range(x0, x0 + side):
                        full &= votes[ny * width + nx] > 0
                if full:
                    stays[i] = True
    n_kept = 0
    for i in range(kept.size):
        if stays[i]:
            kept[n_kept] = kept[i]
            n_kept += 1
        else:
            votes[kept[i]] = 0
    return n_kept


@njit(cache=True)
def _components(kept, votes, width, height, reach, stack):  # type: ignore[no-untyped-def]
    """Kept pixels in; x0 y0 x1 y1 pixels votes of each group of pixels no more than `reach` apart out.

    Empties `votes` on the way, which serves as the mark of a pixel not yet in a group.
    """
    boxes = np.empty((kept.size, 6), np.int64)
    n_boxes = 0
    for i in range(kept.size):
        if votes[kept[i]] == 0:
            continue
        x0, y0, x1, y1, n_pixels, n_votes = width, height, 0, 0, 0, 0
        stack[0] = kept[i]
        n_votes += votes[kept[i]]
        votes[kept[i]] = 0
        n_stack = 1
        while n_stack:
            n_stack -= 1
            y, x = stack[n_stack] // width, stack[n_stack] % width
            n_pixels += 1
            x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x), max(y1, y)
            for ny in range(max(y - reach, 0), min(y + reach + 1, height)):
                for neighbour in range(ny * width + max(x - reach, 0), ny * width + min(x + reach + 1, width)):
                    if votes[neighbour]:
                        n_votes += votes[neighbour]
                        votes[neighbour] = 0
                        stack[n_stack] = neighbour
                        n_stack += 1
        boxes[n_boxes] = (x0, y0, x1, y1, n_pixels, n_votes)
        n_boxes += 1
    return boxes[:n_boxes]


@njit(cache=True)
def _merge_overlapping(boxes):  # type: ignore[no-untyped-def]
    """Boxes as x0 y0 x1 y1 pixels votes in; those that overlap joined, until none do, out."""
    merged = boxes.copy()
    n = merged.shape[0]
    i = 0
    while i < n:
        grown = False
        j = i + 1
        while j < n:
            a, b = merged[i], merged[j]
            if a[0] <= b[2] and b[0] <= a[2] and a[1] <= b[3] and b[1] <= a[3]:
                a[0], a[1] = min(a[0], b[0]), min(a[1], b[1])
                a[2], a[3] = max(a[2], b[2]), max(a[3], b[3])
                a[4] += b[4]
                a[5] += b[5]
                n -= 1
                merged[j] = merged[n]
                grown = True
            else:
                j += 1
        i = 0 if grown else i + 1
    return merged[:n]
