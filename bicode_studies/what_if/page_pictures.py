"""The two pictures of the what-if page, as PNG images."""

from __future__ import annotations

import io

from matplotlib.figure import Figure

from bicode_studies.notebook.figures import use_style
from bicode_studies.plots import draw_box, draw_decoding, draw_frame, packet_spans
from bicode_studies.what_if.choice import Choice
from bicode_studies.what_if.packet_view import PacketView

DPI = 140
BITS_AT_FULL_SIZE = 14  # a longer packet has its bits written smaller


def packet_picture(packet_view: PacketView, choice: Choice) -> bytes:
    """Draw one packet: the light, the counts and the bits that were read.

    Parameters
    ----------
    packet_view : PacketView
    choice : Choice
        What was simulated.

    Returns
    -------
    bytes
        A PNG image.
    """
    use_style()
    figure = Figure(figsize=(6.0, 2.8), dpi=DPI, layout="constrained")
    ax = figure.subplots()
    f = choice.packet_format
    spans = []
    if packet_view.packet is not None and packet_view.packet.payload is not None:
        spans = [packet_spans(packet_view.packet.payload, f, packet_view.packet.start_us)]
    draw_decoding(
        packet_view.n_on, packet_view.n_off, ax, start_us=packet_view.start_us, delta_t_id_us=choice.delta_t_id_us,
        led_times_us=packet_view.led_times_us, led_levels=packet_view.led_levels, packets=spans,
    )  # fmt: skip
    for text in ax.texts:
        text.set_fontsize(float(text.get_fontsize()) * min(1.0, BITS_AT_FULL_SIZE / f.packet_bits))
    return _png(figure)


def frame_picture(packet_view: PacketView, choice: Choice) -> bytes:
    """Draw a frame of the marker and its surroundings, with the region that was found.

    Parameters
    ----------
    packet_view : PacketView
    choice : Choice
        What was simulated.

    Returns
    -------
    bytes
        A PNG image.
    """
    use_style()
    figure = Figure(figsize=(3.6, 3.7), dpi=DPI, layout="constrained")
    ax = figure.subplots()
    height, width = packet_view.frame.shape
    draw_frame(packet_view.frame, ax)
    if packet_view.box is not None:
        draw_box(packet_view.box, ax, label=f"region {packet_view.box[2]} x {packet_view.box[3]} px")
    ax.set_title(f"{choice.delta_t_blinker_us / 1000:g} ms of events, a window of {width} x {height} px", fontsize=10)
    return _png(figure)


def _png(figure: Figure) -> bytes:
    """Render a figure as PNG."""
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=DPI)
    return picture.getvalue()
