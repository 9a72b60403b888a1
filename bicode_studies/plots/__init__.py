"""Drawings that several chapters share.

Each function takes data and an ``ax``, draws into it and returns it; none of them computes results or shows a window.
``frames`` draws Fig. 1, 3, 4 and 13, ``signals`` Fig. 5 and 6, ``accuracy`` Fig. 8 to 12 and 14.
"""

from bicode_studies.plots.accuracy import (
    LEVEL_COLORS,
    draw_accuracy,
    draw_levels,
    draw_paper_accuracy,
    draw_stated,
    set_distance_axis,
    set_width_axis,
)
from bicode_studies.plots.frames import (
    BACKGROUND,
    OFF,
    ON,
    draw_box,
    draw_boxes,
    draw_corners,
    draw_counts,
    draw_frame,
    draw_inset,
    draw_pose,
)
from bicode_studies.plots.signals import (
    PacketSpans,
    draw_decoding,
    draw_events,
    draw_led,
    draw_on_off,
    draw_packet,
    draw_pixel_events,
    packet_spans,
)

__all__ = [
    "BACKGROUND",
    "LEVEL_COLORS",
    "OFF",
    "ON",
    "PacketSpans",
    "draw_accuracy",
    "draw_box",
    "draw_boxes",
    "draw_corners",
    "draw_counts",
    "draw_decoding",
    "draw_events",
    "draw_frame",
    "draw_inset",
    "draw_led",
    "draw_levels",
    "draw_on_off",
    "draw_packet",
    "draw_paper_accuracy",
    "draw_pixel_events",
    "draw_pose",
    "draw_stated",
    "packet_spans",
    "set_distance_axis",
    "set_width_axis",
]
