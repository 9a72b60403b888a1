"""The pixel model that answers to a blinking LED as a real camera did.   an answer -> constants

A search over the constants of `camera.sensor`: each try sends the packet to some hundred model
pixels, lays their events over each other as `own_camera` does with the real ones, and compares.

Where the time constant is not well below a chip, an edge's answer runs into the next one's, and the
difference of the two delays comes out some microseconds off: send more slowly then.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from bicode_lab.camera.pixel_steps import most_events
from bicode_lab.camera.pixels import SIDE_BY_SIDE, SMALLEST_THRESHOLD, PixelModel, fire_lit_pixels, start_pixels
from bicode_studies.own_recording.led_response import AHEAD_US, BIN_US, EdgeResponse, delays

Floats = npt.NDArray[np.float64]

SPREAD = 0.12  # of the threshold from pixel to pixel, as a part of it
RESTS = (0.25, 0.5, 0.75, 1.0)  # dead times to begin with, over the shortest time between two events
MODEL_PIXELS = 240
MODEL_PACKETS = 4  # the first is not looked at: the pixels have to get into step
IMPOSSIBLE = 1e6


@dataclass(frozen=True, kw_only=True)
class PixelFit:
    """Constants of the model whose answer looks like the one measured.

    Parameters
    ----------
    log_contrast : float
        Logarithm of the light with the LED on over that with the LED off; given, not fitted.
    threshold : float
        Contrast threshold, a step of the logarithm of the light.
    time_constant_us : float
        Of the low-pass, with the LED off [us].
    noise : float
        Standard deviation of the log level's noise.
    rest_us : float
        Dead time after an event [us].
    on_us, off_us : float
        From the grid's edges to the moment the light seems to switch [us]; each holds the same unknown shift.
    misfit : float
        Mean squared difference of the two answers over what chance explains; near 1 the model is good enough.
    """

    log_contrast: float
    threshold: float
    time_constant_us: float
    noise: float
    rest_us: float
    on_us: float
    off_us: float
    misfit: float = float("nan")

    @property
    def off_later_us(self) -> float:
        """How much longer the pure delay of OFF is than that of ON [us]."""
        return self.off_us - self.on_us


def fit_pixel(
    response: EdgeResponse, log_contrast: float, *, start: PixelFit | None = None, n_steps: int = 300, seed: int = 0
) -> PixelFit:
    """An answer and the LED's log contrast in, the constants of the pixel model whose answer is most like it out.

    Nelder and Mead's search over `n_steps` answers of the model, from `start`; without one, from the best of
    several short searches with dead times up to the shortest one seen. The model's pixels are of one `seed`:
    fits of other pixels *and* another seed differ by as much as the whole measurement is uncertain by chance.
    """
    if not log_contrast > 0:
        raise ValueError(f"log_contrast={log_contrast} is not above 0; give ln(light with the LED on / light without)")
    if start is None:
        rest_us = max(response.shortest_rest_us, 10.0)
        tries = [
            _search(response, _first_guess(log_contrast, share * rest_us), 0.3, n_steps // 2, seed) for share in RESTS
        ]
        start = min(tries, key=lambda fit: fit.misfit)
    return _search(response, replace(start, log_contrast=log_contrast), 0.15, n_steps, seed)


def _first_guess(log_contrast: float, rest_us: float) -> PixelFit:
    """A usual sensor."""
    threshold = log_contrast / 2.5
    return PixelFit(
        log_contrast=log_contrast, threshold=threshold, time_constant_us=150.0, noise=0.2 * threshold,
        rest_us=rest_us, on_us=-30.0, off_us=-30.0,
    )  # fmt: skip


def _search(response: EdgeResponse, start: PixelFit, spread: float, n_steps: int, seed: int) -> PixelFit:
    """Nelder and Mead's search from `start`, its first steps as large as `spread` (of each constant; 100 us are 1)."""
    first = _to_vector(start)
    corners = first + np.vstack([np.zeros(first.size), np.diag(spread * np.array([1, 1, 1, 1, 100, 100]))])
    found = minimize(
        lambda v: _misfit(response, _from_vector(v, start.log_contrast), seed), first, method="Nelder-Mead",
        options={"maxfev": n_steps, "initial_simplex": corners, "xatol": 1e-3, "fatol": 1e-2},
    )  # fmt: skip
    return replace(_from_vector(found.x, start.log_contrast), misfit=float(found.fun))


def model_response(
    fit: PixelFit, levels: npt.NDArray[np.uint8], chip_us: float, n_bins: int, seed: int = 0
) -> tuple[Floats, Floats]:
    """Constants and a packet in; the model's mean ON and OFF events of a pixel and edge in each bin out."""
    model = PixelModel(
        threshold_on=fit.threshold, threshold_off=fit.threshold, threshold_spread=SPREAD * fit.threshold,
        time_constant_us=fit.time_constant_us, noise=fit.noise, refractory_us=fit.rest_us,
        latency_on_us=0.0, latency_off_us=0.0,
    )  # fmt: skip
    t_us, p = _model_events(model, float(np.expm1(fit.log_contrast)), levels, chip_us, seed)
    starts = np.arange(MODEL_PACKETS, dtype=np.float64) * (chip_us * levels.size)
    rises = (np.diff(levels.astype(int), append=int(levels[0])) > 0).sum()
    answers = []
    for sign, late in ((1, fit.on_us), (-1, fit.off_us)):
        delay, edge, packet = delays(t_us + late, starts, chip_us, levels)
        mine = (edge == sign) & ((p > 0) == (sign > 0)) & (packet > 0)
        place = (delay[mine] + AHEAD_US) / BIN_US - 0.5  # shared between two bins: smooth in the shift
        low = np.floor(place).astype(np.int64)
        hist = np.zeros(n_bins + 2)
        for bins, weight in ((low, low + 1 - place), (low + 1, place - low)):
            inside = (bins >= 0) & (bins < n_bins)
            hist[:n_bins] += np.bincount(bins[inside], weight[inside], minlength=n_bins)
        answers.append(hist[:n_bins] / (MODEL_PIXELS * (MODEL_PACKETS - 1) * rises))
    return answers[0], answers[1]


def _model_events(
    model: PixelModel, led_to_ambient: float, levels: npt.NDArray[np.uint8], chip_us: float, seed: int
) -> tuple[Floats, npt.NDArray[np.int64]]:
    """The model's pixels under a packet sent `MODEL_PACKETS` times; times [us] and polarities of their events out."""
    n = MODEL_PIXELS
    state = start_pixels(np.ones(n, np.float32), model, np.random.default_rng(seed))
    light = np.tile(levels, MODEL_PACKETS)
    turns = np.concatenate([[0], np.flatnonzero(np.diff(light.astype(int))) + 1])
    edges = np.append(turns, light.size) * chip_us
    room = n * turns.size * 6 + SIDE_BY_SIDE * most_events(edges, model.refractory_us)
    pixels, times = np.empty(room, np.uint32), np.empty(room)
    _, count = fire_lit_pixels(
        0, np.arange(n, dtype=np.int32), np.ones((1, n), np.float32), np.full((1, 1, n), led_to_ambient, np.float32),
        edges, turns.astype(np.int64), light[turns].astype(np.float32)[:, None], np.zeros(turns.size, np.int32),
        state.level, state.reference, state.free_us, state.threshold_on, state.threshold_off,
        np.uint64(seed), model.noise, model.time_constant_us, model.refractory_us, 0.0, 0.0, pixels, times, 0,
    )  # fmt: skip
    return times[:count], (pixels[:count] & 1).astype(np.int64)


def _misfit(response: EdgeResponse, fit: PixelFit, seed: int) -> float:
    """Mean squared difference of an answer and the model's, over the chance of both; a large number if it cannot be."""
    if not (fit.threshold > SMALLEST_THRESHOLD and 5 < fit.time_constant_us < 5000 and fit.rest_us < 1000):
        return IMPOSSIBLE
    n_bins = response.on.shape[1]
    edges = response.n_pixels * response.n_packets * response.n_rises
    model_edges = MODEL_PIXELS * (MODEL_PACKETS - 1) * response.n_rises
    total = 0.0
    answers = model_response(fit, response.levels, response.chip_us, n_bins, seed)
    for side, model in zip(("on", "off"), answers, strict=True):
        seen = response.per_edge(side)
        variance = (seen * edges + 1) / edges**2 + (model * model_edges + 1) / model_edges**2
        total += float(((seen - model) ** 2 / variance).mean())
    return total / 2


def _to_vector(fit: PixelFit) -> Floats:
    """Constants in, what the search moves out: logarithms, and the two shifts [us]."""
    return np.array([*np.log([fit.threshold, fit.time_constant_us, fit.noise, fit.rest_us]), fit.on_us, fit.off_us])


def _from_vector(vector: Floats, log_contrast: float) -> PixelFit:
    """The other way round."""
    threshold, tau_us, noise, rest_us = (float(v) for v in np.exp(np.minimum(vector[:4], 20)))
    return PixelFit(
        log_contrast=log_contrast, threshold=threshold, time_constant_us=tau_us, noise=noise, rest_us=rest_us,
        on_us=float(vector[4]), off_us=float(vector[5]),
    )  # fmt: skip
