"""Where will the receiver see something blink?   odds of pixels at edges -> boxes, each with its probability

The rule is that of `recognition.regions`: a pixel gets a vote from each delta_t_blinker frame of the period in which
the 3 x 3 pixels around it show both polarities, and is kept with `min_blink_fraction` of them; kept pixels outside a
full square of `opening_px` are dropped, the others span the box.

How many votes a pixel gets scatters, by chance and with the place of the packets in the period. Neighbours share
most of what they see, so one normal number moves all of them together; it and the place are taken at a few values.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from bicode_lab.marker import Marker
from bicode_lab.recognition import ReceiverSettings
from bicode_lab.recognition.regions import LEAST_MOMENTS, RegionFinder

Floats = npt.NDArray[np.float64]
Slices = tuple[slice, slice]

PLACES_IN_A_PERIOD = 7
NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(5)
FAINTEST = 1e-3  # pixels that fire less often than at one edge in so many make no difference to a box


class RegionOdds:
    """What a marker and a receiver have in common for all pixels, made once.

    Parameters
    ----------
    marker : Marker
        Its payload sets how many edges a frame holds.
    receiver : ReceiverSettings
    """

    def __init__(self, marker: Marker, receiver: ReceiverSettings) -> None:
        self._receiver = receiver
        self._finder = RegionFinder(replace(receiver, width=1, height=1))
        self._pairs, self._frames = self._edges_of_frames(marker)

    def __call__(self, fires: Floats) -> list[tuple[float, Slices | None]]:
        """Odds of an OFF and an ON edge, shape (2, rows, columns), in; boxes and their probabilities (sum 1) out.

        A box is rows and columns; None where no region is found.
        """
        bright = np.nonzero(fires.max(0) > FAINTEST)
        if not bright[0].size:
            return [(1.0, None)]
        crop = tuple(slice(max(int(at.min()) - 1, 0), int(at.max()) + 2) for at in bright)
        votes, moments = self._votes(fires[:, crop[0], crop[1]])
        found: dict[tuple[int, ...] | None, float] = {}
        for place in range(PLACES_IN_A_PERIOD):
            for z, weight in zip(NODES, WEIGHTS / WEIGHTS.sum(), strict=True):
                blinks = votes[0][place] + z * votes[1][place] >= self._finder.min_votes - 0.5
                speaks = moments[0][place] + z * moments[1][place] >= LEAST_MOMENTS - 0.5
                box = self._box(blinks & speaks)
                found[box] = found.get(box, 0.0) + float(weight) / PLACES_IN_A_PERIOD
        y, x = crop[0].start, crop[1].start
        boxes: list[tuple[float, Slices | None]] = []
        for box, weight in found.items():
            placed = (slice(box[0] + y, box[1] + y), slice(box[2] + x, box[3] + x)) if box else None
            boxes.append((weight, placed))
        return boxes

    def _votes(self, fires: Floats) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Odds in; mean and spread of a pixel's votes, and of the moments at which it fires itself, out.

        Each has shape (PLACES_IN_A_PERIOD, rows, columns).
        """
        logs = np.log(1 - np.minimum(fires, 1 - 1e-9))
        off, on = np.exp(np.minimum(9 * ndimage.uniform_filter(logs, (0, 3, 3), mode="constant"), 0.0))
        vote = np.stack([(1 - on**n_on) * (1 - off**n_off) for n_on, n_off in self._pairs])
        # Frames overlap `span` times: as many votes go together, and an edge is in as many frames.
        span = self._finder.span
        spread = np.sqrt(span * np.tensordot(self._frames, vote * (1 - vote), 1))
        edges = (self._frames @ self._pairs)[:, ::-1] / span  # falls, rises
        moments = np.tensordot(edges, fires, 1)
        scatter = np.sqrt(np.tensordot(edges, fires * (1 - fires), 1))
        return (np.tensordot(self._frames, vote, 1), spread), (moments, scatter)

    def _box(self, kept: npt.NDArray[np.bool_]) -> tuple[int, ...] | None:
        """Kept pixels in, first and last row and column of what is left of them after the opening, or None, out."""
        side = self._receiver.opening_px
        if side > 1:
            kept = ndimage.binary_opening(kept, np.ones((side, side), bool))
        if kept.sum() < self._receiver.min_region_pixels:
            return None
        rows, columns = np.flatnonzero(kept.any(1)), np.flatnonzero(kept.any(0))
        return int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1

    def _edges_of_frames(self, marker: Marker) -> tuple[npt.NDArray[np.int64], Floats]:
        """A marker in; the pairs of rises and falls that a frame may hold, and how many frames hold each, out.

        Returns
        -------
        pairs : ndarray, shape (pairs, 2)
        frames : ndarray, shape (PLACES_IN_A_PERIOD, pairs)
            For packets at several places in the period.
        """
        finder, packet_us = self._finder, marker.packet_format.packet_us
        frame_us = finder.span * finder.bin_us
        begins = (np.arange(PLACES_IN_A_PERIOD) + 0.5) / PLACES_IN_A_PERIOD * packet_us
        starts = begins[:, None] + np.arange(finder.n_frames) * finder.bin_us
        wave = replace(marker, rise_time_us=0.0, clock_error_ppm=0.0, phase_us=0.0).waveform
        times, levels = wave.steps(0, float(starts.max()) + frame_us + packet_us)
        times, rising = times[1:], levels[1:] > 0
        counts = [
            np.searchsorted(times[side], starts + frame_us) - np.searchsorted(times[side], starts)
            for side in (rising, ~rising)
        ]
        pairs, which = np.unique(np.stack(counts, -1).reshape(-1, 2), axis=0, return_inverse=True)
        which = which.reshape(starts.shape)
        frames = np.stack([np.bincount(row, minlength=len(pairs)) for row in which]).astype(float)
        return pairs.astype(np.int64), frames
