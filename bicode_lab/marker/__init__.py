"""The transmitter (III-A): a packet is encoded by Manchester coding and blinked by an LED in an acrylic plate."""

from bicode_lab.marker.board import Board
from bicode_lab.marker.led import LedWaveform, luminance_ratio
from bicode_lab.marker.manchester import manchester_decode, manchester_encode
from bicode_lab.marker.marker import Marker
from bicode_lab.marker.packet import PacketFormat, encode_packet

__all__ = [
    "Board",
    "LedWaveform",
    "Marker",
    "PacketFormat",
    "encode_packet",
    "luminance_ratio",
    "manchester_decode",
    "manchester_encode",
]
