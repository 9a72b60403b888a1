"""Everything needed to build a marker (III-A): sheets to engrave and cut, a list of parts, and a transmitter program.

- `sheets` draws the plate with the LED's pocket, the shading plate and a paper version, in millimetres.
- `drawing` writes such a drawing as SVG or PDF at true size, in named layers.
- `parts` computes the LED's resistor and lists the parts.
- `marker_file` keeps all settings of a marker in one file, which the receiver reads, too.
- `transmitter` fills the settings of a marker into `bicode_tx.py`, the MicroPython program of the RP2040.
"""

from bicode_lab.fabrication.drawing import Drawing, Layer, Polyline, Text, to_pdf, to_svg
from bicode_lab.fabrication.marker_file import MARKER_FILE, marker_text, read_marker
from bicode_lab.fabrication.parts import Driver, Led, leds, nearest_e24, parts_list
from bicode_lab.fabrication.sheets import draw_paper, draw_plate, pocket_depth_mm
from bicode_lab.fabrication.transmitter import transmitter_text

__all__ = [
    "MARKER_FILE",
    "Drawing",
    "Driver",
    "Layer",
    "Led",
    "Polyline",
    "Text",
    "draw_paper",
    "draw_plate",
    "leds",
    "marker_text",
    "nearest_e24",
    "parts_list",
    "pocket_depth_mm",
    "read_marker",
    "to_pdf",
    "to_svg",
    "transmitter_text",
]
