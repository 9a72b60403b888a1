"""Lamps that are no markers, such as lamps with mains ripple and dimmed LEDs.

They test what a receiver takes for a marker. A lamp is an even rectangle that faces the camera. Its image has a closed
form, because the blur of the lens is a Gaussian. What is behind a lamp shines through it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from bicode_lab.boxes import Box
from bicode_lab.camera.motion import Floats, Pose, Still, Trajectory
from bicode_lab.camera.optics import Light, Optics, ambient_signal
from bicode_lab.camera.plate_image import Image, reach_px

SINE_STEPS = 40  # a smooth ripple is drawn as this many levels per cycle: 250 us at 100 Hz


class Waveform(Protocol):
    """Light over time, as a patch of pixels needs it; `LedWaveform` and `Flicker` are examples."""

    @property
    def packet_us(self) -> float:
        """A length of time in which the light changes at least once, wherever it begins [us]."""

    def steps(self, start_us: float, end_us: float) -> tuple[Floats, Floats]:
        """Return the steps of the light in a span of time; see `LedWaveform.steps`."""


@dataclass(frozen=True, kw_only=True)
class Flicker:
    """The light of a lamp over time, the same in every cycle.

    Parameters
    ----------
    rate_hz : float
        Cycles of light per second [Hz]: 100 and 120 on mains of 50 and 60 Hz, 1000 and more behind a dimmer.
    shape : {"sine", "square"}
        Ripple or pulses.
    depth : float
        Share of the light that is missing at the darkest moment, 0 .. 1.
    duty : float
        Share of a square cycle that is bright, inside 0 .. 1.
    phase_us : float
        A moment at which a cycle begins [us]: a sine at its darkest, a square with its bright part.

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> Flicker(rate_hz=1000, shape="square", depth=0.75, duty=0.25).steps(0, 1500)
    (array([   0.,  250., 1000., 1250.]), array([1.  , 0.25, 1.  , 0.25]))
    """

    rate_hz: float = 100.0
    shape: Literal["sine", "square"] = "sine"
    depth: float = 0.5
    duty: float = 0.5
    phase_us: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.rate_hz <= 100_000:
            raise ValueError(f"rate_hz={self.rate_hz} is not in 0 .. 100000 Hz")
        if self.shape not in ("sine", "square"):
            raise ValueError(f"shape={self.shape!r} is not known; choose 'sine' or 'square'")
        if not (0 <= self.depth <= 1 and 0 < self.duty < 1):
            raise ValueError(f"depth={self.depth}, duty={self.duty}: choose a depth of 0 .. 1 and a duty inside 0 .. 1")

    @property
    def packet_us(self) -> float:
        """Length of a cycle [us]."""
        return 1e6 / self.rate_hz

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
            Level of the light from each of these moments on, 0 .. 1.
        """
        if self.shape == "sine":
            shares = np.arange(SINE_STEPS) / SINE_STEPS
            cycle = 1 - self.depth * (0.5 + 0.5 * np.cos(2 * np.pi * (shares + 0.5 / SINE_STEPS)))
        else:
            shares, cycle = np.array([0.0, self.duty]), np.array([1.0, 1.0 - self.depth])
        first = np.floor((start_us - self.phase_us) / self.packet_us) - 1
        count = int(np.ceil((end_us - start_us) / self.packet_us)) + 3
        times = self.phase_us + ((first + np.arange(count))[:, None] + shares).ravel() * self.packet_us
        levels = np.tile(cycle, count)
        before = int(np.searchsorted(times, start_us, side="right"))
        inside = slice(before, np.searchsorted(times, end_us, side="left"))
        return np.append(float(start_us), times[inside]), np.append(levels[before - 1], levels[inside])


@dataclass(frozen=True, kw_only=True)
class Lamp:
    """A flickering rectangle and its trajectory in the world.

    Parameters
    ----------
    flicker : Waveform
    path : Trajectory
        Position of the lamp over time; it always faces the camera, whatever its rotation.
    width_m, height_m : float
        Size [m].
    brightness : float
        Signal of the lamp at its brightest, relative to that of the office's wall.

    Raises
    ------
    ValueError
        If a size or the brightness is not above 0.
    """

    flicker: Waveform = field(default_factory=Flicker)
    path: Trajectory = field(default_factory=lambda: Still(Pose.facing(5.0)))
    width_m: float = 0.05
    height_m: float = 0.05
    brightness: float = 3.0

    def __post_init__(self) -> None:
        for name in ("width_m", "height_m", "brightness"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)} is no lamp; choose more than 0")

    def corners_m(self) -> Floats:
        """Return the top left and the bottom right corner in the lamp's own axes, shape (2, 3) [m]."""
        half = np.array([self.width_m / 2, self.height_m / 2, 0.0])
        return np.array([-half, half])


class LampImage:
    """The image of one lamp, with the same methods as `PlateImage`.

    Parameters
    ----------
    lamp : Lamp
    optics : Optics
    light : Light

    Attributes
    ----------
    waveform : Waveform
    dark_signal, full_signal : float
        Signal of the surroundings, and of the lamp at its brightest.
    sensor_width : int
        [px]
    """

    def __init__(self, lamp: Lamp, optics: Optics, light: Light) -> None:
        self.lamp = lamp
        self.waveform = lamp.flicker
        self._optics = optics
        self.dark_signal = ambient_signal(light, optics)
        self.full_signal = lamp.brightness * (5.6 / optics.f_number) ** 2
        self.sensor_width = optics.width

    def _sides(self, pose: Pose) -> npt.NDArray[np.float64]:
        """Return left and top, right and bottom of the image, shape (2, 2) [px]; nan behind the camera."""
        return self._optics.project(self.lamp.corners_m() + pose.position_m)

    def reach(self, poses: list[Pose]) -> Box:
        """Return the box of the pixels that the light reaches in any of some poses.

        Parameters
        ----------
        poses : list of Pose
            In camera axes.

        Returns
        -------
        Box
            Clipped to the sensor; empty where the lamp is behind the camera.
        """
        sides = np.concatenate([self._sides(pose) for pose in poses])
        if np.isnan(sides).any():
            return Box(0, 0, 0, 0)
        far = 1 << 20
        low = np.clip(np.floor(sides.min(0) - reach_px(self._optics)), -far, far).astype(int)
        high = np.clip(np.ceil(sides.max(0) + reach_px(self._optics)) + 1, -far, far).astype(int)
        return Box.between(int(low[0]), int(low[1]), int(high[0]), int(high[1])).clipped(
            self._optics.width, self._optics.height
        )

    def image(self, pose: Pose, box: Box) -> tuple[Image, Image]:
        """Draw the lamp on the pixels of a box.

        Parameters
        ----------
        pose : Pose
            In camera axes.
        box : Box

        Returns
        -------
        glow : ndarray of float32, shape (box.h, box.w)
            Share of the lamp's brightness on each pixel.
        mask : ndarray of float32, shape (box.h, box.w)
            Zeros: a lamp covers nothing.
        """
        share = self._optics.halo_fraction
        glow = (1 - share) * self._blurred(pose, box, np.sqrt(self._optics.blur_px**2 + 1 / 12))
        glow += share * self._blurred(pose, box, self._optics.halo_px)
        return glow.astype(np.float32), np.zeros(glow.shape, np.float32)

    def _blurred(self, pose: Pose, box: Box, sigma_px: float) -> Floats:
        """Return the rectangle blurred by a Gaussian, shape (box.h, box.w)."""
        low, high = np.nan_to_num(self._sides(pose))
        x, y = np.arange(box.x, box.right), np.arange(box.y, box.bottom)
        across = ndtr((x - low[0]) / sigma_px) - ndtr((x - high[0]) / sigma_px)
        down = ndtr((y - low[1]) / sigma_px) - ndtr((y - high[1]) / sigma_px)
        return np.asarray(np.outer(down, across))

    def cover(self, signal: npt.NDArray[np.float32], pose: Pose) -> None:
        """Do nothing: a lamp does not occlude the background."""
