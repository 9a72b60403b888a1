"""Fit the pixel model to the edge response that was measured with a blinking LED.

The constants of the pixel model (`camera.pixels`) are varied. For each set of constants the packet is sent to some
hundred model pixels, their events are summed edge by edge as `led_response` does with the real ones, and the two
responses are compared.

If the time constant is not much shorter than a chip, the response to one edge runs into that to the next one. Then the
difference of the two delays is some microseconds off: send more slowly in this case.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from bicode_lab.camera.pixel_steps import max_events
from bicode_lab.camera.pixels import SIDE_BY_SIDE, SMALLEST_THRESHOLD, PixelModel, fire_lit_pixels, start_pixels
from bicode_studies.own_recording.led_response import AHEAD_US, BIN_US, EdgeResponse, find_delays

Floats = npt.NDArray[np.float64]

THRESHOLD_SPREAD = 0.12  # standard deviation of the threshold between pixels, relative to the threshold
REFRACTORY_SHARES = (0.25, 0.5, 0.75, 1.0)  # refractory periods to start from, relative to the shortest interval
MODEL_PIXELS = 240
MODEL_PACKETS = 4  # the first one is not counted: the pixels need it to settle
IMPOSSIBLE = 1e6  # misfit of constants that no pixel can have


@dataclass(frozen=True, kw_only=True)
class PixelFit:
    """Constants of the pixel model whose response is nearest to the one measured.

    Parameters
    ----------
    log_contrast : float
        Natural logarithm of the light with the LED on over that with the LED off; given, not fitted.
    threshold : float
        Contrast threshold, a step of the natural logarithm of the light.
    time_constant_us : float
        Time constant of the low-pass with the LED off [us].
    noise : float
        Standard deviation of the noise of the log level.
    refractory_us : float
        Refractory period after an event [us].
    on_delay_us, off_delay_us : float
        Times from the measured edges to the moments at which the light seems to switch [us]. Both hold the same
        unknown shift.
    misfit : float
        Mean squared difference of the two responses, divided by what chance explains; near 1 the model is good enough.
    """

    log_contrast: float
    threshold: float
    time_constant_us: float
    noise: float
    refractory_us: float
    on_delay_us: float
    off_delay_us: float
    misfit: float = float("nan")

    @property
    def delay_difference_us(self) -> float:
        """How much longer the pure delay of OFF is than that of ON [us]."""
        return self.off_delay_us - self.on_delay_us


def fit_pixel(
    response: EdgeResponse, log_contrast: float, *, start: PixelFit | None = None, n_steps: int = 300, seed: int = 0
) -> PixelFit:
    """Fit the constants of the pixel model to a measured response, with the Nelder-Mead method.

    Parameters
    ----------
    response : EdgeResponse
        The measured response.
    log_contrast : float
        Natural logarithm of the light with the LED on over that with the LED off, above 0.
    start : PixelFit, optional
        Constants to start from. None starts from the best of several short searches with different refractory
        periods, up to the shortest interval measured.
    n_steps : int
        Number of model responses to compute.
    seed : int
        Seed of the model pixels. Fits of other pixels with another seed differ by as much as the whole measurement is
        uncertain by chance.

    Returns
    -------
    PixelFit

    Raises
    ------
    ValueError
        If `log_contrast` is not above 0.
    """
    if not log_contrast > 0:
        raise ValueError(f"log_contrast={log_contrast} is not above 0; give ln(light with the LED on / light without)")
    if start is None:
        interval_us = max(response.shortest_interval_us, 10.0)
        guesses = [_first_guess(log_contrast, share * interval_us) for share in REFRACTORY_SHARES]
        tries = [_search(response, guess, 0.3, n_steps // 2, seed) for guess in guesses]
        start = min(tries, key=lambda fit: fit.misfit)
    return _search(response, replace(start, log_contrast=log_contrast), 0.15, n_steps, seed)


def _first_guess(log_contrast: float, refractory_us: float) -> PixelFit:
    """Return constants of a typical sensor."""
    threshold = log_contrast / 2.5
    return PixelFit(
        log_contrast=log_contrast, threshold=threshold, time_constant_us=150.0, noise=0.2 * threshold,
        refractory_us=refractory_us, on_delay_us=-30.0, off_delay_us=-30.0,
    )  # fmt: skip


def _search(response: EdgeResponse, start: PixelFit, spread: float, n_steps: int, seed: int) -> PixelFit:
    """Search from `start`; the first step is `spread` in each logarithm, and 100 us times `spread` in each delay."""
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
    """Compute the edge response of the pixel model.

    Parameters
    ----------
    fit : PixelFit
        Constants of the model.
    levels : ndarray of uint8, shape (chips,)
        Levels of one packet: 0 LED off, 1 LED on.
    chip_us : float
        Length of a chip [us].
    n_bins : int
        Number of bins of `BIN_US`.
    seed : int
        Seed of the model pixels.

    Returns
    -------
    on, off : ndarray of float, shape (n_bins,)
        Mean number of ON events per pixel and rise, and of OFF events per pixel and fall.
    """
    model = PixelModel(
        threshold_on=fit.threshold, threshold_off=fit.threshold, threshold_spread=THRESHOLD_SPREAD * fit.threshold,
        time_constant_us=fit.time_constant_us, noise=fit.noise, refractory_us=fit.refractory_us,
        latency_on_us=0.0, latency_off_us=0.0,
    )  # fmt: skip
    t_us, p = _model_events(model, float(np.expm1(fit.log_contrast)), levels, chip_us, seed)
    starts = np.arange(MODEL_PACKETS, dtype=np.float64) * (chip_us * levels.size)
    rises = (np.diff(levels.astype(int), append=int(levels[0])) > 0).sum()
    responses = []
    for sign, late in ((1, fit.on_delay_us), (-1, fit.off_delay_us)):
        delay, edge, packet = find_delays(t_us + late, starts, chip_us, levels)
        mine = (edge == sign) & ((p > 0) == (sign > 0)) & (packet > 0)
        place = (
            delay[mine] + AHEAD_US
        ) / BIN_US - 0.5  # divided between two bins, so that the result is smooth in the delay
        low = np.floor(place).astype(np.int64)
        hist = np.zeros(n_bins + 2)
        for bins, weight in ((low, low + 1 - place), (low + 1, place - low)):
            inside = (bins >= 0) & (bins < n_bins)
            hist[:n_bins] += np.bincount(bins[inside], weight[inside], minlength=n_bins)
        responses.append(hist[:n_bins] / (MODEL_PIXELS * (MODEL_PACKETS - 1) * rises))
    return responses[0], responses[1]


def _model_events(
    model: PixelModel, led_to_ambient: float, levels: npt.NDArray[np.uint8], chip_us: float, seed: int
) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return times [us] and polarities of the events of model pixels that see a packet `MODEL_PACKETS` times."""
    n = MODEL_PIXELS
    state = start_pixels(np.ones(n, np.float32), model, np.random.default_rng(seed))
    light = np.tile(levels, MODEL_PACKETS)
    turns = np.concatenate([[0], np.flatnonzero(np.diff(light.astype(int))) + 1])
    edges = np.append(turns, light.size) * chip_us
    room = n * turns.size * 6 + SIDE_BY_SIDE * max_events(edges, model.refractory_us)
    pixels, times = np.empty(room, np.uint32), np.empty(room)
    _, count = fire_lit_pixels(
        0, np.arange(n, dtype=np.int32), np.ones((1, n), np.float32), np.full((1, 1, n), led_to_ambient, np.float32),
        edges, turns.astype(np.int64), light[turns].astype(np.float32)[:, None], np.zeros(turns.size, np.int32),
        state.level, state.reference, state.free_us, state.threshold_on, state.threshold_off,
        np.uint64(seed), model.noise, model.time_constant_us, model.refractory_us, 0.0, 0.0, pixels, times, 0,
    )  # fmt: skip
    return times[:count], (pixels[:count] & 1).astype(np.int64)


def _misfit(response: EdgeResponse, fit: PixelFit, seed: int) -> float:
    """Return the mean squared difference of the measured and the model response, divided by their variance."""
    if not (fit.threshold > SMALLEST_THRESHOLD and 5 < fit.time_constant_us < 5000 and fit.refractory_us < 1000):
        return IMPOSSIBLE
    n_bins = response.on.shape[1]
    edges = response.n_pixels * response.n_packets * response.n_rises
    model_edges = MODEL_PIXELS * (MODEL_PACKETS - 1) * response.n_rises
    total = 0.0
    responses = model_response(fit, response.levels, response.chip_us, n_bins, seed)
    for side, model in zip(("on", "off"), responses, strict=True):
        seen = response.per_edge(side)
        variance = (seen * edges + 1) / edges**2 + (model * model_edges + 1) / model_edges**2
        total += float(((seen - model) ** 2 / variance).mean())
    return total / 2


def _to_vector(fit: PixelFit) -> Floats:
    """Return the variables of the search: logarithms of four constants, and the two delays [us]."""
    logs = np.log([fit.threshold, fit.time_constant_us, fit.noise, fit.refractory_us])
    return np.array([*logs, fit.on_delay_us, fit.off_delay_us])


def _from_vector(vector: Floats, log_contrast: float) -> PixelFit:
    """Return the constants for the variables of the search."""
    threshold, tau_us, noise, refractory_us = (float(v) for v in np.exp(np.minimum(vector[:4], 20)))
    return PixelFit(
        log_contrast=log_contrast, threshold=threshold, time_constant_us=tau_us, noise=noise,
        refractory_us=refractory_us, on_delay_us=float(vector[4]), off_delay_us=float(vector[5]),
    )  # fmt: skip
