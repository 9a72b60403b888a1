"""One period that gave no ID, or gave one: region, events, counts, chips, and which check failed, in one view."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from bicode_studies.plots.frames import draw_box, draw_frame
from bicode_studies.plots.signals import LED, draw_events, draw_on_off

if TYPE_CHECKING:
    from bicode_studies.own_recording.diagnose import Check, Why

MARKS = {True: ("✓", "#1B7F4B"), False: ("✗", "#C8102E"), None: ("–", "#8A8A8A")}
PACKET = {True: "#BBD9EE", False: "#F6DDA8"}
LINE_LETTERS = 44


def draw_why(why: Why, figure: Figure) -> dict[str, Axes]:
    """A period looked into (`evaluation.why`) and an empty figure in; its five views, by name, out.

    Frame and region on the left, over the list of checks; on the right, over one axis of time, the
    region's events, its ON and OFF counts with the lead that makes an edge, and the LED's state with
    the packets that were tried.
    """
    layout: Any = [["frame", "events"], ["frame", "counts"], ["checks", "chips"]]
    axes = figure.subplot_mosaic(layout, width_ratios=(1.1, 2), height_ratios=(1, 1, 1.15))
    draw_frame(why.frame, axes["frame"], zoom=why.view)
    if why.box:
        draw_box(why.box, axes["frame"])
    axes["frame"].set_title("all events of the period, the last of each pixel", fontsize=10)
    draw_events(why.events["t"], why.events["x"], why.events["p"], axes["events"]).set_title(
        "events in the region" if why.box else "events: there is no region", fontsize=10
    )
    axes["events"].yaxis.set_major_locator(MaxNLocator(nbins=5, integer=True))
    draw_on_off(why.n_on, why.n_off, axes["counts"], start_us=why.start_us, delta_t_us=why.delta_t_id_us)
    draw_gates(why, axes["counts"])
    draw_state(why, axes["chips"])
    draw_checks(why.checks, axes["checks"])
    for name in ("events", "counts", "chips"):
        axes[name].set_xlim(why.start_us / 1e3, why.end_us / 1e3)
    for name in ("events", "counts"):
        axes[name].set_xlabel("")
        axes[name].tick_params(labelbottom=False)
    return axes


def draw_gates(why: Why, ax: Axes) -> Axes:
    """A period in; the lead that counts as an edge as dotted lines over its counts out."""
    for gate, color, name in ((why.gates[0], "black", "ON"), (why.gates[1], "#8A8A8A", "OFF")):
        ax.axhline(gate, color=color, linewidth=1.0, linestyle=":", label=f"an edge's lead, {name}")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize=8)
    return ax


def draw_state(why: Why, ax: Axes) -> Axes:
    """A period in; the LED's state, the bits read and a band for each packet tried, with its reason, over time out."""
    edges = (why.start_us + np.arange(why.state.size + 1) * why.delta_t_id_us) / 1e3
    if why.box:
        ax.step(edges, np.append(why.state, why.state[-1:]), where="post", color=LED, linewidth=1.4)
    left, right = why.start_us / 1e3, why.end_us / 1e3
    for begin, end, bit in why.bits:
        ax.axvspan(begin / 1e3, end / 1e3, color="#F3F3F3" if bit != "x" else "#F7C9CF", linewidth=0, zorder=0)
        ax.axvline(begin / 1e3, color="#BBBBBB", linewidth=0.6, linestyle=":", zorder=0)
        ax.text((begin + end) / 2e3, 1.17, bit, ha="center", va="center", fontsize=8, fontweight="bold", clip_on=True)
    for k, packet in enumerate(why.packets):
        begin, end = max(packet.start_us / 1e3, left), min(packet.end_us / 1e3, right)
        text = f"ID {packet.payload}" if packet.reason is None else str(packet.reason)
        height = 1.45 + 0.3 * (k % 2)
        ax.barh(height, end - begin, 0.24, left=begin, color=PACKET[packet.reason is None], edgecolor="#555555")
        ax.text((begin + end) / 2, height, text, ha="center", va="center", fontsize=8, clip_on=True)
    ax.set(xlabel="time (ms)", ylabel="LED state", ylim=(-0.15, 2.0), yticks=[0, 1], yticklabels=["off", "on"])
    ax.set_title("the LED's state, the bits read from it, and the packets tried", fontsize=10)
    return ax


def draw_checks(checks: Sequence[Check], ax: Axes) -> Axes:
    """Checks in; a list of them, passed, failed or not reached, each with what was found, out."""
    ax.set(xlim=(0, 1), ylim=(len(checks), -0.4))
    ax.axis("off")
    for row, check in enumerate(checks):
        mark, color = MARKS[check.passed]
        weight = "bold" if check.passed is False else "normal"
        ax.text(0.0, row, mark, color=color, fontsize=11, va="center", fontweight="bold")
        ax.text(0.06, row, check.name, color=color, fontsize=9, va="center", fontweight=weight)
        words = check.words if check.passed is not None else ""
        ax.text(0.32, row, _broken(words), color="black", fontsize=7.5, va="center", linespacing=1.0)
    return ax


def _broken(words: str) -> str:
    """Words in, the same in lines that fit out."""
    lines, line = [], ""
    for word in words.split():
        if len(line) + len(word) >= LINE_LETTERS and line:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}".strip()
    return "\n".join([*lines, line])
