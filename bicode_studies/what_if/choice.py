"""A choice of packet, times, marker and light: its scene, its receiver, and remarks on what is wrong with it.

A choice may be impossible. `list_remarks` says in words what is wrong, and which setting has to change. The scene holds
the marker in a small window in the middle of the sensor, so that `ask.ask` takes only a tenth of a second.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bicode_lab.camera import Light, Optics, PixelModel, PlacedMarker, Pose, Scene, Still
from bicode_lab.camera.plate_image import reach_px
from bicode_lab.marker import Board, Marker, PacketFormat
from bicode_lab.marker.packet import ChecksumKind
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.what_if.packet_timing import rate_bounds_hz, whole_packet_probability

MOST_PERIODS, LEAST_PERIODS = 10, 1  # of a recording
MOST_SECONDS = 1.0  # of a recording
# Lit pixels times seconds, of a recording and of a period. A marker at 0.5 m makes 25 million events per second; one of
# 10 cm has slightly more than 3500 pixel seconds in 33 ms there.
MOST_PIXEL_SECONDS = 900.0
TOO_MANY_PIXEL_SECONDS = 4000.0
ARUCO_FLOOR_PX = 9.6  # default `minMarkerPerimeterRate` of 0.03 times 1280 px, over four sides

LIMITS: dict[str, tuple[float, float]] = {
    "f_id_hz": (100, 20_000), "start_bits": (2, 16), "payload_bits": (1, 32),
    "delta_t_whole_us": (1_000, 200_000), "delta_t_2d_us": (1, 200_000), "delta_t_blinker_us": (1, 200_000),
    "delta_t_id_us": (1, 5_000), "size_m": (0.01, 0.1), "current_ma": (0, 100), "distance_m": (0.5, 60),
    "illuminance_lux": (1, 100_000),
}  # fmt: skip
"""Least and greatest value of each setting."""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """One choice of the settings; the defaults are the paper's. Any numbers are accepted, see `list_remarks`.

    Parameters
    ----------
    f_id_hz : float
        Bit rate [Hz].
    start_bits, payload_bits : int
        Lengths of the start and of the payload [bit].
    checksum : {"sum", "crc3"}
        Kind of the checksum, which has three bits.
    delta_t_whole_us, delta_t_2d_us, delta_t_blinker_us, delta_t_id_us : int
        Times of the receiver [us].
    size_m : float
        Side of the plate [m].
    current_ma : float
        LED current [mA].
    distance_m : float
        Distance from the camera to the marker, which faces it [m].
    illuminance_lux : float
        Illuminance of the surroundings [lx].
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
        """Format of the packets that the marker sends."""
        return PacketFormat(
            f_id_hz=self.f_id_hz,
            start_bits=self.start_bits,
            payload_bits=self.payload_bits,
            checksum=self.checksum,
        )

    @property
    def side_px(self) -> float:
        """Side of the plate's image [px]."""
        return self.size_m * Optics().focal_px / self.distance_m

    def receiver(self) -> ReceiverSettings:
        """Return the settings of the receiver, on the whole sensor."""
        return ReceiverSettings(
            packet_format=self.packet_format,
            delta_t_whole_us=self.delta_t_whole_us,
            delta_t_2d_us=self.delta_t_2d_us,
            delta_t_blinker_us=self.delta_t_blinker_us,
            delta_t_id_us=self.delta_t_id_us,
            pattern_size_m=self.size_m,
        )

    def scene(self, seed: int) -> Scene:
        """Place the marker in a window of its own.

        Parameters
        ----------
        seed : int
            Seed of the payload, of the phase of the packet and of the place within a pixel.

        Returns
        -------
        Scene
        """
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
            pixel_model=PixelModel(hot_pixels=0),  # the sensor has eight, so a window has most likely none
        )

    def periods(self) -> int:
        """Return the number of periods of a recording: fewer if periods are long or the marker is large."""
        period_s = self.delta_t_whole_us * 1e-6
        affordable = min(MOST_SECONDS, MOST_PIXEL_SECONDS / self.side_px**2) / period_s
        return int(np.clip(affordable, LEAST_PERIODS, MOST_PERIODS))

    def seconds(self) -> float:
        """Return the length of a recording [s]."""
        return self.periods() * self.delta_t_whole_us * 1e-6

    def with_paper_receiver(self) -> Choice:
        """Return the same choice with the paper's times; choices for which it is equal can share a recording."""
        times = ("delta_t_whole_us", "delta_t_2d_us", "delta_t_blinker_us", "delta_t_id_us")
        return replace(self, **{name: getattr(Choice(), name) for name in times})


@dataclass(frozen=True)
class Remark:
    """A problem of a choice.

    Attributes
    ----------
    setting : str
        Name of the setting that has to change.
    words : str
        What is wrong, and what to choose instead.
    impossible : bool
        Whether the choice cannot be simulated.
    """

    setting: str
    words: str
    impossible: bool = False


def list_remarks(choice: Choice) -> tuple[Remark, ...]:
    """List the problems of a choice, the impossible ones first.

    Parameters
    ----------
    choice : Choice

    Returns
    -------
    tuple of Remark
        Empty if there are none. If values are out of range, only these are listed.

    Examples
    --------
    >>> for remark in list_remarks(Choice(f_id_hz=400, delta_t_blinker_us=5000)):
    ...     print(remark.setting, "-", remark.words)
    f_id_hz - a packet lasts 35 ms and the period 33 ms: no period ever holds a whole packet, so no period has an ID;
    choose f_ID of 424 Hz or more (848 Hz or more for every period to hold one), a shorter packet, or delta_t_whole of
    35 ms or more
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
                f"{choice.delta_t_id_us} us is longer than one chip, {f.chip_us:g} us at {f.f_id_hz:g} Hz: one "
                f"count would mix the LED's on and off states; choose {int(f.chip_us)} us or less, or f_ID of "
                f"{5e5 / choice.delta_t_id_us:.0f} Hz or less (II-B)",
                True,
            )
        )
    for name in ("delta_t_2d_us", "delta_t_blinker_us"):
        if getattr(choice, name) > choice.delta_t_whole_us:
            whole = _ms(choice.delta_t_whole_us)
            words = f"{_ms(getattr(choice, name))} is longer than the period, {whole}; choose {whole} or less (II-A)"
            impossible.append(Remark(name, words, True))
    if choice.side_px**2 * choice.delta_t_whole_us * 1e-6 > TOO_MANY_PIXEL_SECONDS:
        words = (
            f"a marker of {choice.side_px:.0f} px makes too many events in {_ms(choice.delta_t_whole_us)} to be "
            f"simulated here; choose {choice.distance_m * 2:g} m, a smaller marker or a shorter period"
        )
        impossible.append(Remark("distance_m", words, True))
    return (*impossible, *_doubts(choice, f))


def _outside(choice: Choice) -> tuple[Remark, ...]:
    """Return remarks on values that are not finite or out of range."""
    found = []
    for name, (low, high) in LIMITS.items():
        value = getattr(choice, name)
        whole = name.endswith(("_us", "_bits"))
        if not low <= value <= high or (whole and value != int(value)):
            kind = "a whole number from" if whole else "from"
            found.append(Remark(name, f"{value:g} is not possible here; choose {kind} {low:g} to {high:g}", True))
    if choice.checksum not in ("sum", "crc3"):
        found.append(Remark("checksum", f"{choice.checksum!r} is not known; choose 'sum' or 'crc3'", True))
    return tuple(found)


def _doubts(choice: Choice, f: PacketFormat) -> list[Remark]:
    """Return remarks on a possible choice that is not read well."""
    found = []
    some_hz, all_hz = rate_bounds_hz(choice.delta_t_whole_us, f.packet_bits)
    probability = whole_packet_probability(choice.delta_t_whole_us, f.packet_us)
    lasts = f"a packet lasts {_ms(f.packet_us)} and the period {_ms(choice.delta_t_whole_us)}"
    if probability == 0:
        way_out = f"a shorter packet, or delta_t_whole of {_ms(f.packet_us)} or more"
        words = (
            f"{lasts}: no period ever holds a whole packet, so no period has an ID; choose f_ID of {some_hz:.0f} Hz "
            f"or more ({all_hz:.0f} Hz or more for every period to hold one), {way_out}"
        )
        found.append(Remark("f_id_hz", words))
    elif probability < 1:
        words = (
            f"{lasts}: only {probability:.0%} of periods hold a whole packet; from {all_hz:.0f} Hz on, every period "
            "holds one"
        )
        found.append(Remark("f_id_hz", words))
    if choice.delta_t_blinker_us < 4 * f.chip_us:
        words = (
            f"{_ms(choice.delta_t_blinker_us)} is shorter than two bits, {_ms(4 * f.chip_us)}: some frames do not "
            "hold both ON and OFF events, so the region may be missed"
        )
        found.append(Remark("delta_t_blinker_us", words))
    if choice.delta_t_blinker_us == choice.delta_t_whole_us:
        words = "as long as the period: the frame cannot slide over the period, so no region is found; choose less"
        found.append(Remark("delta_t_blinker_us", f"{_ms(choice.delta_t_blinker_us)} is {words}"))
    if choice.side_px < ARUCO_FLOOR_PX:
        words = (
            f"the pattern is {choice.side_px:.1f} px wide, and ArUco ignores patterns below {ARUCO_FLOOR_PX} px: "
            f"ID only, no pose; it may be found below {choice.size_m * Optics().focal_px / ARUCO_FLOOR_PX:.1f} m"
        )
        found.append(Remark("distance_m", words))
    return found


def _ms(length_us: float) -> str:
    """Format a length as milliseconds."""
    return f"{length_us / 1e3:.4g} ms"
