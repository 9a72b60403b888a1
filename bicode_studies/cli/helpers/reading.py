"""What a user asks of a receiver: its settings from options, files of marker and camera, and which receiver it is.

A new receiver is one more line in `RECEIVERS`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import click

from bicode_lab.marker import PacketFormat
from bicode_lab.recognition import ReceiverSettings, Sighting, settings_for
from bicode_lab.sequential import SequentialSettings
from bicode_lab.soft_receiver import SoftSettings
from bicode_studies.cli.helpers.camera_file import Camera, read_camera
from bicode_studies.cli.helpers.marker_options import marker_of
from bicode_studies.cli.options import Number
from bicode_studies.inspect.answer import remark_on_long_packets

PERIOD_US, FRAME_2D_US = 33_000, 13_200  # the paper's values (III-B), for any bit rate of the marker
TIMES = {
    "delta_t_whole_us": f"Length of a period [us].  [default: {PERIOD_US}]",
    "delta_t_2d_us": "Length of the frame for the 2D marker [us].  [default: 40 % of a period]",
    "delta_t_blinker_us": "Length of the sliding frame for blinking regions [us].  [default: two bits, 2000 at 1 kHz]",
    "delta_t_id_us": "Length of a bin of the LED state [us].  [default: half a chip, 250 at 1 kHz]",
}
CAMERA_HELP = "Calibration of the camera for the pose: YAML of OpenCV, camera_info of ROS, or camchain of Kalibr."

Settings = ReceiverSettings | SequentialSettings | SoftSettings
RECEIVERS: dict[str, Callable[[ReceiverSettings], Settings]] = {
    "sequential": lambda settings: SequentialSettings(receiver=settings),
    "paper": lambda settings: settings,
    "soft": lambda settings: SoftSettings(receiver=settings),
}
GIVES_POSES = {"sequential", "paper"}
READS_WHOLE_PERIODS = {"paper"}  # receivers that read a packet only where it lies whole in a period


def time_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add an option for each time of the receiver."""
    for name, words in reversed(TIMES.items()):
        command = click.option(f"--{name.replace('_', '-')}", type=Number(), help=words)(command)
    return command


@dataclass(frozen=True, kw_only=True)
class Request:
    """What is asked of a receiver.

    Parameters
    ----------
    settings : ReceiverSettings
        Packet, times, sensor and camera.
    receiver : ReceiverSettings, SequentialSettings or SoftSettings
        The receiver that was chosen, with these settings.
    camera : Camera or None
        The camera of ``--camera``.
    remarks : tuple of str
        What the user should know before it begins.
    """

    settings: ReceiverSettings
    receiver: Settings
    camera: Camera | None
    remarks: tuple[str, ...]

    def corrected(self, sighting: Sighting) -> Sighting:
        """Return a sighting whose pose allows for the distortion of the camera."""
        return self.camera.corrected(sighting, self.settings) if self.camera else sighting


def request_of(options: dict[str, Any], width: int, height: int, *, periods: int = 1) -> Request:
    """Return what the options of the command line ask for.

    Parameters
    ----------
    options : dict
        Options by name.
    width, height : int
        Sensor size [px].
    periods : int
        In how many periods in a row a packet has to lie to be read.

    Returns
    -------
    Request

    Raises
    ------
    ValueError
        If a value is impossible, the paper's receiver can never read such packets, or the camera is another one.
    """
    camera = read_camera(options["camera"]) if options["camera"] else None
    settings = _settings(options, width, height, camera)
    receiver = RECEIVERS[options["receiver"]](settings)
    remarks = []
    if camera is not None and options["receiver"] not in GIVES_POSES:
        remarks.append(f"--camera is for poses, and --receiver {options['receiver']} gives none; it is not used")
    if options["receiver"] in READS_WHOLE_PERIODS:
        refuse_long_packets(settings, periods)
        long = remark_on_long_packets(settings) if periods == 1 else None
        remarks += [long] if long else []
    return Request(settings=settings, receiver=receiver, camera=camera, remarks=tuple(remarks))


def _settings(options: dict[str, Any], width: int, height: int, camera: Camera | None) -> ReceiverSettings:
    """Return the receiver settings that the options and the camera describe."""
    marker = marker_of(options, any_payload=True)
    times = {name: options[name] for name in TIMES if options[name] is not None}
    whole_us = times.setdefault("delta_t_whole_us", PERIOD_US)
    times.setdefault("delta_t_2d_us", FRAME_2D_US if whole_us == PERIOD_US else max(1, round(0.4 * whole_us)))
    given: dict[str, Any] = {"focal_px": options["focal_px"]} if options["focal_px"] is not None else {}
    if camera is not None:
        given = _of_camera(camera, options, width, height)
    if options["manchester"] == "auto":
        given["manchester"] = "auto"
    size_m = options["size_m"]
    return settings_for(
        marker.packet_format,
        width=width,
        height=height,
        dictionary=marker.board.dictionary,
        glow=marker.board.glow,
        pattern_size_m=marker.board.pattern_size_m if size_m is None else size_m,
        **times,
        **given,
    )


def _of_camera(camera: Camera, options: dict[str, Any], width: int, height: int) -> dict[str, Any]:
    """Return focal length and principal point of a camera, after checking that it is the one of the recording."""
    if options["focal_px"] is not None:
        raise ValueError("--camera and --focal-px both state the focal length; give one of them")
    if camera.size_px is not None and camera.size_px != (width, height):
        calibrated = f"{camera.size_px[0]}x{camera.size_px[1]}"
        raise ValueError(
            f"{options['camera']} is the calibration of a sensor of {calibrated} px, and the recording has "
            f"{width}x{height} px; give the calibration of that camera"
        )
    cx, cy = camera.centre_px
    return {"focal_px": math.sqrt(camera.focal_px[0] * camera.focal_px[1]), "cx": cx, "cy": cy}


def refuse_long_packets(settings: ReceiverSettings, periods: int) -> None:
    """Raise ValueError if a packet never lies in `periods` periods: then the paper's receiver cannot read it.

    Parameters
    ----------
    settings : ReceiverSettings
    periods : int

    Raises
    ------
    ValueError
        The line says what to choose.
    """
    f: PacketFormat = settings.packet_format
    longest_us = periods * settings.delta_t_whole_us
    if f.packet_us > longest_us:
        least_hz = math.ceil(f.f_id_hz * f.packet_us / longest_us)
        raise ValueError(
            f"a packet of {f.packet_us / 1000:g} ms (f_id_hz={f.f_id_hz:g}) is never whole in {longest_us / 1000:g} ms "
            f"and cannot be read; choose --f-id-hz {least_hz} or more, --delta-t-whole-us "
            f"{round(33 / 14 * f.packet_us)}, or --receiver soft"
        )
