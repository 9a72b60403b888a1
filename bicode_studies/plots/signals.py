"""Fig. 5 and 6: what is sent and what is seen, over time.

Times come in microseconds, as everywhere, and are drawn in milliseconds, as in the paper.
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
"""From [us], to [us], what to write there."""

PART_COLORS = {"start": "#D9D9D9", "payload": "#BBD9EE", "checksum": "#F6DDA8"}
NAME_WIDTH = 0.011  # of the axes, for each letter of a part's name; narrower spans stay without it


@dataclass(frozen=True)
class PacketSpans:
    """Where the parts, the bits and the chips of a packet lie in time, each a list of (from, to, text) [us]."""

    parts: list[Span]
    bits: list[Span]
    chips: list[Span]


def packet_spans(
    payload: int, packet_format: PacketFormat, start_us: float = 0.0, chip_us: float | None = None
) -> PacketSpans:
    """A payload and the moment its packet begins in; where to write its parts, bits and chips out.

    Parameters
    ----------
    payload : int
    packet_format : PacketFormat
    start_us : float
        First moment of the packet's start [us].
    chip_us : float, optional
        Length of a chip [us], where the transmitter's clock is off; None takes the format's.

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


def draw_led(
    times_us: npt.ArrayLike, levels: npt.ArrayLike, ax: Axes, *, end_us: float, label: str = "LED", color: str = LED
) -> Axes:
    """The moments at which the light changes and its level from then on in (`LedWaveform.steps`), the waveform out.

    Parameters
    ----------
    times_us, levels : array_like, shape (n,)
        Moments [us] and levels, 0 dark .. 1 full.
    ax : Axes
    end_us : float
        Until when the last level lasts [us].
    """
    times = np.append(np.asarray(times_us, float), end_us)
    values = np.asarray(levels, float)
    ax.step(times / 1e3, np.append(values, values[-1]), where="post", color=color, label=label)
    ax.set(xlabel="time (ms)", ylabel="LED", ylim=(-0.15, 1.15), yticks=[0, 1], yticklabels=["off", "on"])
    return ax


def draw_pixel_events(t_us: npt.ArrayLike, p: npt.ArrayLike, ax: Axes, *, label: str = "") -> Axes:
    """The events of one pixel in; a stroke each over time, ON upwards and OFF downwards.

    Parameters
    ----------
    t_us : array_like, shape (n,)
        Times [us].
    p : array_like, shape (n,)
        Polarities, 0 OFF, 1 ON.
    """
    t_ms, on = np.asarray(t_us, float) / 1e3, np.asarray(p) > 0
    ax.vlines(t_ms[on], 0, 1, colors="black", linewidth=1.4, label=f"ON {label}".strip())
    ax.vlines(t_ms[~on], -1, 0, colors=OFF, linewidth=1.4, label=f"OFF {label}".strip())
    ax.axhline(0, color="#555555", linewidth=0.8)
    ax.set(xlabel="time (ms)", ylabel="polarity", ylim=(-1.25, 1.25), yticks=[-1, 1], yticklabels=["OFF", "ON"])
    return ax


def draw_events(t_us: npt.ArrayLike, place_px: npt.ArrayLike, p: npt.ArrayLike, ax: Axes, *, name: str = "x") -> Axes:
    """Many events in; a dot each, time to the right and one image coordinate upwards, in the frames' colours.

    Parameters
    ----------
    t_us : array_like, shape (n,)
        Times [us].
    place_px : array_like, shape (n,)
        Column or row [px].
    p : array_like, shape (n,)
        Polarities, 0 OFF, 1 ON.
    name : str
        Which coordinate it is, for the axis.
    """
    t_ms, place, on = np.asarray(t_us, float) / 1e3, np.asarray(place_px), np.asarray(p) > 0
    for chosen, color, label in ((~on, OFF, "OFF"), (on, ON, "ON")):
        ax.plot(t_ms[chosen], place[chosen], ".", color=color, markersize=2, label=label, rasterized=True)
    ax.set_facecolor(BACKGROUND)
    ax.grid(visible=False)
    ax.set(xlabel="time (ms)", ylabel=f"{name} (px)")
    return ax


def draw_on_off(
    n_on: npt.ArrayLike, n_off: npt.ArrayLike, ax: Axes, *, start_us: float = 0.0, delta_t_us: float = 250.0,
    unit: str = "pixels",
) -> Axes:  # fmt: skip
    """ON and OFF counts of every bin in; ON solid black, OFF dashed grey, each at its bin's middle.

    Parameters
    ----------
    n_on, n_off : array_like, shape (n,)
        Counts of each bin.
    ax : Axes
    start_us, delta_t_us : float
        Start of the first bin and length of a bin [us].
    unit : str
        What was counted: pixels or events.
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
    """Counts, the light that was sent and the bits that were read in; the paper's Fig. 6 out.

    LED bits red, ON total solid black, OFF total dashed grey, the Manchester code's bits on top.

    Parameters
    ----------
    n_on, n_off : array_like, shape (n,)
        Counts of each delta_t_ID bin.
    ax : Axes
    start_us, delta_t_id_us : float
        Start of the first bin and length of a bin [us].
    led_times_us, led_levels : array_like, shape (m,)
        From `LedWaveform.steps`; may be empty, as for a recording whose light nobody wrote down.
    packets : sequence of PacketSpans
        What to write on top; see `packet_spans`.
    unit : str
        What was counted: pixels or events.
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
    """The parts, bits and chips of one packet in; the paper's Fig. 5 out: named blocks over the bits over the light."""
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
    """The bits on top of Fig. 6, with lines between them, and above them the names of the parts."""
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
