"""Make the events of a plate of a few pixels under any light, by a sensor of its own, not the project's camera.

A pixel follows the logarithm of its light through a low-pass in small steps of time, and fires whenever it is a
threshold away from its last reference. This is the textbook pixel of Lichtsteiner, solved step by step; thresholds,
latency, jitter, refractory period, noise and stray events are drawn for each light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events, make_events
from bicode_lab.kernels import njit

Floats = npt.NDArray[np.float64]
SAMPLE_US = 2.0
THRESHOLD = 0.25  # of the log light


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Pixels of a plate and what they add to the light.

    Parameters
    ----------
    n_pixels : int
        Pixels that see the light.
    events_per_edge : float
        Events that an edge from dark to full makes, over all pixels: it sets the contrast.
    low_pass_us : float
        Time constant of the pixels [us].
    latency_on_us, latency_off_us : float
        Delay of ON and OFF events [us].
    jitter_us : float
        Standard deviation of each event's delay [us].
    edge_jitter_us : float
        Standard deviation of the delay that all events within 100 us share [us].
    refractory_us : float
        Time after an event in which a pixel is blind [us].
    spread : float
        Standard deviation of thresholds, as a share.
    noise : float
        Standard deviation of the log light from sample to sample after the low-pass, in thresholds.
    stray_hz : float
        Stray events per second, over all pixels [Hz].
    """

    n_pixels: int = 9
    events_per_edge: float = 10.0
    low_pass_us: float = 30.0
    latency_on_us: float = 20.0
    latency_off_us: float = 30.0
    jitter_us: float = 10.0
    edge_jitter_us: float = 0.0
    refractory_us: float = 20.0
    spread: float = 0.1
    noise: float = 0.05
    stray_hz: float = 100.0


def see(level: Floats, sensor: Sensor, rng: np.random.Generator) -> Events:
    """Return the events of a plate whose light has some levels.

    Parameters
    ----------
    level : ndarray, shape (n,)
        Light at every `SAMPLE_US`, 0 dark .. 1 full.
    sensor : Sensor
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (events,)
        Sorted by time.
    """
    side = max(1, int(np.ceil(np.sqrt(sensor.n_pixels))))
    per_pixel = sensor.events_per_edge / sensor.n_pixels
    share = rng.uniform(0.6, 1.4, sensor.n_pixels)  # a plate is not even
    contrast = np.maximum(per_pixel, 1.0) * share + 0.5  # of full light, in thresholds
    on, off = (np.maximum(rng.normal(1, sensor.spread, sensor.n_pixels), 0.3) for _ in range(2))
    full = np.log1p(level[:, None] * (np.exp(THRESHOLD * contrast) - 1)) / THRESHOLD
    t_us, pixel, p = _fire(
        full, on, off, SAMPLE_US / sensor.low_pass_us, sensor.refractory_us / SAMPLE_US, sensor.noise,
        rng,
    )  # fmt: skip
    slot = (t_us * SAMPLE_US / 100).astype(np.int64)
    shared = rng.normal(0, sensor.edge_jitter_us, slot.max(initial=0) + 1) if sensor.edge_jitter_us else np.zeros(1)
    late = np.where(p == 1, sensor.latency_on_us, sensor.latency_off_us)
    late = late + np.abs(rng.normal(0, sensor.jitter_us, p.size)) + (shared[slot] if shared.size > 1 else 0.0)
    length_us = len(level) * SAMPLE_US
    n = rng.poisson(sensor.stray_hz * length_us * 1e-6)
    t_us = np.concatenate([t_us * SAMPLE_US + late, rng.uniform(0, length_us, n)])
    pixel = np.concatenate([pixel, rng.integers(0, sensor.n_pixels, n)])
    p = np.concatenate([p, rng.integers(0, 2, n)])
    order = np.argsort(t_us, kind="stable")
    t_us, pixel, p = np.maximum(t_us[order], 0), pixel[order], p[order]
    return make_events(
        (pixel % side).astype(np.uint16), (pixel // side).astype(np.uint16), p.astype(np.int16), t_us.astype(np.int64)
    )


@njit(cache=True)
def _fire(full, on, off, step, refractory, noise, rng):  # type: ignore[no-untyped-def]
    """Return the sample, the pixel and the polarity of each event; `full` has a row for each sample."""
    t, pixel, p = [0.0 for _ in range(0)], [0 for _ in range(0)], [0 for _ in range(0)]
    for k in range(full.shape[1]):
        state = full[0, k]
        reference, free = state, 0.0
        follow = 1.0 - np.exp(-step)
        for i in range(full.shape[0]):
            state += follow * (full[i, k] - state)
            if i < free:
                reference = state
                continue
            here = state + noise * rng.normal()
            if here - reference >= on[k] or reference - here >= off[k]:
                up = here > reference
                t.append(float(i))
                pixel.append(k)
                p.append(1 if up else 0)
                reference += on[k] if up else -off[k]
                free = i + refractory
    return np.array(t), np.array(pixel), np.array(p)
