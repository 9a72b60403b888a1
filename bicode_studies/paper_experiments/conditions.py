"""A condition of the experiments of section IV, which is what the paper states and varies, and its receiver."""

from __future__ import annotations

from dataclasses import dataclass

from bicode_lab import paper
from bicode_lab.constants import constant
from bicode_lab.recognition import ReceiverSettings


@dataclass(frozen=True, kw_only=True)
class Condition:
    """The settings of one condition of an experiment; the defaults are those of IV-A.

    Attributes
    ----------
    figure : str
        Number of the paper's figure, "08" .. "14".
    distance_m : float
        Distance from camera to marker [m].
    size_m : float
        Side of the marker's plate [m].
    current_ma : float
        Current of the LED [mA].
    band : {"red", "infrared"}
        Colour of the LED. With the infrared one the IR88 filter is on and the lens is set to F2.0 (III-B).
    illuminance_lux : float
        Illuminance at the marker [lx].
    yaw_deg : float
        Angle between the marker's normal and the optical axis [deg] (IV-B).
    speed_m_per_s : float
        Tangential speed of the pan at the marker's distance [m/s] (IV-E); 0 is a camera at rest.
    rpm : float
        Speed at which the marker turns in its plane [revolutions per minute] (IV-F).
    duration_s : float
        Length of the recording [s].
    """

    figure: str
    distance_m: float
    size_m: float = 0.05
    current_ma: float = 10.7
    band: str = "red"
    illuminance_lux: float = paper.OFFICE_LUX
    yaw_deg: float = 0.0
    speed_m_per_s: float = 0.0
    rpm: float = 0.0
    duration_s: float = 0.66

    @property
    def moves(self) -> bool:
        """True where the camera or the marker moves."""
        return bool(self.speed_m_per_s or self.rpm)


def receiver_settings(condition: Condition) -> ReceiverSettings:
    """Return the settings of the receiver that reads a condition.

    Parameters
    ----------
    condition : Condition
        Its `size_m` is the size of the pattern that the receiver expects.

    Returns
    -------
    ReceiverSettings
        The paper's accumulation times; the opening and the minimum region size of `constants.csv`.
    """
    return ReceiverSettings(
        pattern_size_m=condition.size_m,
        opening_px=round(constant("opening_px")),
        min_region_pixels=round(constant("min_region_pixels")),
    )
