"""Build a marker (III-A): sheets to engrave and cut, a list of parts, a transmitter to flash::

sheets       board -> plate, pocket, shading plate and paper as drawings in mm
drawing      drawing -> SVG and PDF at true size, in named layers
parts        current -> resistor, list of parts
transmitter  ID, packet format -> `bicode_tx.py` with its settings filled in
"""

from bicode_lab.fabrication.drawing import Drawing, Layer, Polyline, Text, to_pdf, to_svg
from bicode_lab.fabrication.parts import Driver, Led, leds, nearest_e24, parts_list
from bicode_lab.fabrication.sheets import draw_paper, draw_plate, pocket_depth_mm
from bicode_lab.fabrication.transmitter import transmitter_text

__all__ = [
    "Drawing",
    "Driver",
    "Layer",
    "Led",
    "Polyline",
    "Text",
    "draw_paper",
    "draw_plate",
    "leds",
    "nearest_e24",
    "parts_list",
    "pocket_depth_mm",
    "to_pdf",
    "to_svg",
    "transmitter_text",
]
