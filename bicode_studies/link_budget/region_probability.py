"""Probability that the receiver finds a blinking region, and which box it gets: a step of the link budget.

The rule is that of `recognition.regions`. A pixel gets a vote from each delta_t_blinker frame of the period in which
the 3 x 3 pixels around it show both polarities, and is kept if it has votes from at least `min_blink_fraction` of the
frames. Kept pixels outside a full square of `opening_px` are dropped; the box surrounds the others.

The number of votes varies by chance and with the position of the packets in the period. Neighbouring pixels share most
of what they see, so one normal random number moves the votes of all pixels together. The expectation over this number
and over the position is taken as a sum over a few values of each.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from bicode_lab.marker import Marker
from bicode_lab.recognition import ReceiverSettings
from bicode_lab.recognition.regions import MIN_HALF_FRAMES, RegionFinder

Floats = npt.NDArray[np.float64]
Slices = tuple[slice, slice]

PACKET_POSITIONS = 7  # of the packets in the period
NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(5)
FAINTEST = 1e-3  # pixels that fire at a smaller share of edges make no difference to a box


class RegionProbability:
    """Work out which boxes a receiver finds for one marker, and how probably.

    What all pixels have in common is computed once, when the object is made.

    Parameters
    ----------
    marker : Marker
        Its packet sets how many edges a frame holds.
    receiver : ReceiverSettings
    """

    def __init__(self, marker: Marker, receiver: ReceiverSettings) -> None:
        self._receiver = receiver
        self._finder = RegionFinder(replace(receiver, width=1, height=1))
        self._pairs, self._frames = self._edges_of_frames(marker)

    def __call__(self, fires: Floats) -> list[tuple[float, Slices | None]]:
        """Return the boxes that may be found and their probabilities.

        Parameters
        ----------
        fires : ndarray, shape (2, rows, columns)
            Probability that a pixel fires at an OFF edge and at an ON edge, 0 .. 1.

        Returns
        -------
        list of (float, (slice, slice) or None)
            Probability, and rows and columns of the box, or None if no region is found. The probabilities add up to 1.
        """
        bright = np.nonzero(fires.max(0) > FAINTEST)
        if not bright[0].size:
            return [(1.0, None)]
        crop = tuple(slice(max(int(at.min()) - 1, 0), int(at.max()) + 2) for at in bright)
        votes, moments = self._votes(fires[:, crop[0], crop[1]])
        found: dict[tuple[int, ...] | None, float] = {}
        for position in range(PACKET_POSITIONS):
            for z, weight in zip(NODES, WEIGHTS / WEIGHTS.sum(), strict=True):
                blinks = votes[0][position] + z * votes[1][position] >= self._finder.min_votes - 0.5
                fires_often = moments[0][position] + z * moments[1][position] >= MIN_HALF_FRAMES - 0.5
                box = self._box(blinks & fires_often)
                found[box] = found.get(box, 0.0) + float(weight) / PACKET_POSITIONS
        y, x = crop[0].start, crop[1].start
        boxes: list[tuple[float, Slices | None]] = []
        for box, weight in found.items():
            placed = (slice(box[0] + y, box[1] + y), slice(box[2] + x, box[3] + x)) if box else None
            boxes.append((weight, placed))
        return boxes

    def _votes(self, fires: Floats) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Return mean and spread of a pixel's votes, and of the number of moments at which it fires itself.

        Each has shape (PACKET_POSITIONS, rows, columns).
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
        """Return rows (from, to) and columns (from, to) of the pixels left after the opening, or None."""
        side = self._receiver.opening_px
        if side > 1:
            kept = ndimage.binary_opening(kept, np.ones((side, side), bool))
        if kept.sum() < self._receiver.min_region_pixels:
            return None
        rows, columns = np.flatnonzero(kept.any(1)), np.flatnonzero(kept.any(0))
        return int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1

    def _edges_of_frames(self, marker: Marker) -> tuple[npt.NDArray[np.int64], Floats]:
        """Count the rises and falls of the LED in each frame of a period.

        Returns
        -------
        pairs : ndarray, shape (pairs, 2)
            The pairs (rises, falls) that occur.
        frames : ndarray, shape (PACKET_POSITIONS, pairs)
            Number of frames with each pair, for several positions of the packets in the period.
        """
        finder, packet_us = self._finder, marker.packet_format.packet_us
        frame_us = finder.span * finder.bin_us
        begins = (np.arange(PACKET_POSITIONS) + 0.5) / PACKET_POSITIONS * packet_us
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
