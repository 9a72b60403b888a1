"""Numbers that the paper states: its prototype (III) and the conditions of its experiments (IV).

The paper is "Bicode: A Hybrid Blinking Marker System for Event Cameras". A comment names the section of each value.
What the paper leaves open is not in this file.
"""

from __future__ import annotations

from typing import NamedTuple

# III-A, the marker unit
F_ID_HZ = 1000.0  # Manchester bit rate
PACKET_US = 14_000  # a whole packet
PAYLOAD_BITS = 8
PAYLOAD_RATE_BPS = 571  # as printed; 8 bits / 14 ms
START_US = 3_000  # LED off, III-B
FIG_6_PAYLOAD = 0b00100101
PLATE_THICKNESS_M = 0.005

# III-B, the recognition unit
FOCAL_LENGTH_MM = 8.0
F_NUMBER_VISIBLE = 5.6
F_NUMBER_INFRARED = 2.0
DELTA_T_WHOLE_US = 33_000
DELTA_T_2D_US = 13_200
DELTA_T_BLINKER_US = 2_000
DELTA_T_ID_US = 250

# IV, the experiments
OFFICE_LUX = 350.0  # IV-A
EVENING_LUX = 2000.0  # IV-D
FIG_8_CURRENTS_MA = (5.5, 10.7, 21.3)  # IV-A
FIG_9_YAWS_DEG = (0.0, 40.0, 80.0)  # IV-B
FIG_10_SIZES_M = (0.025, 0.05, 0.1)  # IV-C
FIG_10_CURRENTS_MA = (2.7, 10.7, 40.9)  # IV-C
FIG_11_CURRENT_MA = 20.4  # IV-D
FIG_12_SPEEDS_M_PER_S = (0.105, 0.209, 0.314)  # IV-E
FIG_14_SPEEDS_RPM = (16.0, 32.0, 64.0)  # IV-F


class Range(NamedTuple):
    """The greatest distance at which the paper recognised an ID under one condition (350 lx, red LED).

    Attributes
    ----------
    section : str
        Section of the paper that states it.
    current_ma : float
        LED current [mA].
    size_m : float
        Side of the plate [m].
    yaw_deg : float
        Angle of the marker, out of its plane [deg].
    distance_m : float
        The distance [m].
    """

    section: str
    current_ma: float
    size_m: float
    yaw_deg: float
    distance_m: float


RANGES = (
    Range("IV-A", 10.7, 0.05, 0.0, 20.0),
    Range("IV-A", 21.3, 0.05, 0.0, 30.0),
    Range("IV-C", 40.9, 0.1, 0.0, 40.0),  # "above 80% up to"
    Range("IV-B", 10.7, 0.05, 80.0, 10.0),
    Range("IV-C", 2.7, 0.025, 0.0, 7.5),
)
