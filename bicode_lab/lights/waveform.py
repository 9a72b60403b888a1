"""The light of a transmitter over time, from the levels that it sends again and again.

`ChipWaveform` has what a lamp of the simulated camera asks of its light, so any of these codes can be simulated::

    Lamp(flicker=ChipWaveform(chips=IntervalLine().encode(37), chip_us=200))
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.soft_receiver.line_code import LineCode

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class ChipWaveform:
    """A light that sends levels again and again.

    Parameters
    ----------
    chips : sequence of int
        Levels, 0 or 1; one or more, and not all alike.
    chip_us : float
        How long each lasts by the nominal clock, above 0 [us].
    phase_us : float
        A moment at which the first level begins [us].
    clock_error_ppm : float
        How much faster than nominal the clock runs [ppm].

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> ChipWaveform(chips=[1, 0, 0], chip_us=200).steps(0, 1000)
    (array([  0., 200., 600., 800.]), array([1., 0., 1., 0.]))
    """

    chips: Sequence[int] | npt.NDArray[np.uint8]
    chip_us: float
    phase_us: float = 0.0
    clock_error_ppm: float = 0.0

    def __post_init__(self) -> None:
        if set(np.asarray(self.chips).tolist()) != {0, 1}:
            raise ValueError("chips must hold both 0 and 1, or the light never switches; give the levels of a word")
        if not self.chip_us > 0:
            raise ValueError(f"chip_us={self.chip_us} is no time; choose more than 0")
        if not abs(self.clock_error_ppm) <= 500_000:
            raise ValueError(f"clock_error_ppm={self.clock_error_ppm} is not in -500000 .. 500000")

    @property
    def packet_us(self) -> float:
        """Length of all levels [us]."""
        return len(self.chips) * self.chip_us / (1 + self.clock_error_ppm * 1e-6)

    def steps(self, start_us: float, end_us: float) -> tuple[Floats, Floats]:
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
            Level of the light from each of these moments on, 0 or 1.
        """
        chip_us = self.packet_us / len(self.chips)
        first = int(np.floor((start_us - self.phase_us) / chip_us))
        index = np.arange(first, int(np.ceil((end_us - self.phase_us) / chip_us)) + 1)
        levels = np.asarray(self.chips, float)[index % len(self.chips)]
        times = self.phase_us + index * chip_us
        change = np.append(True, levels[1:] != levels[:-1]) & (times < end_us)
        times, levels = times[change], levels[change]
        return np.append(float(start_us), times[1:]), levels


def text_waveform(text: str, line: LineCode, *, phase_us: float = 0.0, clock_error_ppm: float = 0.0) -> ChipWaveform:
    """Return the light of a text that is sent again and again.

    Parameters
    ----------
    text : str
        One letter or more.
    line : LineCode
        A code whose frames are characters, such as `UartLine`.
    phase_us, clock_error_ppm : float
        See `ChipWaveform`.

    Returns
    -------
    ChipWaveform
    """
    if not text:
        raise ValueError("text='' sends nothing; give one letter or more")
    chips = np.concatenate([line.encode(ord(letter)) for letter in text])
    return ChipWaveform(chips=chips, chip_us=line.chip_us, phase_us=phase_us, clock_error_ppm=clock_error_ppm)


def constant_frequency(rate_hz: float, *, phase_us: float = 0.0) -> ChipWaveform:
    """Return the light of an LED that is told from others by its frequency, on for half of each cycle.

    Parameters
    ----------
    rate_hz : float
        Cycles per second, above 0 [Hz].
    phase_us : float
        A moment at which the LED is switched on [us].

    Returns
    -------
    ChipWaveform
    """
    if not rate_hz > 0:
        raise ValueError(f"rate_hz={rate_hz} is no frequency; choose more than 0")
    return ChipWaveform(chips=(1, 0), chip_us=0.5e6 / rate_hz, phase_us=phase_us)
