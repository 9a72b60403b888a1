"""The paper's receiver (II). Each box of Fig. 2 is a file here.

- Boxes a, b, d and e, events accumulated into frames: `accumulate`.
- Box c, ArUco recognition and pose of the 2D marker: `marker_2d`.
- Box f, blinker regions and their tracking: `regions` (with `components`) finds them, `track` follows them.
- Box g, LED state and ID: `led_state` counts ON and OFF, `chips` finds edges and clock, `decode` reads the packets.

`receiver` connects the boxes and reads a stream period by period, with the bookkeeping of `periods`. `settings` holds
everything that may be changed, `sighting` the results. `event_codes` makes the loops over events fast.
"""

from bicode_lab.recognition.accumulate import accumulate, count_events, frames
from bicode_lab.recognition.decode import REASONS, Packet, decode_packets
from bicode_lab.recognition.led_state import LedCounter, count_on_off, edge_gates, led_state
from bicode_lab.recognition.marker_2d import Marker2d, find_marker_2d, find_pose, frame_2d, to_image
from bicode_lab.recognition.receiver import (
    PeriodReader,
    ReaderSettings,
    Receiver,
    recognise,
    start_receiver,
)
from bicode_lab.recognition.regions import Region, RegionFinder, find_regions
from bicode_lab.recognition.settings import ReceiverSettings, settings_for
from bicode_lab.recognition.sighting import PacketRow, Sighting, packet_rows, to_table
from bicode_lab.recognition.track import Track, Tracker

__all__ = [
    "REASONS",
    "LedCounter",
    "Marker2d",
    "Packet",
    "PacketRow",
    "PeriodReader",
    "ReaderSettings",
    "Receiver",
    "ReceiverSettings",
    "Region",
    "RegionFinder",
    "Sighting",
    "Track",
    "Tracker",
    "accumulate",
    "count_events",
    "count_on_off",
    "decode_packets",
    "edge_gates",
    "find_marker_2d",
    "find_pose",
    "find_regions",
    "frame_2d",
    "frames",
    "led_state",
    "packet_rows",
    "recognise",
    "settings_for",
    "start_receiver",
    "to_image",
    "to_table",
]
