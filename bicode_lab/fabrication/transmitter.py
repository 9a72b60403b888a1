"""The program of the microcontroller (III-A): a MicroPython file for the RP2040 with the marker's settings."""

from __future__ import annotations

import json
import re
from importlib.resources import files
from typing import Literal, get_args

from bicode_lab.marker import PacketFormat, encode_packet

FILE = "bicode_tx.py"
Code = Literal["bicode", "interval", "uart", "frequency"]
PIN_D0 = 26  # GPIO number of the XIAO RP2040's pin D0
MIN_F_ID_HZ = 4.0  # the clock's divider ends at 65536: 3.05 Hz with a 200 MHz clock, 1.9 Hz with 125 MHz
PINS = 30  # GPIO 0 .. 29


def transmitter_text(
    payload: int, packet_format: PacketFormat, pin: int = PIN_D0, *, code: Code = "bicode", text: str = "HELLO"
) -> str:
    """Fill the settings of a marker into the transmitter program.

    Parameters
    ----------
    payload : int
        The ID to send.
    packet_format : PacketFormat
    pin : int
        GPIO number of the pin that drives the LED, 0 .. 29.
    code : {"bicode", "interval", "uart", "frequency"}
        How the LED blinks. The rate of the others is `packet_format.f_id_hz` too: base periods, bits (baud) or cycles
        per second. The interval code sends `payload`.
    text : str
        What "uart" sends: one letter or more of 7 bits, without a line feed.

    Returns
    -------
    str
        Text of `bicode_tx.py`.

    Raises
    ------
    ValueError
        If the payload does not fit the format, there is no such pin, or the bit rate is too slow for the RP2040.

    Examples
    --------
    >>> text = transmitter_text(0x2A, PacketFormat(manchester="thomas"))
    >>> [line.split("  #")[0] for line in text.splitlines() if line.startswith(("ID", "MANCHESTER"))]
    ['ID = 42', 'MANCHESTER = "thomas"']
    """
    encode_packet(payload, packet_format)  # refuses a payload that does not fit
    if not 0 <= pin < PINS:
        raise ValueError(f"pin={pin} is not a GPIO of the RP2040; choose 0 .. {PINS - 1}, {PIN_D0} is D0 of the XIAO")
    if packet_format.f_id_hz < MIN_F_ID_HZ:
        raise ValueError(
            f"f_id_hz={packet_format.f_id_hz:g} is slower than the RP2040's clock divider allows; "
            f"choose {MIN_F_ID_HZ:g} .. 100000"
        )
    if code not in get_args(Code):
        raise ValueError(f"code={code!r} is not known; choose one of {', '.join(get_args(Code))}")
    if not (text and text.isascii() and text.isprintable()):
        raise ValueError(f"text={text!r} cannot be sent; give one letter or more of 7 bits, without a line feed")
    rate = packet_format.f_id_hz
    settings = {
        "ID": str(payload),
        "PIN": str(pin),
        "F_ID_HZ": str(int(rate)) if rate == int(rate) else repr(float(rate)),
        "START_BITS": str(packet_format.start_bits),
        "PAYLOAD_BITS": str(packet_format.payload_bits),
        "CHECKSUM": f'"{packet_format.checksum}"',
        "CHECKSUM_BITS": str(packet_format.checksum_bits),
        "MANCHESTER": f'"{packet_format.manchester}"',
        "BIT_ORDER": f'"{packet_format.bit_order}"',
        "CODE": f'"{code}"',
        "TEXT": json.dumps(text),
    }
    program = files("bicode_lab.fabrication").joinpath(FILE).read_text(encoding="utf-8")
    for name, value in settings.items():
        line = f"{name} = {value}"
        program, found = re.subn(rf"(?m)^{name} = \S+", lambda _, line=line: line, program)  # type: ignore[misc]
        if found != 1:
            raise RuntimeError(f"{FILE} has {found} lines that set {name}")
    return program
