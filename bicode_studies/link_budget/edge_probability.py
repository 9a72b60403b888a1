"""Probability that each pixel fires at an edge of the LED: the first step of the link budget.

The light path and the pixels are those of `camera`: the plate's blurred image on a patch of pixels, and the closed form
of `camera.pixels`, run over some packets. The share of edges at which a pixel fires within a chip is its probability.
Each draw has its own pixel thresholds and its own place of the marker within a pixel. Both are fixed for a whole
recording and decide whether a distant marker is detected.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from bicode_lab.camera import PixelModel, Pose, Scene
from bicode_lab.camera.optics import ambient_signal
from bicode_lab.camera.patch import Patch
from bicode_lab.camera.pixel_steps import max_events
from bicode_lab.camera.pixels import SIDE_BY_SIDE, fire_lit_pixels, start_pixels
from bicode_lab.camera.plate_image import PlateImage
from bicode_lab.marker import Marker

Floats = npt.NDArray[np.float64]
Numbers = npt.NDArray[np.int64]

MOST_DRAWS = 48
MOST_PACKETS = 12
MOST_PIXELS = 4000  # near the camera more are lit; the others get the probability of the one nearest in contrast
MOST_WORK = 150_000  # draws times packets times simulated pixels: a fraction of a second
WORK_PER_DRAW = 12_000  # packets times simulated pixels in one draw
PLACES = [((2 * k + 1) / 16 - 0.5, (2 * (3 * k % 8) + 1) / 16 - 0.5) for k in range(8)]  # within a pixel [px]
WARM_UP_PACKETS = 1


@dataclass(frozen=True, eq=False)
class EdgeProbability:
    """How probably each pixel fires at an edge of the LED, for several draws of thresholds and place.

    Attributes
    ----------
    by_bin : ndarray, shape (draws, 2, bins, rows, columns)
        Probability that a pixel fires in a bin of delta_t_ID after an edge, 0 .. 1; on axis 1, 0 is OFF and 1 is ON.
        The edge lies anywhere in the first bin, at another place in each draw.
    contrast : float
        Highest log of lit over dark signal of any pixel.
    events : tuple of 2 floats
        Mean number of events of an OFF and of an ON edge, all pixels together.
    """

    by_bin: Floats
    contrast: float
    events: tuple[float, float]

    @property
    def by_edge(self) -> Floats:
        """Probability that a pixel fires within a chip of an edge, 0 .. 1, shape (draws, 2, rows, columns)."""
        return np.asarray(1 - (1 - self.by_bin).prod(axis=2))


def edge_probability(scene: Scene, delta_t_id_us: int, seed: int) -> EdgeProbability:
    """Simulate how probably the pixels that a scene's first marker lights fire at an edge of its LED.

    Parameters
    ----------
    scene : Scene
        Its first marker stands as it does at the start and is moved by up to half a pixel. Wall, lamps and readout
        are left out.
    delta_t_id_us : int
        Length of a bin of the receiver [us].
    seed : int
        Seed of thresholds, noise and the place of edges within a bin.

    Returns
    -------
    EdgeProbability

    Raises
    ------
    ValueError
        If the marker is not in view.
    """
    marker = replace(scene.markers[0].marker, rise_time_us=0.0)
    patch, shape = _lit_patch(scene)
    contrast = np.log1p(patch.glow[:, 0].astype(float) / patch.ambient)
    bins = int(np.ceil(marker.waveform.chip_us / delta_t_id_us)) + 1
    chosen = np.flatnonzero(contrast.max(0) > _least_contrast(scene.pixel_model))
    if not chosen.size:
        return EdgeProbability(np.zeros((1, 2, bins, *shape)), float(contrast.max()), (0.0, 0.0))
    simulated, stands_for = _pixels_to_simulate(chosen, contrast.max(0))
    n = simulated.size
    draws = int(np.clip(MOST_WORK // (n * MOST_PACKETS), 1, MOST_DRAWS))
    packets = int(np.clip(WORK_PER_DRAW // n, 2, MOST_PACKETS))
    rng = np.random.default_rng(seed)
    end_us = (packets + WARM_UP_PACKETS) * marker.packet_format.packet_us
    events = _fire(scene, patch, simulated, draws, end_us, rng)
    fired, rises, per_edge = _sort_by_edge(events, marker, scene.pixel_model, n, draws, end_us, delta_t_id_us, rng)
    by_bin = np.zeros((draws, 2, bins, shape[0] * shape[1]))
    for side in (0, 1):
        share = fired[rises == bool(side)].mean(0).reshape(bins, draws, n).swapaxes(0, 1)
        by_bin[:, side][:, :, chosen] = share[:, :, stands_for]
    off, on = (count * chosen.size / n for count in per_edge)
    return EdgeProbability(by_bin.reshape(draws, 2, bins, *shape), float(contrast.max()), (off, on))


def _pixels_to_simulate(chosen: Numbers, contrast: Floats) -> tuple[Numbers, Numbers]:
    """Pick pixels spread evenly over contrast; return them and, per chosen pixel, which of them stands for it."""
    order = np.argsort(contrast[chosen], kind="stable")
    step = -(-chosen.size // MOST_PIXELS)
    simulated = chosen[order[step // 2 :: step]]
    stands_for = np.empty(chosen.size, np.int64)
    stands_for[order] = np.minimum(np.arange(chosen.size) // step, simulated.size - 1)
    return simulated, stands_for


def _least_contrast(model: PixelModel) -> float:
    """Return the contrast below which a pixel fires at fewer than one edge in 700 (three standard deviations)."""
    return float(
        max(min(model.threshold_on, model.threshold_off) - 3 * np.hypot(model.threshold_spread, model.noise), 0)
    )


def _sort_by_edge(
    events: tuple[Numbers, Numbers, Floats], marker: Marker, model: PixelModel, n: int, draws: int, end_us: float,
    delta_t_id_us: int, rng: np.random.Generator,
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_], tuple[float, float]]:  # fmt: skip
    """Assign events (owner, polarity, time) to the edges that caused them.

    Returns
    -------
    fired : ndarray of bool, shape (edges, bins, draws * n)
        True where the pixel fired at the edge in the bin.
    rises : ndarray of bool, shape (edges,)
        True for ON edges.
    per_edge : tuple of 2 floats
        Mean number of events of an OFF and of an ON edge.
    """
    owner, polarity, t_us = events
    chip_us = marker.waveform.chip_us
    bins = int(np.ceil(chip_us / delta_t_id_us)) + 1
    times, levels = marker.waveform.steps(0, end_us)
    rises = np.append(levels[0] > 0, np.diff(levels) > 0)
    delay_us = np.where(polarity == 1, model.latency_on_us, model.latency_off_us)
    edge = np.searchsorted(times, t_us - delay_us, side="right") - 1
    behind_us = t_us - times[edge]
    counted = (times >= WARM_UP_PACKETS * marker.packet_format.packet_us) & (times <= end_us - chip_us)
    good = (rises[edge] == (polarity == 1)) & (behind_us - delay_us < chip_us) & counted[edge]
    phase_us = rng.uniform(0, delta_t_id_us, draws)[owner // n]
    at = np.minimum((behind_us + phase_us) // delta_t_id_us, bins - 1).astype(np.int64)
    fired = np.zeros((times.size, bins, draws * n), bool)
    fired[edge[good], at[good], owner[good]] = True
    counts = [int((good & (polarity == side)).sum()) for side in (0, 1)]
    off, on = (counts[side] / draws / max(int((counted & (rises == bool(side))).sum()), 1) for side in (0, 1))
    return fired[counted], rises[counted], (off, on)


def _lit_patch(scene: Scene) -> tuple[Patch, tuple[int, int]]:
    """Draw the pixels that the first marker lights, one map for each of PLACES; return also their rows and columns."""
    plate = PlateImage(scene.markers[0].marker, scene.optics, scene.light, scene.edge_glow)
    pose = scene.marker_pose(0, 0.0)
    pixel_m = pose.position_m[2] / scene.optics.focal_px
    poses = [Pose(pose.rotation, pose.position_m + [x * pixel_m, y * pixel_m, 0.0]) for x, y in PLACES]
    box = plate.reach(poses)
    if box.is_empty:
        raise ValueError(f"the marker at {pose.position_m.round(3).tolist()} m is not in view; put it before the lens")
    log_ambient = float(np.log(ambient_signal(scene.light, scene.optics) * scene.light.reflectance))
    return Patch.draw(box, [plate], [poses], log_ambient, None, []), (box.h, box.w)


def _fire(
    scene: Scene, patch: Patch, chosen: Numbers, draws: int, end_us: float, rng: np.random.Generator
) -> tuple[Numbers, Numbers, Floats]:
    """Simulate the given pixels of a patch; return the owner, the polarity and the time [us] of every event."""
    model = scene.pixel_model
    place = np.arange(draws) % len(PLACES)
    ambient = np.ascontiguousarray(patch.ambient[place][:, chosen].reshape(1, -1))
    glow = np.ascontiguousarray(patch.glow[place, 0][:, chosen].reshape(1, 1, -1))
    state = start_pixels(ambient[0], model, rng)
    index = np.arange(ambient.size, dtype=np.int32)
    edges, moments, levels, maps = replace(patch, ambient=ambient).schedule(np.array([0.0, end_us]))
    fixed = (index, ambient, glow, edges, moments, levels, maps, state.level, state.reference, state.free_us,
             state.threshold_on, state.threshold_off, np.uint64(rng.integers(2**63)), model.noise,
             model.time_constant_us, model.refractory_us, model.latency_on_us, model.latency_off_us)  # fmt: skip
    room = max(1 << 20, 2 * SIDE_BY_SIDE * max_events(edges, model.refractory_us))
    pixels, times = np.empty(room, np.uint32), np.empty(room)
    parts: list[tuple[npt.NDArray[np.uint32], Floats]] = []
    first = 0
    while first < index.size:
        first, count = fire_lit_pixels(first, *fixed, pixels, times, 0)
        parts.append((pixels[:count].copy(), times[:count].copy()))
    both = np.concatenate([part[0] for part in parts]).astype(np.int64)
    return both >> 1, both & 1, np.concatenate([part[1] for part in parts])
