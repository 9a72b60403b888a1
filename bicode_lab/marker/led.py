"""The LED in time and in brightness.   chips -> light

In time the LED is a list of steps: from a moment on, the light is a fraction of its
full level. A packet follows a packet without pause (III-A). In brightness the light
leaves through the engraved face, so its luminance is current over plate area (IV-C).
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
    """When the LED is on, as a function of true time.

    Parameters
    ----------
    payload : int
        The ID that is sent, again and again.
    packet_format : PacketFormat
    phase_us : float
        A moment at which a packet begins (the first of its off time) [us].
    clock_error_ppm : float
        How much faster the transmitter's clock runs than true time [ppm]; public LED
        beacons were seen a few hundred off.
    rise_time_us : float
        10-90 % rise and fall time of the light [us].

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
        """A span of time in, the beginnings of all packets that begin in it out [us]."""
        first = np.ceil((start_us - self.phase_us) / self.packet_us)
        last = np.ceil((end_us - self.phase_us) / self.packet_us)
        return np.asarray(self.phase_us + np.arange(first, last) * self.packet_us, np.float64)

    def state(self, t_us: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        """Moments in [us], whether the driver holds the LED on (1) or off (0) out."""
        chips = encode_packet(self.payload, self.packet_format)
        index = np.floor((np.asarray(t_us, float) - self.phase_us) / self.chip_us).astype(np.int64)
        return chips[index % chips.size]

    def steps(self, start_us: float, end_us: float) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """A span of time in; the moments at which the light changes, and its level from then on, out.

        Returns
        -------
        times_us : ndarray, shape (n,)
            Rising, the first is `start_us` [us].
        levels : ndarray, shape (n,)
            0 dark .. 1 full.
        """
        # One chip more on the left: the edge before the span may still be rising into it.
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
    """LED current and plate side in, face luminance relative to the paper's 10.7 mA on 5 cm out (IV-C).

    ``current / area``, because the LED's light is almost proportional to its current (IV-A)
    and spreads over the engraved face.

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
