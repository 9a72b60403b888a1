"""From the light of a plate to the lock-in image that it should give, and the normal equations of a fit.

A pixel on which the plate adds A s to the ambient light sees the contrast C = ln(1 + A s), where s is the share of
the face's luminance on it. It makes its first event at an edge once C is above the threshold c. At the end of its
refractory period it begins anew from the level that it has then, so an event uses up the threshold and a share k of
what is left to go; the n-th event needs the contrast c a_n with a_n = 1 + 1/(1-k) + ... + 1/(1-k)^(n-1). Thresholds
and noise differ from pixel to pixel and from edge to edge, so each step is soft. With ON and OFF edges added up,

    events per edge = 2 sum_n 1 / (1 + exp(-(C - c a_n) / (w sqrt(a_n)))).

A, c, k, w, the blur, the luminance of the side faces and the share of light in a wide halo are nuisance parameters.
They are fitted together with the pose; `LightPriors` says what is known of them beforehand.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.pose.light_model import N_POSE

Floats = npt.NDArray[np.float64]

N_LIGHT = 8
N_ALL = N_POSE + N_LIGHT
MOST_EVENTS = 40  # of one pixel at one edge
HUBER = 3.0  # residuals beyond so many standard deviations count less


@dataclass(frozen=True, kw_only=True)
class LightPriors:
    """What a receiver knows of light and sensor before it sees a marker: normal distributions, mean and deviation.

    Parameters
    ----------
    log_brightness : tuple of 2 floats
        ln(A): light of the face relative to its surroundings. About as bright, within a factor of three.
    threshold : tuple of 2 floats
        c: contrast of the first event; 0.25 is the nominal value of products.
    loss : tuple of 2 floats
        k: a refractory period of 50 us takes some tenths of the way that is left.
    log_softness : tuple of 2 floats
        ln(w): thresholds differ by some 12 % and the level has noise, together 0.06 or 1.8 w.
    log_blur : tuple of 2 floats
        ln of the standard deviation of the blur, the square of the pixel included [px].
    edge : tuple of 2 floats
        Luminance of a side face relative to the face, as it is seen.
    halo : tuple of 2 floats
        Share of light in the halo. Lenses have a veiling glare of some percent.
    halo_px : float
        Standard deviation of the halo [px].

    Raises
    ------
    ValueError
        If a deviation or the halo's size is not above 0.
    """

    log_brightness: tuple[float, float] = (0.3, 1.0)
    threshold: tuple[float, float] = (0.25, 0.06)
    loss: tuple[float, float] = (0.2, 0.15)
    log_softness: tuple[float, float] = (-3.4, 0.4)
    log_blur: tuple[float, float] = (-0.1, 0.35)
    edge: tuple[float, float] = (0.2, 0.4)
    halo: tuple[float, float] = (0.02, 0.02)
    halo_px: float = 8.0

    def __post_init__(self) -> None:
        for name in ("log_brightness", "threshold", "loss", "log_softness", "log_blur", "edge", "halo"):
            if not getattr(self, name)[1] > 0:
                raise ValueError(f"{name}={getattr(self, name)} has no deviation; choose one above 0")
        if not self.halo_px > 0:
            raise ValueError(f"halo_px={self.halo_px} is not a size; choose more than 0 px")

    def table(self) -> Floats:
        """Return mean and deviation of each nuisance parameter, shape (N_LIGHT, 2)."""
        known = (self.log_brightness, self.threshold, self.loss, self.log_softness, self.log_blur, self.halo)
        return np.array([*known, self.edge, self.edge], np.float64)


@njit(cache=True, error_model="numpy", fastmath=True)
def respond(share: float, light: Floats) -> tuple[float, float, float, float, float, float, float]:
    """Return the events per edge at a share of light, and its derivatives by the share, ln A, c, k and ln w."""
    lit = max(math.exp(light[0]) * share, 0.0)
    contrast, kept, width = math.log(1.0 + lit), 1.0 - light[2], math.exp(light[3])
    value = slope = by_threshold = by_loss = by_width = doubt = 0.0
    need, more, power = 0.0, 0.0, 1.0  # a_n, its derivative by k, and (1 - k)^-(n - 1)
    for n in range(MOST_EVENTS):
        need += power
        more += n * power / kept
        power /= kept
        w = width * math.sqrt(need)
        z = (contrast - light[1] * need) / w
        if z < -12:
            break
        step = 1.0 / (1.0 + math.exp(-z))
        rise = 2 * step * (1.0 - step)
        value += 2 * step
        doubt += 2 * rise
        slope += rise / w
        by_threshold -= rise * need / w
        by_loss -= rise * (light[1] * more / w + 0.5 * z * more / need)
        by_width -= rise * z
    by_lit = slope / (1.0 + lit)
    return value, by_lit * math.exp(light[0]), by_lit * lit, by_threshold, by_loss, by_width, doubt


@njit(cache=True, error_model="numpy", fastmath=True)
def expected(image: Floats, halo: Floats, light: Floats, out: Floats, doubt: Floats) -> None:
    """Fill in the lock-in image that a drawn plate should give, and its doubt; `light_model.draw` makes `image`."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            drawn = image[i, j, 0] + light[6] * image[i, j, 8] + light[7] * image[i, j, 9]
            share = (1 - light[5]) * drawn + light[5] * halo[i, j]
            answer = respond(share, light)
            out[i, j], doubt[i, j] = answer[0], answer[6]


@njit(cache=True, error_model="numpy", fastmath=True)
def normal_equations(
    image: Floats, halo: Floats, seen: Floats, variance: Floats, light: Floats, priors: Floats,
    matrix: Floats, vector: Floats,
) -> float:  # fmt: skip
    """Fill in matrix and vector of the normal equations of a fit.

    Parameters
    ----------
    image : ndarray, shape (h, w, N_IMAGE)
        See `light_model.draw`.
    halo : ndarray, shape (h, w)
        The same image blurred by the halo.
    seen, variance : ndarray, shape (h, w)
        The lock-in image and the variance of each pixel.
    light : ndarray, shape (N_LIGHT,)
        Nuisance parameters: ln A, c, k, ln w, ln(blur), halo, side faces.
    priors : ndarray, shape (N_LIGHT, 2)
        See `LightPriors.table`.
    matrix, vector : ndarray, shape (N_ALL, N_ALL), (N_ALL,)
        Filled in.

    Returns
    -------
    float
        The cost: half the weighted sum of squares, with Huber's rule beyond `HUBER` deviations.
    """
    slope = np.empty(N_ALL)
    matrix[:] = 0.0
    vector[:] = 0.0
    cost = 0.0
    for i in range(seen.shape[0]):
        for j in range(seen.shape[1]):
            drawn = image[i, j, 0] + light[6] * image[i, j, 8] + light[7] * image[i, j, 9]
            share = (1 - light[5]) * drawn + light[5] * halo[i, j]
            value, by_share, by_a, by_c, by_k, by_w, _ = respond(share, light)
            sigma = math.sqrt(variance[i, j])
            z = (seen[i, j] - value) / sigma
            weight = 1.0
            if abs(z) > HUBER:
                weight = HUBER / abs(z)
                cost += HUBER * (abs(z) - 0.5 * HUBER)
            else:
                cost += 0.5 * z * z
            through = by_share * (1 - light[5]) / sigma
            if value < 1e-4:
                continue
            for k in range(N_POSE):
                slope[k] = through * image[i, j, 1 + k]
            slope[6], slope[7], slope[8], slope[9] = by_a / sigma, by_c / sigma, by_k / sigma, by_w / sigma
            slope[10] = through * image[i, j, 7]
            slope[11] = by_share * (halo[i, j] - drawn) / sigma
            slope[12], slope[13] = through * image[i, j, 8], through * image[i, j, 9]
            for k in range(N_ALL):
                weighted = weight * slope[k]
                vector[k] += weighted * z
                for m in range(k + 1):
                    matrix[k, m] += weighted * slope[m]
    for k in range(N_LIGHT):
        off = (light[k] - priors[k, 0]) / priors[k, 1]
        cost += 0.5 * off * off
        vector[N_POSE + k] -= off / priors[k, 1]
        matrix[N_POSE + k, N_POSE + k] += 1 / priors[k, 1] ** 2
    for k in range(N_ALL):
        for m in range(k):
            matrix[m, k] = matrix[k, m]
    return cost
