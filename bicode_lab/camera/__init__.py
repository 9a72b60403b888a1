"""The channel and the sensor: a synthetic event camera that records a scene of markers, lamps and a wall."""

from bicode_lab.camera.lamp import Flicker, Lamp
from bicode_lab.camera.merge import stream_over
from bicode_lab.camera.motion import Moving, Pose, Still, Trajectory, pan, spin
from bicode_lab.camera.optics import Light, Optics
from bicode_lab.camera.pixels import PixelModel
from bicode_lab.camera.readout import Readout
from bicode_lab.camera.recorder import Recorder, record
from bicode_lab.camera.scene import PlacedMarker, Scene
from bicode_lab.camera.truth import MarkerTruth, packet_starts_us, truth_at, truth_table
from bicode_lab.camera.wall import Wall, textured_wall

__all__ = [
    "Flicker",
    "Lamp",
    "Light",
    "MarkerTruth",
    "Moving",
    "Optics",
    "PixelModel",
    "PlacedMarker",
    "Pose",
    "Readout",
    "Recorder",
    "Scene",
    "Still",
    "Trajectory",
    "Wall",
    "packet_starts_us",
    "pan",
    "record",
    "spin",
    "stream_over",
    "textured_wall",
    "truth_at",
    "truth_table",
]
