from .camera import PlacedMarker, Pose, Scene, Still, pan, record, spin
from .marker import Board, Marker, PacketFormat
from .recognition import ReceiverSettings, accumulate, recognise, to_table
from .recordings import open_recording

__all__ = [
    "Board",
    "Marker",
    "PacketFormat",
    "PlacedMarker",
    "Pose",
    "ReceiverSettings",
    "Scene",
    "Still",
    "accumulate",
    "open_recording",
    "pan",
    "recognise",
    "record",
    "spin",
    "to_table",
]
