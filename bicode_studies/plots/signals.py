"""Draw what is sent and what is seen over time, as in Fig. 5 and 6.

Times are given in microseconds, as everywhere, and drawn in milliseconds, as in the paper.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from bicode_lab.marker import PacketFormat, encode_packet
from bicode_studies.plots.frames import BACKGROUND, OFF, ON

LED = "#C8102E"  # the paper draws the LED's bits in red
Span = tuple[float, float, str]
"""Begin [us], end [us] and the text to write between them."""

PART_COLORS = {"start": "#D9D9D9", "payload": "#BBD9EE", "checksum": "#F6DDA8"}
NAME_WIDTH = 0.011  # share of the axes that a letter needs; a part that is too narrow for its name stays without it


@dataclass(frozen=True)
class PacketSpans:
    """The times of the parts, the bits and the chips of a packet.

    Parameters
    ----------
    parts, bits, chips : list of (float, float, str)
        Begin [us], end [us] and text of each: the part's name, or 0 or 1.
    """

    parts: list[Span]
    bits: list[Span]
    chips: list[Span]


def packet_spans(
    payload: int, packet_format: PacketFormat, start_us: float = 0.0, chip_us: float | None = None
) -> PacketSpans:
    """Return when the parts, bits and chips of a payload's packet begin and end.

    Parameters
    ----------
    payload : int
        The ID that is sent.
    packet_format : PacketFormat
        Its packet format.
    start_us : float
        When the packet begins [us].
    chip_us : float, optional
        Length of a chip of a transmitter with a clock error [us]; None takes that of the format.

    Returns
    -------
    PacketSpans
        Times and texts.

    Examples
    --------
    >>> spans = packet_spans(0x25, PacketFormat())
    >>> spans.parts
    [(0.0, 3000.0, 'start'), (3000.0, 11000.0, 'payload'), (11000.0, 14000.0, 'checksum')]
    >>> "".join(text for _, _, text in spans.bits)
    '00100101011'
    """
    chip = packet_format.chip_us if chip_us is None else chip_us
    states = encode_packet(payload, packet_format)
    ends = np.cumsum([packet_format.start_bits, packet_format.payload_bits, packet_format.checksum_bits])
    borders = [start_us + 2 * chip * int(bit) for bit in (0, *ends)]
    parts = [(borders[i], borders[i + 1], name) for i, name in enumerate(("start", "payload", "checksum"))]
    one = 1 if packet_format.manchester == "ieee" else 0  # the second chip of a 1
    data = range(packet_format.start_bits, packet_format.packet_bits)
    bits = [(start_us + 2 * chip * k, start_us + 2 * chip * (k + 1), str(int(states[2 * k + 1] == one))) for k in data]
    chips = [(start_us + chip * k, start_us + chip * (k + 1), str(int(s))) for k, s in enumerate(states)]
    return PacketSpans(parts, bits, chips)


def draw_led(times_us: npt.ArrayLike, levels: npt.ArrayLike, ax: Axes, *, end_us: float, label: str = "LED") -> Axes:
    """Draw the waveform of an LED (`LedWaveform.steps`).

    Parameters
    ----------
    times_us, levels : array_like, shape (n,)
        When the light changes [us] and its level from then on, 0 dark .. 1 full.
    ax : Axes
        Where to draw.
    end_us : float
        When the last level ends [us].
    label : str
        Name for the legend.

    Returns
    -------
    Axes
        The axes.
    """
    times = np.append(np.asarray(times_us, float), end_us)
    values = np.asarray(levels, float)
    ax.step(times / 1e3, np.append(values, values[-1]), where="post", color=LED, label=label)
    ax.set(xlabel="time (ms)", ylabel="LED", ylim=(-0.15, 1.15), yticks=[0, 1], yticklabels=["off", "on"])
    return ax


def draw_pixel_events(t_us: npt.ArrayLike, p: npt.ArrayLike, ax: Axes) -> Axes:
    """Draw the events of one pixel as strokes over time, ON upwards and OFF downwards.

    Parameters
    ----------
    t_us : array_like, shape (n,)
        Times [us].
    p : array_like, shape (n,)
        Polarities: 0 OFF, 1 ON.
    ax : Axes
        Where to draw.

    Returns
    -------
    Axes
        The axes.
    """
    t_ms, on = np.asarray(t_us, float) / 1e3, np.asarray(p) > 0
    ax.vlines(t_ms[on], 0, 1, colors="black", linewidth=1.4, label="ON")
    ax.vlines(t_ms[~on], -1, 0, colors=OFF, linewidth=1.4, label="OFF")
    ax.axhline(0, color="#555555", linewidth=0.8)
    ax.set(xlabel="time (ms)", ylabel="polarity", ylim=(-1.25, 1.25), yticks=[-1, 1], yticklabels=["OFF", "ON"])
    return ax


def draw_events(t_us: npt.ArrayLike, x_px: npt.ArrayLike, p: npt.ArrayLike, ax: Axes) -> Axes:
    """Draw events as dots, column over time, in the colours of the frames.

    Parameters
    ----------
    t_us : array_like, shape (n,)
        Times [us].
    x_px : array_like, shape (n,)
        Columns [px].
    p : array_like, shape (n,)
        Polarities: 0 OFF, 1 ON.
    ax : Axes
        Where to draw.

    Returns
    -------
    Axes
        The axes.
    """
    t_ms, x, on = np.asarray(t_us, float) / 1e3, np.asarray(x_px), np.asarray(p) > 0
    for chosen, color, label in ((~on, OFF, "OFF"), (on, ON, "ON")):
        ax.plot(t_ms[chosen], x[chosen], ".", color=color, markersize=2, label=label, rasterized=True)
    ax.set_facecolor(BACKGROUND)
    ax.grid(visible=False)
    ax.set(xlabel="time (ms)", ylabel="x (px)")
    return ax


def draw_on_off(
    n_on: npt.ArrayLike, n_off: npt.ArrayLike, ax: Axes, *, start_us: float = 0.0, delta_t_us: float = 250.0,
    unit: str = "pixels",
) -> Axes:  # fmt: skip
    """Draw the ON and OFF counts of each bin at its middle: ON solid black, OFF dashed grey.

    Parameters
    ----------
    n_on, n_off : array_like, shape (n,)
        Counts of each bin.
    ax : Axes
        Where to draw.
    start_us, delta_t_us : float
        Start of the first bin and length of a bin [us].
    unit : str
        What was counted: "pixels" or "events".

    Returns
    -------
    Axes
        The axes.
    """
    on, off = np.asarray(n_on), np.asarray(n_off)
    middles = (start_us + (np.arange(on.size) + 0.5) * delta_t_us) / 1e3
    ax.plot(middles, on, "-", color="black", linewidth=1.5, label="event ON")
    ax.plot(middles, off, "--", color="#8A8A8A", linewidth=1.8, label="event OFF")
    ax.set(xlabel="time (ms)", ylabel=f"total in the region ({unit})")
    ax.set_ylim(bottom=0)
    return ax


def draw_decoding(
    n_on: npt.ArrayLike,
    n_off: npt.ArrayLike,
    ax: Axes,
    *,
    start_us: float = 0.0,
    delta_t_id_us: float = 250.0,
    led_times_us: npt.ArrayLike = (),
    led_levels: npt.ArrayLike = (),
    packets: Sequence[PacketSpans] = (),
    unit: str = "pixels",
) -> Axes:
    """Draw the counts, the light that was sent and the bits that were read, as the paper's Fig. 6 does.

    The LED is red, the ON counts are solid black, the OFF counts dashed grey, and the bits stand above them.

    Parameters
    ----------
    n_on, n_off : array_like, shape (n,)
        Counts of each bin of delta_t_ID.
    ax : Axes
        Where to draw.
    start_us, delta_t_id_us : float
        Start of the first bin and length of a bin [us].
    led_times_us, led_levels : array_like, shape (m,)
        The light, see `LedWaveform.steps`; empty if it is not known, as for a real recording.
    packets : sequence of PacketSpans
        The packets to write above the counts; see `packet_spans`.
    unit : str
        What was counted: "pixels" or "events".

    Returns
    -------
    Axes
        The axes.
    """
    on, off = np.asarray(n_on), np.asarray(n_off)
    end_us = start_us + on.size * delta_t_id_us
    top = 1.1 * max(int(on.max(initial=1)), int(off.max(initial=1)), 1)
    draw_on_off(on, off, ax, start_us=start_us, delta_t_us=delta_t_id_us, unit=unit)
    ax.set(xlim=(start_us / 1e3, end_us / 1e3), ylim=(0, top * (1.25 if packets else 1.0)))
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    lines = ax.get_lines()[-2:]
    if np.size(led_times_us):
        light = ax.twinx()
        draw_led(led_times_us, led_levels, light, end_us=end_us, label="LED transmission bit")
        light.set(ylabel="", xlim=ax.get_xlim(), ylim=(0, 1.3 * (1.25 if packets else 1.0)), yticks=[0, 1])
        light.set_yticklabels(["off", "on"], color=LED)
        light.grid(visible=False)
        lines = [*light.get_lines(), *lines]
    for spans in packets:
        _write_code(spans, ax, start_us, end_us)
    ax.legend(handles=lines, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    return ax


def draw_packet(spans: PacketSpans, ax: Axes) -> Axes:
    """Draw one packet as the paper's Fig. 5 does: its parts above its bits above the light.

    Parameters
    ----------
    spans : PacketSpans
        The packet, see `packet_spans`.
    ax : Axes
        Where to draw.

    Returns
    -------
    Axes
        The axes.
    """
    for begin, end, name in spans.parts:
        width = (end - begin) / 1e3
        ax.add_patch(Rectangle((begin / 1e3, 2.6), width, 0.9, facecolor=PART_COLORS[name], edgecolor="black"))
        ax.text((begin + end) / 2e3, 3.05, name, ha="center", va="center", fontsize=11)
        ax.annotate("", (begin / 1e3, 3.8), (end / 1e3, 3.8), arrowprops={"arrowstyle": "<->", "color": "#555555"})
        ax.text((begin + end) / 2e3, 3.9, f"{width:g} ms", ha="center", va="bottom", color="#555555")
    for begin, end, text in spans.bits:
        ax.add_patch(Rectangle((begin / 1e3, 1.7), (end - begin) / 1e3, 0.7, facecolor="white", edgecolor="#555555"))
        ax.text((begin + end) / 2e3, 2.05, text, ha="center", va="center", fontsize=11)
    edges = [begin / 1e3 for begin, _, _ in spans.chips] + [spans.chips[-1][1] / 1e3]
    light = [0.2 + int(text) for _, _, text in spans.chips]
    ax.step(edges, [*light, light[-1]], where="post", color=LED, label="LED")
    ax.set(xlim=(edges[0] - 0.2, edges[-1] + 0.2), ylim=(0, 4.6), xlabel="time (ms)")
    ax.set(yticks=[0.2, 1.2, 2.05, 3.05], yticklabels=["LED off", "LED on", "bits", "packet"])
    ax.set_xticks(np.arange(np.ceil(edges[0]), edges[-1] + 0.01, 1.0))
    ax.grid(visible=False, axis="y")
    return ax


def _write_code(spans: PacketSpans, ax: Axes, start_us: float, end_us: float) -> None:
    """Write the bits above the counts of Fig. 6, with lines between them, and above them the names of the parts."""
    top = ax.get_ylim()[1]
    for begin, end, text in spans.bits:
        if start_us <= begin and end <= end_us:
            ax.axvline(begin / 1e3, color="#BBBBBB", linewidth=0.7, linestyle=":", zorder=0)
            ax.text((begin + end) / 2e3, 0.86 * top, text, ha="center", va="center", fontweight="bold")
    for begin, end, name in spans.parts:
        left, right = max(begin, start_us) / 1e3, min(end, end_us) / 1e3
        if right > left:
            ax.add_patch(
                Rectangle((left, 0.92 * top), right - left, 0.08 * top, facecolor=PART_COLORS[name], edgecolor="white")
            )
            if (right - left) / (end_us - start_us) * 1e3 > NAME_WIDTH * len(name):
                ax.text((left + right) / 2, 0.96 * top, name, ha="center", va="center", fontsize=9)
