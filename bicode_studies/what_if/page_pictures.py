"""The two pictures of the what-if page.   view -> PNG"""

from __future__ import annotations

import io

from matplotlib.figure import Figure

from bicode_studies.notebook.figures import use_style
from bicode_studies.plots import draw_box, draw_decoding, draw_frame, packet_spans
from bicode_studies.what_if.choice import Choice
from bicode_studies.what_if.packet_view import View

DPI = 140
ROOM_FOR_BITS = 14  # of the usual size; more are written smaller


def packet_picture(seen: View, choice: Choice) -> bytes:
    """One packet in; its light, its counts and the bits that were read, as a PNG, out."""
    use_style()
    figure = Figure(figsize=(6.0, 2.8), dpi=DPI, layout="constrained")
    ax = figure.subplots()
    f = choice.packet_format
    spans = []
    if seen.packet is not None and seen.packet.payload is not None:
        spans = [packet_spans(seen.packet.payload, f, seen.packet.start_us)]
    draw_decoding(
        seen.n_on, seen.n_off, ax, start_us=seen.start_us, delta_t_id_us=choice.delta_t_id_us,
        led_times_us=seen.led_times_us, led_levels=seen.led_levels, packets=spans,
    )  # fmt: skip
    for text in ax.texts:
        text.set_fontsize(float(text.get_fontsize()) * min(1.0, ROOM_FOR_BITS / f.packet_bits))
    return _png(figure)


def frame_picture(seen: View, choice: Choice) -> bytes:
    """One packet in; the camera's frame of the marker's surroundings with the region found, as a PNG, out."""
    use_style()
    figure = Figure(figsize=(3.6, 3.7), dpi=DPI, layout="constrained")
    ax = figure.subplots()
    height, width = seen.frame.shape
    draw_frame(seen.frame, ax)
    if seen.box is not None:
        draw_box(seen.box, ax, label=f"region {seen.box[2]} x {seen.box[3]} px")
    ax.set_title(f"{choice.delta_t_blinker_us / 1000:g} ms of events, {width} x {height} px of the sensor", fontsize=10)
    return _png(figure)


def _png(figure: Figure) -> bytes:
    """A figure in, its picture out."""
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=DPI)
    return picture.getvalue()
