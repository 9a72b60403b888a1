"""Measure the background noise of a recording in the parts of the picture where little happens.

Blocks of 20 x 20 pixels are ranked by their number of events in the first half of the recording. The noise of the
quieter half of the blocks is measured in the second half. So the events that are counted do not decide which blocks
count as quiet.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from bicode_lab.events import Events

BLOCK_PX = 20
PAIR_US = 10_000.0  # events of one pixel closer than this count as a pair
HOT_HZ = 1.0  # a pixel with a higher event rate counts as hot

WHERE_FROM = (
    "The recording is evk4_scene_evt3.raw, an EVK4 in front of a general scene. Put it into the folder of recordings."
)
"""Where to get the recording that the noise of the generator is compared with."""


@dataclass(frozen=True, kw_only=True, eq=False)
class QuietNoise:
    """Noise of the quiet blocks in the second half of a recording.

    Parameters
    ----------
    seconds : float
        Length of that half [s].
    block_hz : ndarray, shape (blocks,)
        Event rate per pixel, mean over each quiet block [Hz].
    pixel_counts : ndarray of int, shape (pixels,)
        Number of events of each pixel of the quiet blocks.
    off_share : float
        Share of OFF events among all events, 0 .. 1.
    lone_off_share : float
        Share of OFF events among those of pixels with one event only, 0 .. 1.
    intervals_us : ndarray of int, shape (n,)
        Times between successive events of the same pixel [us].
    """

    seconds: float
    block_hz: npt.NDArray[np.float64]
    pixel_counts: npt.NDArray[np.int64]
    off_share: float
    lone_off_share: float
    intervals_us: npt.NDArray[np.int64]

    def share_above(self, counts: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return the share of pixels that have at least a given number of events.

        Parameters
        ----------
        counts : array_like
            Numbers of events.

        Returns
        -------
        ndarray
            Shares, 0 .. 1; shape of `counts`.
        """
        ranked = np.sort(self.pixel_counts)
        return 1 - np.searchsorted(ranked, np.asarray(counts), side="left") / ranked.size


def measure_noise(events: Events, width: int, height: int) -> QuietNoise:
    """Measure the noise of the quiet blocks of a recording.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        The whole recording, in the order of time.
    width, height : int
        Sensor size [px].

    Returns
    -------
    QuietNoise

    Raises
    ------
    ValueError
        If there are no events, or the sensor is smaller than a block.
    """
    if not events.size or min(width, height) < BLOCK_PX:
        raise ValueError(
            f"{events.size} events on {width} x {height} px: to measure noise takes events and a sensor of "
            f"{BLOCK_PX} px or more in each direction"
        )
    start, end = int(events["t"][0]), int(events["t"][-1]) + 1
    middle = (start + end) // 2
    across, down = width // BLOCK_PX, height // BLOCK_PX
    inside = (events["x"] < across * BLOCK_PX) & (events["y"] < down * BLOCK_PX)
    early, late = events[inside & (events["t"] < middle)], events[inside & (events["t"] >= middle)]
    first_counts = np.bincount(_block(early, across), minlength=across * down)
    quiet = first_counts <= np.median(first_counts)
    seconds = (end - middle) * 1e-6
    block_hz = np.bincount(_block(late, across), minlength=across * down)[quiet] / (BLOCK_PX**2 * seconds)
    chosen = late[quiet[_block(late, across)]]
    pixel = chosen["y"].astype(np.int64) * width + chosen["x"]
    counts = np.bincount(pixel, minlength=width * height)
    judged = np.zeros((height, width), bool)
    whole = np.ones((BLOCK_PX, BLOCK_PX), bool)
    judged[: down * BLOCK_PX, : across * BLOCK_PX] = np.kron(quiet.reshape(down, across), whole)
    order = np.lexsort((chosen["t"], pixel))
    same = np.diff(pixel[order]) == 0
    off = chosen["p"] == 0
    return QuietNoise(
        seconds=seconds, block_hz=block_hz,
        pixel_counts=counts[judged.ravel()],
        off_share=_share(off), lone_off_share=_share(off[counts[pixel] == 1]),
        intervals_us=np.diff(chosen["t"][order])[same],
    )  # fmt: skip


def noise_table(noises: Mapping[str, QuietNoise]) -> pd.DataFrame:
    """Tabulate noise statistics: one column per recording, one row per statistic.

    Parameters
    ----------
    noises : mapping of str to QuietNoise
        Noise by name of the recording.

    Returns
    -------
    DataFrame
        Statistics; the labels of the rows state their units.
    """
    return pd.DataFrame({name: _figures(noise) for name, noise in noises.items()})


def _figures(noise: QuietNoise) -> dict[str, float]:
    """Return the statistics of one recording by name."""
    counts, intervals = noise.pixel_counts, noise.intervals_us
    return {
        "rate per pixel, median over blocks (Hz)": float(np.median(noise.block_hz)),
        "rate per pixel, mean (Hz)": float(counts.mean() / noise.seconds),
        "share of OFF": noise.off_share,
        "share of OFF, pixels with one event": noise.lone_off_share,
        "variance over mean of a pixel's events": float(counts.var() / max(counts.mean(), 1e-12)),
        f"pixels above {HOT_HZ:g} Hz (per million)": float((counts / noise.seconds > HOT_HZ).mean() * 1e6),
        "rate of the fastest pixel (Hz)": float(counts.max() / noise.seconds),
        f"share of intervals below {PAIR_US / 1e3:g} ms": _share(intervals < PAIR_US),
        "interval, median (ms)": float(np.median(intervals) / 1e3) if intervals.size else float("nan"),
    }


def _block(events: Events, across: int) -> npt.NDArray[np.int64]:
    """Return the number of the block in which each event lies."""
    return np.asarray(events["y"].astype(np.int64) // BLOCK_PX * across + events["x"] // BLOCK_PX)


def _share(true: npt.NDArray[np.bool_]) -> float:
    """Return the share of true values; nan where there are no values."""
    return float(true.mean()) if true.size else float("nan")
