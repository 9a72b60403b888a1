"""The light path from the scene through the lens to the signal of each pixel.

A pixel responds to the logarithm of its light, so only ratios matter. The unit of light is called the *signal*: 1 is
what the paper's office wall gives (350 lx, mean reflectance, F5.6, no filter). The opening of the lens does not change
the LED's share of the signal; it changes the speed of a pixel (see `pixels`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.camera.motion import Floats, Pose
from bicode_lab.constants import constant

IR88_TRANSMITTANCE = 0.8  # of the IR88 filter at 940 nm, and next to nothing of visible light (III-A)
REFERENCE_LUX = 350.0  # the paper's office (IV-A)
OFFICE_INFRARED_SHARE = 0.02  # light of office lamps beyond the visible, relative to the visible; assumption
REFERENCE_F_NUMBER = 5.6  # the lens with red LEDs (III-B)


@dataclass(frozen=True, kw_only=True)
class Optics:
    """Geometry of the sensor and the lens; the defaults are the paper's EVK4 with its 8 mm lens (III-B).

    Parameters
    ----------
    width, height : int
        Sensor size [px], 1 .. 65536.
    pitch_um : float
        Side of a pixel [um].
    focal_length_mm : float
        [mm]
    f_number : float
    blur_px : float
        Standard deviation of the core of the image of a point [px]; see `constants.csv`, also for the next two.
    halo_fraction : float
        Share of the light of a point that lands in a wide halo (glare of lens and plate), 0 .. 1.
    halo_px : float
        Standard deviation of that halo [px].
    infrared_filter : bool
        True with the IR88 filter of III-A in front of the lens.

    Raises
    ------
    ValueError
        If a value is impossible.
    """

    width: int = 1280
    height: int = 720
    pitch_um: float = 4.86
    focal_length_mm: float = 8.0
    f_number: float = 5.6
    blur_px: float = constant("blur_px")
    halo_fraction: float = constant("halo_fraction")
    halo_px: float = constant("halo_px")
    infrared_filter: bool = False

    def __post_init__(self) -> None:
        if not (1 <= self.width <= 65536 and 1 <= self.height <= 65536):
            raise ValueError(f"width={self.width}, height={self.height}: choose 1 .. 65536 px each")
        for name in ("pitch_um", "focal_length_mm", "f_number", "blur_px", "halo_px"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)} is not possible; choose more than 0")
        if not 0 <= self.halo_fraction < 1:
            raise ValueError(f"halo_fraction={self.halo_fraction} is not in 0 .. 1")

    @property
    def focal_px(self) -> float:
        """Focal length in pixels: an object of size s at distance d is ``s * focal_px / d`` pixels wide."""
        return self.focal_length_mm * 1e3 / self.pitch_um

    @property
    def matrix(self) -> Floats:
        """Camera matrix K, shape (3, 3); the centres of pixels have whole coordinates."""
        return np.array(
            [
                [self.focal_px, 0.0, (self.width - 1) / 2],
                [0.0, self.focal_px, (self.height - 1) / 2],
                [0.0, 0.0, 1.0],
            ]
        )

    def project(self, points_m: npt.ArrayLike) -> Floats:
        """Project points into the image.

        Parameters
        ----------
        points_m : array_like, shape (n, 3)
            Points in camera axes [m].

        Returns
        -------
        ndarray, shape (n, 2)
            Image points x, y [px]; nan for a point behind the camera.

        Examples
        --------
        >>> Optics().project([[0.0, 0.0, 2.5]])
        array([[639.5, 359.5]])
        """
        points = np.asarray(points_m, float)
        depth = np.where(points[:, 2:] > 1e-6, points[:, 2:], np.nan)
        return np.asarray((points @ self.matrix.T)[:, :2] / depth)


@dataclass(frozen=True, kw_only=True)
class Light:
    """The illumination of the scene, and the brightness of the LED relative to it.

    Parameters
    ----------
    illuminance_lux : float
        350 in the paper's office, 2000 on its evening outdoors, 10,000 and more at noon [lx].
    reflectance : float
        Reflectance of the surroundings relative to the office's mean.
    plate_reflectance : float
        The same of the plate with its LED off; 1 makes the dark plate invisible.
    led_to_ambient : float
        Signal of a red face at 10.7 mA on 5 cm relative to that of the office; see `constants.csv`.
    infrared_led_to_ambient : float
        The same of the 940 nm LED without a filter; assumed to be equal.
    infrared_share : float
        Signal of ambient light beyond the visible, relative to that of office lamps of the same illuminance. With the
        filter, this is the light at 940 nm; without it, all light that the sensor sees and a lux meter does not. It is
        near 0 under office lamps and of order 1 in daylight.

    Raises
    ------
    ValueError
        If a value is impossible.
    """

    illuminance_lux: float = 350.0
    reflectance: float = 1.0
    plate_reflectance: float = 1.0
    led_to_ambient: float = constant("led_to_ambient")
    infrared_led_to_ambient: float = constant("led_to_ambient")
    infrared_share: float = OFFICE_INFRARED_SHARE

    def __post_init__(self) -> None:
        for name in ("illuminance_lux", "reflectance", "plate_reflectance"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)}: a log pixel needs some light; choose more than 0")
        for name in ("led_to_ambient", "infrared_led_to_ambient", "infrared_share"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name}={getattr(self, name)} is negative; choose 0 or more")


def ambient_signal(light: Light, optics: Optics) -> float:
    """Return the signal of a surface of reflectance 1.

    Parameters
    ----------
    light : Light
    optics : Optics

    Returns
    -------
    float
        1 for the paper's office; multiply it by the reflectance of another surface.
    """
    share = light.infrared_share
    seen = IR88_TRANSMITTANCE * share if optics.infrared_filter else 1 + share
    opening = (REFERENCE_F_NUMBER / optics.f_number) ** 2
    # By definition 1 for the paper's office, with the little infrared light of its lamps.
    return light.illuminance_lux / REFERENCE_LUX * seen / (1 + OFFICE_INFRARED_SHARE) * opening


def led_signal(luminance_ratio: float, band: str, light: Light, optics: Optics) -> float:
    """Return the signal of a face whose LED is fully on.

    Parameters
    ----------
    luminance_ratio : float
        Luminance of the face relative to 10.7 mA on 5 cm.
    band : {"visible", "infrared"}
    light : Light
    optics : Optics

    Returns
    -------
    float
        0 for a red LED behind the infrared filter.
    """
    opening = (REFERENCE_F_NUMBER / optics.f_number) ** 2
    if band == "infrared":
        passed = IR88_TRANSMITTANCE if optics.infrared_filter else 1.0
        return luminance_ratio * light.infrared_led_to_ambient * passed * opening
    return 0.0 if optics.infrared_filter else luminance_ratio * light.led_to_ambient * opening


def plate_homography(pose: Pose, optics: Optics) -> Floats:
    """Return the homography from a plane z = 0 to the image.

    Parameters
    ----------
    pose : Pose
        Pose of the plane in camera axes.
    optics : Optics

    Returns
    -------
    ndarray, shape (3, 3)
        From x, y on the plane [m] to image points [px].
    """
    columns = np.column_stack([pose.rotation[:, 0], pose.rotation[:, 1], pose.position_m])
    return np.asarray(optics.matrix @ columns)
