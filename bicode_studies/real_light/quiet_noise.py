"""What pixels say when nothing happens.   events of any recording -> noise of its quiet blocks

Blocks of 20 x 20 pixels are ranked by their events in the first half of the recording; the quieter half of them is
judged in the second half. So no block is called quiet for events that are then counted.
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
HOT_HZ = 1.0  # a pixel that fires oftener by itself

WHERE_FROM = (
    "The recording is evk4_scene_evt3.raw, an EVK4 in front of a general scene. Put it into the folder of recordings."
)
"""Where to get the recording that the noise is compared with."""


@dataclass(frozen=True, kw_only=True, eq=False)
class QuietNoise:
    """Noise of the quiet blocks, in the second half of a recording.

    Parameters
    ----------
    seconds : float
        Length of that half.
    block_hz : ndarray, shape (blocks,)
        Rate of a pixel, mean over each quiet block [Hz].
    pixel_counts : ndarray, shape (pixels,)
        Events of each pixel of them.
    off_share : float
        OFF among all events; of pixels with one event only it is `lone_off_share`.
    lone_off_share : float
    intervals_us : ndarray
        Between two events of one pixel, where it has two [us].
    """

    seconds: float
    block_hz: npt.NDArray[np.float64]
    pixel_counts: npt.NDArray[np.int64]
    off_share: float
    lone_off_share: float
    intervals_us: npt.NDArray[np.int64]

    def share_above(self, counts: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Numbers of events in, the share of pixels with as many or more out, same shape."""
        ranked = np.sort(self.pixel_counts)
        return 1 - np.searchsorted(ranked, np.asarray(counts), side="left") / ranked.size


def noise_of(events: Events, width: int, height: int) -> QuietNoise:
    """A recording, sorted by time, and its sensor in [px]; the noise of its quiet blocks out.

    Raises
    ------
    ValueError
        No events, or a sensor smaller than a block.
    """
    if not events.size or min(width, height) < BLOCK_PX:
        raise ValueError(
            f"{events.size} events on {width} x {height} px: noise takes events, and {BLOCK_PX} px either way"
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
    """Noises by name in; a column for each, what they are like in rows, out."""
    return pd.DataFrame({name: _figures(noise) for name, noise in noises.items()})


def _figures(noise: QuietNoise) -> dict[str, float]:
    """One noise in, its figures by name out."""
    counts, intervals = noise.pixel_counts, noise.intervals_us
    return {
        "rate of a pixel, median over blocks (Hz)": float(np.median(noise.block_hz)),
        "rate of a pixel, mean (Hz)": float(counts.mean() / noise.seconds),
        "share of OFF": noise.off_share,
        "share of OFF, pixels with one event": noise.lone_off_share,
        "variance over mean of a pixel's events": float(counts.var() / max(counts.mean(), 1e-12)),
        f"pixels above {HOT_HZ:g} Hz (of a million)": float((counts / noise.seconds > HOT_HZ).mean() * 1e6),
        "rate of the fastest pixel (Hz)": float(counts.max() / noise.seconds),
        f"share of intervals below {PAIR_US / 1e3:g} ms": _share(intervals < PAIR_US),
        "interval, median (ms)": float(np.median(intervals) / 1e3) if intervals.size else float("nan"),
    }


def _block(events: Events, across: int) -> npt.NDArray[np.int64]:
    """Events in, the number of the block of each out."""
    return np.asarray(events["y"].astype(np.int64) // BLOCK_PX * across + events["x"] // BLOCK_PX)


def _share(true: npt.NDArray[np.bool_]) -> float:
    """How many are true, of all; nan where there are none."""
    return float(true.mean()) if true.size else float("nan")
