"""The part of the sensor that plates and lamps light, over a span of time.

A patch holds what the pixel kernel needs: the signal without LEDs and that of each LED at full level, once for every
step of what moves, and the LEDs' levels over time. Plates whose light overlaps on the sensor share a patch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bicode_lab.boxes import Box
from bicode_lab.camera.lamp import LampImage, Waveform
from bicode_lab.camera.motion import Floats, Pose
from bicode_lab.camera.pixel_steps import F4, F8, I4, I8
from bicode_lab.camera.pixels import NOISE_REACH, PixelModel, PixelState
from bicode_lab.camera.plate_image import PlateImage
from bicode_lab.camera.wall import Wall
from bicode_lab.camera.wall_pixels import look_up
from bicode_lab.kernels import njit


@dataclass(frozen=True, eq=False)
class Patch:
    """Pixels, their signal at every step of what moves, and the LEDs that light them.

    Parameters
    ----------
    index : ndarray of int32, shape (n,)
        Places of the pixels on the sensor, ``y * width + x``.
    ambient : ndarray of float32, shape (maps, n)
        Signal without the LEDs.
    glow : ndarray of float32, shape (maps, markers, n)
        Signal of each LED at full level.
    lowest, highest : ndarray of float32, shape (n,)
        Lowest and highest log signal over all maps and LED levels.
    last : ndarray of float32, shape (n,)
        Log signal at the end of the span with the LEDs off.
    waveforms : tuple of Waveform
        Light of each LED over time.
    """

    index: I4
    ambient: F4
    glow: F4
    lowest: F4
    highest: F4
    last: F4
    waveforms: tuple[Waveform, ...]

    @classmethod
    def draw(
        cls, box: Box, plates: list[PlateImage | LampImage], poses: list[list[Pose]], log_ambient: float,
        wall: Wall | None, views: list[Floats],
    ) -> Patch:  # fmt: skip
        """Draw the pixels of a box at every step of a span.

        Parameters
        ----------
        box : Box
        plates : list of PlateImage or LampImage
            Those whose light reaches the box.
        poses : list of lists of Pose
            Of each plate at every step, in camera axes.
        log_ambient : float
            Log signal of a wall of mean reflectance.
        wall : Wall, optional
        views : list of ndarray, shape (3, 3)
            Homography from pixels to points of the wall at every step; unused without a wall.

        Returns
        -------
        Patch
        """
        steps, shape = len(poses[0]), (box.h, box.w)
        ambient: F4 = np.empty((steps, *shape), np.float32)
        glow: F4 = np.empty((steps, len(plates), *shape), np.float32)
        rows, columns = np.mgrid[box.y : box.bottom, box.x : box.right]
        x, y = columns.ravel().astype(np.float64), rows.ravel().astype(np.float64)
        for s in range(steps):
            ambient[s] = np.float32(np.exp(log_ambient))
            if wall is not None:
                ambient[s] *= np.exp(look_up(wall.repeated, views[s], 0.0, x, y)).reshape(shape)
            for m, plate in enumerate(plates):
                lit, mask = plate.image(poses[m][s], box)
                ambient[s] += mask * (plate.dark_signal - ambient[s])
                np.multiply(lit, plate.full_signal, out=glow[s, m])
        ambient, glow = ambient.reshape(steps, -1), glow.reshape(steps, len(plates), -1)
        return cls(
            index=(rows * plates[0].sensor_width + columns).ravel().astype(np.int32),
            ambient=ambient,
            glow=glow,
            lowest=np.log(ambient.min(0)),
            highest=np.log((ambient + glow.sum(1)).max(0)),
            last=np.log(ambient[-1]),
            waveforms=tuple(plate.waveform for plate in plates),
        )

    def choose(self, state: PixelState, model: PixelModel) -> Patch:
        """Return the patch of the pixels that can reach a threshold; the level of the others settles on their signal.

        Parameters
        ----------
        state : PixelState
            Its levels are changed.
        model : PixelModel

        Returns
        -------
        Patch
        """
        margin = np.float32(NOISE_REACH * model.noise)
        chosen = _settle_or_choose(self.index, self.lowest, self.highest, self.last, state.reference,
                                   state.threshold_on, state.threshold_off, margin, state.level)  # fmt: skip
        if chosen.size == self.index.size:
            return self
        return Patch(
            self.index.take(chosen), self.ambient.take(chosen, axis=1), self.glow.take(chosen, axis=2),
            self.lowest.take(chosen), self.highest.take(chosen), self.last.take(chosen), self.waveforms,
        )  # fmt: skip

    def schedule(self, cuts: F8) -> tuple[F8, I8, F4, I4]:
        """Return when the light of the patch changes in a span, and what it is from then on.

        Parameters
        ----------
        cuts : ndarray of float64, shape (steps + 1,)
            Borders of the steps [us].

        Returns
        -------
        edges, moments, levels, maps : ndarray
            See `pixels.fire_lit_pixels`.
        """
        start, end = float(cuts[0]), float(cuts[-1])
        # Each packet holds an edge, so steps from one packet before the span on include the edge that began its light.
        steps = [wave.steps(start - wave.packet_us, end) for wave in self.waveforms]
        edges = np.unique(np.concatenate([cuts, *[times[times > start] for times, _ in steps]]))
        middles = (edges[:-1] + edges[1:]) / 2
        last = [np.searchsorted(times, middles, side="right") - 1 for times, _ in steps]
        levels = np.stack([lv[k] for (_, lv), k in zip(steps, last, strict=True)], axis=1)
        maps = np.minimum(np.searchsorted(cuts, middles, side="right") - 1, self.ambient.shape[0] - 1)
        # A stretch that continues from the span before keeps the noise of the moment at which it began.
        began = np.stack([times[k] for (times, _), k in zip(steps, last, strict=True)]).max(0)
        if self.ambient.shape[0] > 1:
            began = np.maximum(began, cuts[maps])
        moments = np.round(began * 16).astype(np.int64)
        return edges, moments, levels.astype(np.float32), maps.astype(np.int32)


@njit(cache=True)
def _settle_or_choose(index: I4, lowest: F4, highest: F4, last: F4, reference: F4, on: F4, off: F4, margin: np.float32,
                      level: F4) -> I8:  # fmt: skip
    """Return which pixels can reach a threshold, and set the level of the others to `last`."""
    chosen, n = np.empty(index.size, np.int64), 0
    for i in range(index.size):
        at = index[i]
        can_fire = (highest[i] - reference[at] > on[at] - margin) | (reference[at] - lowest[i] > off[at] - margin)
        level[at] = level[at] if can_fire else last[i]
        chosen[n] = i
        n += can_fire
    return chosen[:n]
