"""Draw the diagnosis of one period: region, events, counts, LED state, packets, and which check failed."""

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
    from bicode_studies.own_recording.diagnose import Check, Diagnosis

MARKS = {True: ("✓", "#1B7F4B"), False: ("✗", "#C8102E"), None: ("–", "#8A8A8A")}
PACKET = {True: "#BBD9EE", False: "#F6DDA8"}
LINE_LETTERS = 44  # of the text beside a check


def draw_diagnosis(diagnosis: Diagnosis, figure: Figure) -> dict[str, Axes]:
    """Draw the diagnosis of a period as five panels.

    On the left are the frame with the region, and the list of checks. On the right, over a common time axis, are the
    events of the region, its ON and OFF counts with the thresholds of an edge, and the state of the LED with the
    packets that were tried.

    Parameters
    ----------
    diagnosis : Diagnosis
        As `diagnose_period` returns it.
    figure : Figure
        An empty figure.

    Returns
    -------
    dict of str to Axes
        The panels "frame", "events", "counts", "checks" and "chips".
    """
    layout: Any = [["frame", "events"], ["frame", "counts"], ["checks", "chips"]]
    axes = figure.subplot_mosaic(layout, width_ratios=(1.1, 2), height_ratios=(1, 1, 1.15))
    draw_frame(diagnosis.frame, axes["frame"], zoom=diagnosis.view)
    if diagnosis.box:
        draw_box(diagnosis.box, axes["frame"])
    axes["frame"].set_title("last event of each pixel in the period", fontsize=10)
    draw_events(diagnosis.events["t"], diagnosis.events["x"], diagnosis.events["p"], axes["events"]).set_title(
        "events in the region" if diagnosis.box else "all events: there is no region", fontsize=10
    )
    axes["events"].yaxis.set_major_locator(MaxNLocator(nbins=5, integer=True))
    draw_on_off(
        diagnosis.n_on, diagnosis.n_off, axes["counts"], start_us=diagnosis.start_us, delta_t_us=diagnosis.delta_t_id_us
    )
    draw_gates(diagnosis, axes["counts"])
    draw_state(diagnosis, axes["chips"])
    draw_checks(diagnosis.checks, axes["checks"])
    for name in ("events", "counts", "chips"):
        axes[name].set_xlim(diagnosis.start_us / 1e3, diagnosis.end_us / 1e3)
    for name in ("events", "counts"):
        axes[name].set_xlabel("")
        axes[name].tick_params(labelbottom=False)
    return axes


def draw_gates(diagnosis: Diagnosis, ax: Axes) -> Axes:
    """Draw the thresholds of an edge as dotted lines.

    Parameters
    ----------
    diagnosis : Diagnosis
        As `diagnose_period` returns it.
    ax : Axes
        Axes with the ON and OFF counts.

    Returns
    -------
    Axes
    """
    for gate, color, name in ((diagnosis.gates[0], "black", "ON"), (diagnosis.gates[1], "#8A8A8A", "OFF")):
        ax.axhline(gate, color=color, linewidth=1.0, linestyle=":", label=f"threshold of an {name} edge")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize=8)
    return ax


def draw_state(diagnosis: Diagnosis, ax: Axes) -> Axes:
    """Draw the state of the LED over time, with the bits that were read and a bar for each packet that was tried.

    Parameters
    ----------
    diagnosis : Diagnosis
        As `diagnose_period` returns it.
    ax : Axes
        Axes to draw on.

    Returns
    -------
    Axes
    """
    edges = (diagnosis.start_us + np.arange(diagnosis.state.size + 1) * diagnosis.delta_t_id_us) / 1e3
    if diagnosis.box:
        ax.step(edges, np.append(diagnosis.state, diagnosis.state[-1:]), where="post", color=LED, linewidth=1.4)
    left, right = diagnosis.start_us / 1e3, diagnosis.end_us / 1e3
    for begin, end, bit in diagnosis.bits:
        ax.axvspan(begin / 1e3, end / 1e3, color="#F3F3F3" if bit != "x" else "#F7C9CF", linewidth=0, zorder=0)
        ax.axvline(begin / 1e3, color="#BBBBBB", linewidth=0.6, linestyle=":", zorder=0)
        ax.text((begin + end) / 2e3, 1.17, bit, ha="center", va="center", fontsize=8, fontweight="bold", clip_on=True)
    for k, packet in enumerate(diagnosis.packets):
        begin, end = max(packet.start_us / 1e3, left), min(packet.end_us / 1e3, right)
        text = f"ID {packet.payload}" if packet.reason is None else str(packet.reason)
        height = 1.45 + 0.3 * (k % 2)
        ax.barh(height, end - begin, 0.24, left=begin, color=PACKET[packet.reason is None], edgecolor="#555555")
        ax.text((begin + end) / 2, height, text, ha="center", va="center", fontsize=8, clip_on=True)
    ax.set(xlabel="time (ms)", ylabel="LED state", ylim=(-0.15, 2.0), yticks=[0, 1], yticklabels=["off", "on"])
    ax.set_title("state of the LED, bits read from it, and packets tried", fontsize=10)
    return ax


def draw_checks(checks: Sequence[Check], ax: Axes) -> Axes:
    """Draw a list of checks: passed, failed or not reached, each with what was found.

    Parameters
    ----------
    checks : sequence of Check
        Checks in their order.
    ax : Axes
        Axes to draw on; its own axis lines are switched off.

    Returns
    -------
    Axes
    """
    ax.set(xlim=(0, 1), ylim=(len(checks), -0.4))
    ax.axis("off")
    for row, check in enumerate(checks):
        mark, color = MARKS[check.passed]
        weight = "bold" if check.passed is False else "normal"
        ax.text(0.0, row, mark, color=color, fontsize=11, va="center", fontweight="bold")
        ax.text(0.06, row, check.name, color=color, fontsize=9, va="center", fontweight=weight)
        text = check.found if check.passed is not None else ""
        ax.text(0.32, row, _wrapped(text), color="black", fontsize=7.5, va="center", linespacing=1.0)
    return ax


def _wrapped(text: str) -> str:
    """Return a text broken into lines that fit."""
    lines, line = [], ""
    for word in text.split():
        if len(line) + len(word) >= LINE_LETTERS and line:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}".strip()
    return "\n".join([*lines, line])
