"""II, the receiver: the boxes of Fig. 2, in order.   events -> sightings

accumulate (a, b, d, e)   marker_2d (c)   regions, track (f)   led_state, decode (g)   recognise (all)
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
