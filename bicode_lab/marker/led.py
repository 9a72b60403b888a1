"""The light of the LED over time, and the luminance of the plate's face.

Over time, the light is a list of steps: from each moment on it has a level between 0 and 1. Packets follow each other
without pause (III-A). The light leaves the plate through the engraved face, so the luminance of the face is
proportional to the current over the area of the plate (IV-C).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from bicode_lab.marker.packet import PacketFormat, encode_packet

RISE_STEPS = 6  # a slow edge is drawn as this many equal steps of light


@dataclass(frozen=True, kw_only=True)
class LedWaveform:
    """The state of an LED as a function of true time.

    Parameters
    ----------
    payload : int
        The ID, which is sent again and again.
    packet_format : PacketFormat
    phase_us : float
        A moment at which a packet begins, with the LED off [us].
    clock_error_ppm : float
        How much faster than true time the clock of the transmitter runs [ppm]. The clocks of public LED beacons deviate
        by a few hundred ppm.
    rise_time_us : float
        Rise and fall time of the light from 10 % to 90 % [us].

    Raises
    ------
    ValueError
        If a value is out of range or the payload does not fit the packet format.

    Examples
    --------
    >>> wave = LedWaveform(payload=0xFF)
    >>> times_us, levels = wave.steps(0, 5000)
    >>> times_us, levels
    (array([   0., 3500., 4000., 4500.]), array([0., 1., 0., 1.]))
    """

    payload: int
    packet_format: PacketFormat = field(default_factory=PacketFormat)
    phase_us: float = 0.0
    clock_error_ppm: float = 0.0
    rise_time_us: float = 0.0

    def __post_init__(self) -> None:
        encode_packet(self.payload, self.packet_format)  # refuses a payload that does not fit
        if not abs(self.clock_error_ppm) <= 500_000:
            raise ValueError(f"clock_error_ppm={self.clock_error_ppm} is not in -500000 .. 500000")
        if not 0 <= self.rise_time_us < self.packet_format.chip_us / 2:
            raise ValueError(
                f"rise_time_us={self.rise_time_us} is not in 0 .. {self.packet_format.chip_us / 2:g} "
                f"(half a chip at f_id_hz={self.packet_format.f_id_hz:g})"
            )

    @property
    def chip_us(self) -> float:
        """Length of a chip in true time [us]."""
        return self.packet_format.chip_us / (1 + self.clock_error_ppm * 1e-6)

    @property
    def packet_us(self) -> float:
        """Length of a packet in true time [us]."""
        return self.chip_us * 2 * self.packet_format.packet_bits

    def packet_starts(self, start_us: float, end_us: float) -> npt.NDArray[np.float64]:
        """Return the moments at which packets begin.

        Parameters
        ----------
        start_us, end_us : float
            Span of time; `end_us` itself is not part of it [us].

        Returns
        -------
        ndarray of float64, shape (n,)
            Rising [us].
        """
        first = np.ceil((start_us - self.phase_us) / self.packet_us)
        last = np.ceil((end_us - self.phase_us) / self.packet_us)
        return np.asarray(self.phase_us + np.arange(first, last) * self.packet_us, np.float64)

    def state(self, t_us: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        """Return whether the driver holds the LED on at given moments.

        Parameters
        ----------
        t_us : array_like
            Moments [us], of any shape.

        Returns
        -------
        ndarray of uint8, of the same shape
            1 on, 0 off.
        """
        chips = encode_packet(self.payload, self.packet_format)
        index = np.floor((np.asarray(t_us, float) - self.phase_us) / self.chip_us).astype(np.int64)
        return chips[index % chips.size]

    def steps(self, start_us: float, end_us: float) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Return the steps of the light in a span of time.

        Parameters
        ----------
        start_us, end_us : float
            Span of time; `end_us` itself is not part of it [us].

        Returns
        -------
        times_us : ndarray of float64, shape (n,)
            Rising; the first is `start_us`, at the others the light changes [us].
        levels : ndarray of float64, shape (n,)
            Level of the light from each of these moments on, 0 dark .. 1 full.
        """
        # One chip more on the left: the edge before the span may still be rising when the span begins.
        first = int(np.floor((start_us - self.phase_us) / self.chip_us)) - 2
        last = int(np.ceil((end_us - self.phase_us) / self.chip_us)) + 1
        chips = encode_packet(self.payload, self.packet_format)
        index = np.arange(first, last)
        on = chips[index % chips.size].astype(float)
        changes = np.flatnonzero(np.diff(on)) + 1
        times = self.phase_us + index[changes] * self.chip_us
        levels = on[changes]
        if self.rise_time_us > 0:
            fraction = (np.arange(RISE_STEPS) + 0.5) / RISE_STEPS
            delays = -np.log1p(-fraction) * self.rise_time_us / np.log(9)
            reached = np.arange(1, RISE_STEPS + 1) / RISE_STEPS
            times = (times[:, None] + delays).ravel()
            levels = np.where(levels[:, None] > 0, reached, 1 - reached).ravel()
        before = np.searchsorted(times, start_us, side="right")
        level_at_start = levels[before - 1] if before else on[0]
        inside = slice(before, np.searchsorted(times, end_us, side="left"))
        return np.append(float(start_us), times[inside]), np.append(level_at_start, levels[inside])


def luminance_ratio(current_ma: float, size_m: float) -> float:
    """Return the luminance of a plate's face relative to that of the paper's 10.7 mA on 5 cm (IV-C).

    It is ``(current_ma / 10.7) * (0.05 / size_m) ** 2``, because the light of the LED is almost proportional to its
    current (IV-A) and spreads over the engraved face.

    Parameters
    ----------
    current_ma : float
        LED current, 0 or more [mA].
    size_m : float
        Side of the plate, above 0 [m].

    Returns
    -------
    float

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> [round(luminance_ratio(i, s), 2) for i, s in [(2.7, 0.025), (10.7, 0.05), (40.9, 0.1)]]
    [1.01, 1.0, 0.96]
    """
    if not 0 <= current_ma < math.inf:
        raise ValueError(f"current_ma={current_ma} is not an LED's; choose 0 or more")
    if not size_m > 0:
        raise ValueError(f"size_m={size_m} is not a plate; choose more than 0 m")
    return (current_ma / 10.7) * (0.05 / size_m) ** 2
