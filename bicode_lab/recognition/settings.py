"""II and III-B: what the receiver is told.   the paper's times, and what the paper leaves open

Everything that a reader may want to change about the receiver is a field here, and
`dataclasses.replace(settings, delta_t_id_us=500)` is the what-if operator.
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
    """One receiver; the defaults are the paper's (III-B) where it gives them.

    Parameters
    ----------
    packet_format : PacketFormat
        What the markers send (Fig. 5).
    manchester : {"ieee", "thomas", "auto"}, optional
        Convention to read with; None takes that of `packet_format`, "auto" finds it from the data, track by track.
    width, height : int
        Sensor [px].
    delta_t_whole_us, delta_t_2d_us, delta_t_blinker_us, delta_t_id_us : int
        The paper's accumulation times [us]: one processing period, the frame for the 2D marker (from the
        period's start), the frame for blinker regions (slid over the period), the frame for the LED's state.
    frame_rule_2d : {"any", "sum", "last", "count"}
        How events become the 2D marker's frame; "sum" is the text's rule, but it lets a balanced pixel vanish.
    frame_rule_blinker : {"blink", "sum", "last", "any"}
        What a delta_t_blinker frame must show at a pixel to count for a blinker: "blink" both polarities near it,
        the others a non-zero pixel of the 3-valued frame (the paper's way).
    min_blink_fraction : float
        In which share of the delta_t_blinker frames of a period, 0 .. 1; see `regions`.
    opening_px : int
        Opening: glowing pixels that lie in no full square of this side are dropped [px]; 0 or 1 drops none.
    closing_px : int
        Closing: glowing pixels with up to this many dark ones between them are one region [px].
    min_region_pixels : int
        Fewer glowing pixels are no region (a hot pixel is one).
    max_regions : int
        Most regions kept in a period, those of the most frames first; a flood of noise costs no more than this.
    led_count : {"pixels", "events"}
        What is counted for the LED's state: pixels of the 3-valued delta_t_ID frame (II-B), or single events.
    led_gate : float
        Share of a usual edge's count by which ON and OFF must differ to say anything, 0 .. 1; 0 is the paper's way.
    latency_us : float
        From a rise of the LED's light to its ON events, taken off the packets' times [us]. The paper gives none;
        event sensors under office light need 0.1 .. 0.2 ms.
    denoise_2d : bool
        Take lone pixels out of the 2D marker's frame; False is the paper's way.
    detect_2d : bool
        Whether to look for 2D markers at all.
    dictionary : str
        Name of OpenCV's predefined ArUco dictionary.
    glow : {"black", "white"}
        Which cells of the plate are engraved, see `marker.board`.
    pattern_size_m : float
        Side of the ArUco pattern, frame to frame, for the pose [m].
    focal_px : float
        Focal length [px]; 8 mm over 4.86 um.
    cx, cy : float, optional
        Principal point [px]; None takes the middle of the sensor.
    max_age : int
        Periods a track survives without a region.
    min_iou : float
        Least overlap of prediction and region for a match, after both were padded, see `track`.
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
        aruco_dictionary(self.dictionary)  # refuses an unknown name

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
        """The Manchester conventions to try."""
        if self.manchester == "auto":
            return ("ieee", "thomas")
        return (self.manchester or self.packet_format.manchester,)

    @property
    def principal_point_px(self) -> tuple[float, float]:
        """Where the optical axis meets the sensor (x, y) [px]; pixel centres are at whole numbers."""
        cx = (self.width - 1) / 2 if self.cx is None else self.cx
        cy = (self.height - 1) / 2 if self.cy is None else self.cy
        return cx, cy


def settings_for(packet_format: PacketFormat, **changes: Any) -> ReceiverSettings:
    """A packet format in, settings with the paper's accumulation times scaled to its bit rate and length out.

    The paper's times are for 1 kHz and 14 ms: delta_t_blinker two bits, delta_t_ID half a chip,
    delta_t_whole 33 / 14 packets, delta_t_2D 40 % of that. `changes` are fields that are not to be scaled.

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
