"""Settings of the paper's receiver: its times (II, III-B), and what the paper leaves open.

Everything that may be changed about the receiver is a field here; ``dataclasses.replace(settings, delta_t_id_us=500)``
makes settings that differ in one value.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from bicode_lab.marker.board import Glow, aruco_dictionary
from bicode_lab.marker.packet import PacketFormat, is_polarity_ambiguous

FrameRule = Literal["sum", "last", "any"]
FRAME_RULES = ("sum", "last", "any")


@dataclass(frozen=True, kw_only=True)
class ReceiverSettings:
    """Settings of one receiver; the defaults are the paper's values (III-B) where it gives them.

    Parameters
    ----------
    packet_format : PacketFormat
        Format of the packets that the markers send (Fig. 5).
    manchester : {"ieee", "thomas", "auto"}, optional
        Manchester convention; None takes that of `packet_format`, "auto" finds it for each track from the data.
    width, height : int
        Sensor size [px].
    delta_t_whole_us, delta_t_2d_us, delta_t_blinker_us, delta_t_id_us : int
        The paper's accumulation times [us]: one processing period; the frame for the 2D marker, at the start of the
        period; the frame for blinker regions, which slides over the period; the frame for the state of the LED.
    frame_rule_2d : {"any", "sum", "last", "count"}
        How events become the frame for the 2D marker. "sum" is the paper's text, but a pixel with as many ON as OFF
        events vanishes in it.
    frame_rule_blinker : {"blink", "sum", "last", "any"}
        When a pixel looks like a blinker in a frame of delta_t_blinker: "blink" if there are events of both polarities
        near it, the other rules if it is not 0 in the 3-valued frame (the paper's way).
    min_blink_fraction : float
        Fraction of the delta_t_blinker frames of a period in which a pixel must look like a blinker, 0 .. 1.
    opening_px : int
        Opening: active pixels that lie in no full square with this side are dropped [px]; 0 or 1 drops none.
    closing_px : int
        Closing: active pixels with up to this many other pixels between them are one region [px].
    min_region_pixels : int
        Regions with fewer active pixels are dropped (a hot pixel makes a region of one).
    max_regions : int
        Largest number of regions per period; of more, those with the most votes are kept. This limits the time that a
        burst of noise takes.
    led_count : {"pixels", "events"}
        What is counted for the state of the LED: pixels of the 3-valued delta_t_ID frame (II-B), or single events.
    led_gate : float
        Fraction of the count of a usual edge by which ON and OFF must differ, 0 .. 1; 0 is the paper's way.
    latency_us : float
        Time from a rise of the light to its ON events, which is subtracted from the times of the packets [us]. The
        paper gives none; event sensors under office light need 100 .. 200 us.
    denoise_2d : bool
        Whether to remove lone pixels from the frame for the 2D marker; False is the paper's way.
    detect_2d : bool
        Whether to look for 2D markers.
    dictionary : str
        Name of one of OpenCV's predefined ArUco dictionaries.
    glow : {"black", "white"}
        Which cells of the plate are engraved, see `marker.board`.
    pattern_size_m : float
        Side of the ArUco pattern with its frame, for the pose [m].
    focal_px : float
        Focal length [px]; the default is 8 mm divided by 4.86 um.
    cx, cy : float, optional
        Principal point [px]; None takes the middle of the sensor.
    max_age : int
        Number of periods that a track survives without a region.
    min_iou : float
        Least intersection over union of prediction and region for a match, 0 .. 1, see `track`.

    Raises
    ------
    ValueError
        If a value is out of range or does not fit the others.
    """

    packet_format: PacketFormat = field(default_factory=PacketFormat)
    manchester: Literal["ieee", "thomas", "auto"] | None = None
    width: int = 1280
    height: int = 720
    delta_t_whole_us: int = 33_000
    delta_t_2d_us: int = 13_200
    delta_t_blinker_us: int = 2_000
    delta_t_id_us: int = 250
    frame_rule_2d: Literal["any", "sum", "last", "count"] = "any"
    frame_rule_blinker: Literal["blink", "sum", "last", "any"] = "blink"
    min_blink_fraction: float = 0.3
    opening_px: int = 0
    closing_px: int = 2
    min_region_pixels: int = 3
    max_regions: int = 64
    led_count: Literal["pixels", "events"] = "pixels"
    led_gate: float = 0.2
    latency_us: float = 150.0
    denoise_2d: bool = False
    detect_2d: bool = True
    dictionary: str = "DICT_4X4_50"
    glow: Glow = "black"
    pattern_size_m: float = 0.05
    focal_px: float = 1646.09
    cx: float | None = None
    cy: float | None = None
    max_age: int = 5
    min_iou: float = 0.1

    def __post_init__(self) -> None:
        self._check_times()
        self._check_choices()
        self._check_ranges()
        if self.manchester == "auto" and is_polarity_ambiguous(self.packet_format):
            raise ValueError(
                f"manchester='auto' cannot work with payload_bits={self.packet_format.payload_bits} and checksum="
                f"{self.packet_format.checksum!r}: there a packet read in the wrong convention passes its checksum; "
                "choose 'ieee' or 'thomas', or another payload width"
            )
        aruco_dictionary(self.dictionary)  # raises ValueError for an unknown name

    def _check_times(self) -> None:
        for name in ("delta_t_whole_us", "delta_t_2d_us", "delta_t_blinker_us", "delta_t_id_us"):
            value = getattr(self, name)
            if value != int(value) or value < 1:
                raise ValueError(f"{name}={value} is not a whole number of microseconds above 0; choose 1 or more")
        for name in ("delta_t_2d_us", "delta_t_blinker_us"):
            if getattr(self, name) > self.delta_t_whole_us:
                raise ValueError(
                    f"{name}={getattr(self, name)} is longer than delta_t_whole_us={self.delta_t_whole_us}; "
                    f"choose {self.delta_t_whole_us} or less (II-A)"
                )
        chip_us = self.packet_format.chip_us
        if self.delta_t_id_us > chip_us:
            raise ValueError(
                f"delta_t_id_us={self.delta_t_id_us} is longer than one chip ({chip_us:g} us at "
                f"f_id_hz={self.packet_format.f_id_hz:g}); choose {int(chip_us)} or less (II-B)"
            )

    def _check_choices(self) -> None:
        choices: dict[str, tuple[str | None, ...]] = {
            "manchester": (None, "ieee", "thomas", "auto"),
            "frame_rule_2d": (*FRAME_RULES, "count"),
            "frame_rule_blinker": ("blink", *FRAME_RULES),
            "led_count": ("pixels", "events"),
            "glow": ("black", "white"),
        }
        for name, known in choices.items():
            if getattr(self, name) not in known:
                raise ValueError(f"{name}={getattr(self, name)!r} is not known; choose one of {known}")

    def _check_ranges(self) -> None:
        for name, least in {
            "width": 1, "height": 1, "opening_px": 0, "closing_px": 0, "min_region_pixels": 1, "max_regions": 1,
            "max_age": 0,
        }.items():  # fmt: skip
            if getattr(self, name) < least:
                raise ValueError(f"{name}={getattr(self, name)} is too small; choose {least} or more")
        for name in ("min_blink_fraction", "led_gate", "min_iou"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"{name}={getattr(self, name)} is not a share; choose 0 .. 1")
        if not 0 <= self.latency_us <= self.delta_t_whole_us:
            raise ValueError(
                f"latency_us={self.latency_us} is not in 0 .. {self.delta_t_whole_us}; 0 takes nothing off"
            )
        for name in ("pattern_size_m", "focal_px"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)} is not a length; choose more than 0")

    @property
    def conventions(self) -> tuple[Literal["ieee", "thomas"], ...]:
        """Manchester conventions to try."""
        if self.manchester == "auto":
            return ("ieee", "thomas")
        return (self.manchester or self.packet_format.manchester,)

    @property
    def principal_point_px(self) -> tuple[float, float]:
        """Point x, y at which the optical axis meets the sensor [px]; pixel centres are at whole numbers."""
        cx = (self.width - 1) / 2 if self.cx is None else self.cx
        cy = (self.height - 1) / 2 if self.cy is None else self.cy
        return cx, cy


def settings_for(packet_format: PacketFormat, **changes: Any) -> ReceiverSettings:
    """Make settings for a packet format, with the paper's accumulation times scaled to its bit rate and length.

    The paper's times are for 1 kHz and packets of 14 ms: delta_t_blinker is two bits, delta_t_ID half a chip,
    delta_t_whole 33 / 14 of a packet, delta_t_2D 40 % of that.

    Parameters
    ----------
    packet_format : PacketFormat
    **changes
        Fields of `ReceiverSettings` that are set to these values instead.

    Returns
    -------
    ReceiverSettings

    Examples
    --------
    >>> s = settings_for(PacketFormat(f_id_hz=500))
    >>> s.delta_t_whole_us, s.delta_t_2d_us, s.delta_t_blinker_us, s.delta_t_id_us
    (66000, 26400, 4000, 500)
    """
    whole_us = max(1, round(33 / 14 * packet_format.packet_us))
    times = {
        "delta_t_whole_us": whole_us,
        "delta_t_2d_us": max(1, round(0.4 * whole_us)),
        "delta_t_blinker_us": min(whole_us, max(1, round(4 * packet_format.chip_us))),
        "delta_t_id_us": max(1, int(packet_format.chip_us / 2)),
    }
    return ReceiverSettings(packet_format=packet_format, **{**times, **changes})
