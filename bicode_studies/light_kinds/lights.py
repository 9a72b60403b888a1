"""The light of every kind over time, made without the project's own transmitters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from bicode_studies.light_kinds.plate import SAMPLE_US

Floats = npt.NDArray[np.float64]
Truth = Literal["none", "noise", "mains", "pwm", "constant_frequency", "interval", "bicode", "uart"]
MOST_PPM = 300.0


@dataclass(frozen=True, kw_only=True)
class Light:
    """A light of one kind.

    Parameters
    ----------
    kind : str
    rate_hz : float
        Cycles, bits (Bicode), baud (UART) or base periods (interval code) per second [Hz].
    duty : float
        Share of a cycle that is on.
    depth : float
        Share of the light that a ripple takes away, 0 .. 1.
    """

    kind: Truth
    rate_hz: float = 0.0
    duty: float = 0.5
    depth: float = 0.5


def level_of(light: Light, length_us: float, rng: np.random.Generator) -> Floats:
    """Return the light at every `SAMPLE_US`, 0 .. 1; its phase, clock error and message are drawn.

    Parameters
    ----------
    light : Light
    length_us : float
        [us]
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of float64, shape (n,)
    """
    t_us = np.arange(0.0, length_us, SAMPLE_US)
    if light.kind in ("none", "noise"):
        return np.zeros(t_us.size)
    if light.kind == "mains":  # the mains keep their frequency within some hundredths of a Hz
        turns = t_us * 1e-6 * light.rate_hz * (1 + rng.normal(0, 5e-4)) + rng.uniform()
        shape = 0.5 + 0.5 * np.cos(2 * np.pi * turns) if rng.uniform() < 0.5 else np.abs(np.sin(np.pi * turns))
        return 1 - light.depth * shape
    rate_hz = light.rate_hz * (1 + rng.uniform(-MOST_PPM, MOST_PPM) * 1e-6)
    if light.kind in ("pwm", "constant_frequency"):
        return ((t_us * 1e-6 * rate_hz + rng.uniform()) % 1.0 < light.duty).astype(float)
    chip_hz = 2 * rate_hz if light.kind == "bicode" else rate_hz
    chips = CHIPS_OF[light.kind](int(length_us * 1e-6 * chip_hz) + 3, rng)
    return chips[(t_us * 1e-6 * chip_hz + rng.uniform()).astype(np.int64)].astype(float)


def _bicode(n: int, rng: np.random.Generator) -> npt.NDArray[np.int64]:
    """Return chips of a packet that repeats: start, payload and count of ones, in either convention."""
    start, width, sum_bits = int(rng.integers(2, 5)), int(rng.integers(4, 17)), 3
    payload = rng.integers(0, 2, width)
    ones = int(payload.sum()) % 2**sum_bits
    bits = [*payload.tolist(), *(ones >> k & 1 for k in (2, 1, 0))]
    turn = int(rng.integers(2))
    packet = [0] * (2 * start) + [chip for bit in bits for chip in ((1 - bit) ^ turn, bit ^ turn)]
    return _from_anywhere(packet, n, rng)


def _uart(n: int, rng: np.random.Generator) -> npt.NDArray[np.int64]:
    """Return bits of letters in one of three common formats, with now and then a rest between them."""
    style = int(rng.integers(3))  # 8N1, 8N2, 7E2 with the highest bit first
    bits: list[int] = []
    while len(bits) < 2 * n + 40:
        letter = rng.integers(32, 127)
        if style == 2:
            data = [int(letter) >> k & 1 for k in range(6, -1, -1)]
            bits += [0, *data, sum(data) % 2, 1, 1]
        else:
            bits += [0, *(int(letter) >> k & 1 for k in range(8)), *[1] * (1 + style)]
        if rng.uniform() < 0.1:
            bits += [1] * int(rng.integers(1, 8))
    begin = int(rng.integers(0, n))
    return np.array(bits[begin : begin + n])


def _interval(n: int, rng: np.random.Generator) -> npt.NDArray[np.int64]:
    """Return pulses of one base period whose distances are 4 (start), and 2 or 3 for the bits of a number."""
    word = [1, 0, 0, 0] + [chip for bit in rng.integers(0, 2, 8) for chip in ([1, 0, 0] if bit else [1, 0])]
    return _from_anywhere(word, n, rng)


def _from_anywhere(word: list[int], n: int, rng: np.random.Generator) -> npt.NDArray[np.int64]:
    """Return n chips of a word that repeats, from anywhere in it."""
    begin = int(rng.integers(len(word)))
    return np.array((word * (n // len(word) + 2))[begin : begin + n])


CHIPS_OF = {"bicode": _bicode, "uart": _uart, "interval": _interval}
