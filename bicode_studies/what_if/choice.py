"""One way to build it: packet, times, marker, light.   choice -> what stands against it, scene and receiver

A `Choice` is a question, so it may be impossible; `remarks` says in words what is wrong with
it, at the setting that has to change. Its scene holds the marker in a small window of its own
in the middle of the sensor, which is why `what_if.ask` answers within a tenth of a second.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bicode_lab.camera import Light, Optics, PixelModel, PlacedMarker, Pose, Scene, Still
from bicode_lab.camera.plate_image import reach_px
from bicode_lab.marker import Board, Marker, PacketFormat
from bicode_lab.marker.packet import ChecksumKind
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.what_if.packet_timing import rate_bounds_hz, whole_packet_chance

MOST_PERIODS = 10
LEAST_PERIODS = 1
MOST_SECONDS = 1.0  # of a recording
MOST_PIXEL_SECONDS = 900.0  # lit pixels times seconds; a marker at 0.5 m makes 25 million events a second
TOO_MANY_PIXEL_SECONDS = 4000.0  # in a single period; a 10 cm marker at 0.5 m makes a good 3500 in 33 ms
ARUCO_FLOOR_PX = 9.6  # default `minMarkerPerimeterRate` 0.03 of 1280 px, over four sides

LIMITS: dict[str, tuple[float, float]] = {
    "f_id_hz": (100, 20_000), "start_bits": (2, 16), "payload_bits": (1, 32),
    "delta_t_whole_us": (1_000, 200_000), "delta_t_2d_us": (1, 200_000), "delta_t_blinker_us": (1, 200_000),
    "delta_t_id_us": (1, 5_000), "size_m": (0.01, 0.1), "current_ma": (0, 100), "distance_m": (0.5, 60),
    "illuminance_lux": (1, 100_000),
}  # fmt: skip
"""What can be asked about: from, to."""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """One way to build it; the defaults are the paper's. Any number may be given; see `remarks`.

    Parameters
    ----------
    f_id_hz, start_bits, payload_bits, checksum
        Of the packet, see `marker.PacketFormat`; the checksum has three bits.
    delta_t_whole_us, delta_t_2d_us, delta_t_blinker_us, delta_t_id_us : int
        The receiver's times [us].
    size_m, current_ma : float
        Side of the plate [m] and LED current [mA].
    distance_m : float
        Camera to marker, which faces it [m].
    illuminance_lux : float
    """

    f_id_hz: float = 1000.0
    start_bits: int = 3
    payload_bits: int = 8
    checksum: ChecksumKind = "sum"
    delta_t_whole_us: int = 33_000
    delta_t_2d_us: int = 13_200
    delta_t_blinker_us: int = 2_000
    delta_t_id_us: int = 250
    size_m: float = 0.05
    current_ma: float = 10.7
    distance_m: float = 5.0
    illuminance_lux: float = 350.0

    @property
    def packet_format(self) -> PacketFormat:
        """What the marker sends."""
        return PacketFormat(
            f_id_hz=self.f_id_hz,
            start_bits=self.start_bits,
            payload_bits=self.payload_bits,
            checksum=self.checksum,
        )

    @property
    def side_px(self) -> float:
        """Side of the marker's image [px]."""
        return self.size_m * Optics().focal_px / self.distance_m

    def receiver(self) -> ReceiverSettings:
        """The receiver that looks for the 2D marker on the whole sensor."""
        return ReceiverSettings(
            packet_format=self.packet_format,
            delta_t_whole_us=self.delta_t_whole_us,
            delta_t_2d_us=self.delta_t_2d_us,
            delta_t_blinker_us=self.delta_t_blinker_us,
            delta_t_id_us=self.delta_t_id_us,
            pattern_size_m=self.size_m,
        )

    def scene(self, seed: int) -> Scene:
        """A seed in; the marker, with a payload, a phase and a sub-pixel place of its own, in its window out."""
        rng = np.random.default_rng([seed, 1])
        whole = Optics()
        half = int(np.ceil(self.side_px / 2 + reach_px(whole))) + 2
        width, height = min(2 * half, whole.width), min(2 * half, whole.height)
        x_m, y_m = rng.uniform(-0.5, 0.5, 2) * self.distance_m / whole.focal_px
        f = self.packet_format
        marker = Marker(
            payload=int(rng.integers(1, 2**f.payload_bits)),
            board=Board(size_m=self.size_m),
            packet_format=f,
            current_ma=self.current_ma,
            phase_us=float(rng.uniform(0, f.packet_us)),
        )
        path = Still(Pose.facing(self.distance_m, x_m=float(x_m), y_m=float(y_m)))
        return Scene(
            markers=(PlacedMarker(marker=marker, path=path),),
            optics=replace(whole, width=width, height=height),
            light=Light(illuminance_lux=self.illuminance_lux),
            pixel_model=PixelModel(hot_pixels=0),  # eight on the whole sensor are none in a window
        )

    def periods(self) -> int:
        """How many periods one recording has: fewer where they are long, or the marker large."""
        period_s = self.delta_t_whole_us * 1e-6
        affordable = min(MOST_SECONDS, MOST_PIXEL_SECONDS / self.side_px**2) / period_s
        return int(np.clip(affordable, LEAST_PERIODS, MOST_PERIODS))

    def seconds(self) -> float:
        """Length of one recording [s]."""
        return self.periods() * self.delta_t_whole_us * 1e-6

    def as_sent(self) -> Choice:
        """The same with the paper's receiver: choices that agree in it send alike and are seen alike."""
        times = ("delta_t_whole_us", "delta_t_2d_us", "delta_t_blinker_us", "delta_t_id_us")
        return replace(self, **{name: getattr(Choice(), name) for name in times})


@dataclass(frozen=True)
class Remark:
    """What stands against a choice: at which setting, in words, and whether it makes it impossible to ask."""

    setting: str
    words: str
    impossible: bool = False


def remarks(choice: Choice) -> tuple[Remark, ...]:
    """A choice in, what stands against it out, the impossible first; nothing where nothing does.

    Examples
    --------
    >>> for remark in remarks(Choice(f_id_hz=400, delta_t_blinker_us=5000)):
    ...     print(remark.setting, "-", remark.words)
    f_id_hz - a packet lasts 35 ms and the period 33 ms: no period ever holds a whole packet, so no period has an ID;
    choose f_ID of 424 Hz or more (848 Hz for every period), a shorter packet, or delta_t_whole of 35 ms or more
    """
    outside = _outside(choice)
    if outside:
        return outside
    f = choice.packet_format
    impossible = []
    if choice.delta_t_id_us > f.chip_us:
        impossible.append(
            Remark(
                "delta_t_id_us",
                f"{choice.delta_t_id_us} us is longer than one chip, {f.chip_us:g} us at {f.f_id_hz:g} Hz: a count "
                f"would hold the LED's on and off in one; choose {int(f.chip_us)} us or less, or f_ID of "
                f"{5e5 / choice.delta_t_id_us:.0f} Hz or less (II-B)",
                True,
            )
        )
    for name in ("delta_t_2d_us", "delta_t_blinker_us"):
        if getattr(choice, name) > choice.delta_t_whole_us:
            words = f"longer than the period, {_ms(choice.delta_t_whole_us)}; choose that or less (II-A)"
            impossible.append(Remark(name, f"{_ms(getattr(choice, name))} is {words}", True))
    if choice.side_px**2 * choice.delta_t_whole_us * 1e-6 > TOO_MANY_PIXEL_SECONDS:
        words = (
            f"a marker of {choice.side_px:.0f} px makes too many events in {_ms(choice.delta_t_whole_us)} to be asked "
            f"here; choose {choice.distance_m * 2:g} m, a smaller marker or a shorter period"
        )
        impossible.append(Remark("distance_m", words, True))
    return (*impossible, *_doubts(choice, f))


def _outside(choice: Choice) -> tuple[Remark, ...]:
    """What is no number to ask about."""
    found = []
    for name, (low, high) in LIMITS.items():
        value = getattr(choice, name)
        whole = name.endswith(("_us", "_bits"))
        if not low <= value <= high or (whole and value != int(value)):
            kind = "a whole number from" if whole else "from"
            found.append(Remark(name, f"{value:g} cannot be asked; choose {kind} {low:g} to {high:g}", True))
    if choice.checksum not in ("sum", "crc3"):
        found.append(Remark("checksum", f"{choice.checksum!r} is not known; choose 'sum' or 'crc3'", True))
    return tuple(found)


def _doubts(choice: Choice, f: PacketFormat) -> list[Remark]:
    """What can be asked and will not go well."""
    found = []
    ever_hz, surely_hz = rate_bounds_hz(choice.delta_t_whole_us, f.packet_bits)
    chance = whole_packet_chance(choice.delta_t_whole_us, f.packet_us)
    lasts = f"a packet lasts {_ms(f.packet_us)} and the period {_ms(choice.delta_t_whole_us)}"
    if chance == 0:
        way_out = f"a shorter packet, or delta_t_whole of {_ms(f.packet_us)} or more"
        words = (
            f"{lasts}: no period ever holds a whole packet, so no period has an ID; choose f_ID of {ever_hz:.0f} Hz "
            f"or more ({surely_hz:.0f} Hz for every period), {way_out}"
        )
        found.append(Remark("f_id_hz", words))
    elif chance < 1:
        words = f"{lasts}: only {chance:.0%} of periods hold a whole packet; from {surely_hz:.0f} Hz on every one does"
        found.append(Remark("f_id_hz", words))
    if choice.delta_t_blinker_us < 4 * f.chip_us:
        words = (
            f"{_ms(choice.delta_t_blinker_us)} is shorter than two bits, {_ms(4 * f.chip_us)}: some frames hold no ON "
            "and OFF side by side, and the region may be lost"
        )
        found.append(Remark("delta_t_blinker_us", words))
    if choice.delta_t_blinker_us == choice.delta_t_whole_us:
        words = "as long as the period: nothing is left to slide over, so no region is found; choose less"
        found.append(Remark("delta_t_blinker_us", f"{_ms(choice.delta_t_blinker_us)} is {words}"))
    if choice.side_px < ARUCO_FLOOR_PX:
        words = (
            f"the pattern is {choice.side_px:.1f} px wide, below the {ARUCO_FLOOR_PX} px that ArUco looks at: "
            f"ID only, no pose; nearer than {choice.size_m * Optics().focal_px / ARUCO_FLOOR_PX:.1f} m it may be seen"
        )
        found.append(Remark("distance_m", words))
    return found


def _ms(length_us: float) -> str:
    """A length in, its milliseconds to read out."""
    return f"{length_us / 1e3:.4g} ms"
