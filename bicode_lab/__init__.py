"""Learn, reproduce and extend Bicode: one LED in an acrylic ArUco plate, read by an event camera.

The folders are the communication link; the files of `recognition` are the boxes of the
paper's Fig. 2, in order::

    marker/     packet -> manchester -> led, on a board                          (III-A)
    camera/     motion, optics, glow -> sensor -> readout -> record              events
    recognition/
        accumulate (a, b, d, e) -> marker_2d (c)                                 pose
                                -> regions, track (f) -> led_state, decode (g)   ID
        recognise   one period after the other
    evaluation/ how often that is right                                          (IV)

`events` and `recordings` hold what flows between them, `paper` what the paper states,
`workshop` turns a marker into parts, `plots` draws, `lab` is what notebooks and the command line share.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING

from bicode_lab._numba import forget_stale_kernels

_WHERE = {
    "Marker": "marker",
    "Board": "marker",
    "PacketFormat": "marker",
    "Scene": "camera",
    "PlacedMarker": "camera",
    "Pose": "camera",
    "Still": "camera",
    "spin": "camera",
    "pan": "camera",
    "record": "camera",
    "ReceiverSettings": "recognition",
    "accumulate": "recognition",
    "recognise": "recognition",
    "to_table": "recognition",
    "open_recording": "recordings",
}

if TYPE_CHECKING:
    from bicode_lab.camera import PlacedMarker, Pose, Scene, Still, pan, record, spin
    from bicode_lab.marker import Board, Marker, PacketFormat
    from bicode_lab.recognition import ReceiverSettings, accumulate, recognise, to_table
    from bicode_lab.recordings import open_recording

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


forget_stale_kernels(Path(__file__).parent)


def __getattr__(name: str) -> object:
    """A name of `__all__` in, what it stands for out; it is imported now, so that the package itself loads at once."""
    if name not in _WHERE:
        raise AttributeError(f"bicode_lab has no {name!r}; it has {', '.join(__all__)}")
    value: object = getattr(importlib.import_module(f"bicode_lab.{_WHERE[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The names above."""
    return __all__
