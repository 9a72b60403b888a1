"""A marker unit (III-A): a plate, a packet and an LED current."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from bicode_lab.marker.board import Board
from bicode_lab.marker.led import LedWaveform, luminance_ratio
from bicode_lab.marker.packet import PacketFormat

Band = Literal["visible", "infrared"]


@dataclass(frozen=True, kw_only=True)
class Marker:
    """One Bicode marker; the defaults are the paper's prototype, which sends the payload of Fig. 6.

    Parameters
    ----------
    payload : int
        The blinked ID, 0 .. 2**payload_bits - 1.
    board : Board
        The plate with its ArUco pattern.
    packet_format : PacketFormat
    current_ma : float
        LED current [mA]; the paper uses 2.7 .. 40.9.
    band : {"visible", "infrared"}
        The red LED or the 940 nm LED of III-A.
    phase_us, clock_error_ppm, rise_time_us : float
        See `LedWaveform`.

    Raises
    ------
    ValueError
        If a value is impossible or the payload does not fit the packet format.
    """

    payload: int = 0x25
    board: Board = field(default_factory=Board)
    packet_format: PacketFormat = field(default_factory=PacketFormat)
    current_ma: float = 10.7
    band: Band = "visible"
    phase_us: float = 0.0
    clock_error_ppm: float = 0.0
    rise_time_us: float = 0.0

    def __post_init__(self) -> None:
        if self.band not in ("visible", "infrared"):
            raise ValueError(f"band={self.band!r} is not known; choose 'visible' or 'infrared'")
        self.luminance_ratio  # noqa: B018  refuses a negative current
        self.waveform  # noqa: B018  refuses a payload that does not fit

    @property
    def waveform(self) -> LedWaveform:
        """The LED's light over time."""
        return LedWaveform(
            payload=self.payload,
            packet_format=self.packet_format,
            phase_us=self.phase_us,
            clock_error_ppm=self.clock_error_ppm,
            rise_time_us=self.rise_time_us,
        )

    @property
    def luminance_ratio(self) -> float:
        """Luminance of the face relative to that of 10.7 mA on a 5 cm plate."""
        return luminance_ratio(self.current_ma, self.board.size_m)
