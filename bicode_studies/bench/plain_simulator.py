"""The pixel of `bicode_lab.camera.pixels` simulated frame by frame in NumPy, to be measured against.

What most simulators do: the light is sampled in frames (here every 100 us), the low-pass and the
noise take a step a frame, and a pixel that has moved by k thresholds since its last reset fires k
times, spread evenly over the frame. All pixels at once, no loop over pixels or events.
"""

from __future__ import annotations

import numpy as np

from bicode_lab.camera import PixelModel
from bicode_lab.events import make_events


def simulate(dark, glow, waveform, model: PixelModel, duration_us: int, rng, frame_us: float = 100.0):
    """Signal without and with the LED, shape (rows, columns), and the LED in time in; events by frames out."""
    shape = dark.shape
    level = np.log(dark)
    reference = level.copy()
    on = np.maximum(rng.normal(model.threshold_on, model.threshold_spread, shape), 0.05)
    off = np.maximum(rng.normal(model.threshold_off, model.threshold_spread, shape), 0.05)
    noise = rng.standard_normal(shape) * model.noise
    free = np.full(shape, -np.inf)
    frames = []
    starts = np.arange(0, duration_us, frame_us)
    times, levels = waveform.steps(0, duration_us)
    lit = levels[np.searchsorted(times, starts + frame_us / 2, side="right") - 1]
    for start, share in zip(starts, lit, strict=True):
        signal = dark + glow * share
        kept = np.exp(-frame_us * signal / model.time_constant_us)
        noise = noise * kept + rng.standard_normal(shape) * (model.noise * np.sqrt(1 - kept * kept))
        level = np.log(signal) + (level - np.log(signal)) * kept
        moved = level + noise - reference
        count = np.where(moved > 0, np.floor(moved / on), -np.floor(-moved / off)).astype(np.int64)
        frames.append(_fire(start, frame_us, count, free, model))
        reference += np.where(count > 0, count * on, count * off)
        frames.append(_background(start, frame_us, shape, model, rng))
    columns = [np.concatenate(c) for c in zip(*frames, strict=True)]
    return make_events(*columns)


def _fire(start, frame_us, count, free, model):
    """How often each pixel fires in the frame in; x, y, p, t of those events out that fall behind its dead time."""
    y, x = np.nonzero(count)
    number = count[y, x]
    found = []
    for k in range(int(np.abs(number).max()) if number.size else 0):
        still = np.abs(number) > k
        t = start + (k + 1) * frame_us / (np.abs(number[still]) + 1)
        rows, columns = y[still], x[still]
        ready = t >= free[rows, columns]
        t, rows, columns, up = t[ready], rows[ready], columns[ready], number[still][ready] > 0
        free[rows, columns] = t + model.refractory_us
        t = t + np.where(up, model.latency_on_us, model.latency_off_us)
        found.append((columns, rows, up, t))
    if not found:
        return _nothing()
    columns = [np.concatenate(c) for c in zip(*found, strict=True)]
    order = np.argsort(columns[3], kind="stable")
    return [c[order] for c in columns]


def _background(start, frame_us, shape, model, rng):
    """Events that nothing made."""
    n = rng.poisson(model.background_hz * shape[0] * shape[1] * frame_us * 1e-6)
    if not n:
        return _nothing()
    return [
        rng.integers(shape[1], size=n), rng.integers(shape[0], size=n),
        rng.random(n) >= model.background_off_share, start + rng.random(n) * frame_us,
    ]  # fmt: skip


def _nothing():
    return [np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, bool), np.zeros(0)]
