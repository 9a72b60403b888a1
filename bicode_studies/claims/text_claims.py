"""How each statement without chance is checked (sections I to III): the claim's id and what the package makes of it.

Some statements are worked out from the package: packets that are encoded, settings that are refused, markers that are
read. Others went into the package or into the trials as they stand (a default, a tested distance). That these agree
is no evidence, so they are shown as "used as stated"; tests/studies/claims/test_paper_values.py compares them with the
paper. Names of parts cannot be tested by a simulation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd

from bicode_lab.camera import Optics
from bicode_lab.camera.optics import IR88_TRANSMITTANCE
from bicode_lab.marker import Board, Marker, PacketFormat
from bicode_lab.paper import F_NUMBER_INFRARED, F_NUMBER_VISIBLE
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.claims.claim_result import ClaimResult, Tables
from bicode_studies.claims.curves import Where, rows_where
from bicode_studies.claims.worked_out import (
    FactTest,
    accumulation_times,
    compare,
    equal_luminance,
    fact,
    far_field_law,
    field_of_view_deg,
    fig_6_payload,
    frame_rule,
    led_rule,
    longest_accepted_us,
    packets_per_period,
    several_markers,
    shortest_window,
    window_above_blink,
)

A_PART = "the name of a part; a simulation has none"


def computed(ours: Callable[[], float]) -> FactTest:
    """Test a number that is worked out from the package against the one that the claim states.

    Parameters
    ----------
    ours : callable
        Returns the number.

    Returns
    -------
    callable
        A `FactTest`.
    """
    return lambda tables, stated: compare(ours(), stated)


def as_stated(ours: Callable[[], float]) -> FactTest:
    """Show a number that the package takes from the paper; agreement is no evidence.

    Parameters
    ----------
    ours : callable
        Returns the number.

    Returns
    -------
    callable
        A `FactTest`.
    """
    return lambda tables, stated: replace(compare(ours(), stated), is_input=True)


def was_tried(figure: str, column: str, where: Where | None = None, scale: float = 1.0) -> FactTest:
    """Check that the trials of a figure were made with all values that the claim states.

    Parameters
    ----------
    figure : str
        "08" .. "14".
    column : str
        The column that holds the values.
    where : mapping, optional
        Column to value, for trials of one kind only.
    scale : float
        Converts the column into the unit of the claim.

    Returns
    -------
    callable
        A `FactTest`; what it finds went into the trials, so it is no evidence.
    """

    def test(tables: Tables, stated: str) -> ClaimResult:
        values = scale * rows_where(tables, figure, where or {})[column].to_numpy(float)
        paper = [float(value) for value in stated.split(";")]
        there = [value for value in paper if np.isclose(values, value).any()]
        return replace(fact("; ".join(f"{value:g}" for value in there), there == paper), is_input=True)

    return test


def distances_tried(figure: str) -> FactTest:
    """Check that the trials of a figure reach from the first to the last distance that the claim states.

    Parameters
    ----------
    figure : str
        "08" .. "14".

    Returns
    -------
    callable
        A `FactTest`; what it finds went into the trials, so it is no evidence.
    """

    def test(tables: Tables, stated: str) -> ClaimResult:
        at_m = rows_where(tables, figure, {})["distance_m"]
        return replace(compare((at_m.min(), at_m.max()), stated.replace("..", " ")), is_input=True)

    return test


def untestable(reason: str) -> FactTest:
    """Return a `FactTest` that says why the claim cannot be tested."""
    return lambda tables, stated: ClaimResult(why_not=reason)


def _recordings(tables: Tables) -> pd.Series:
    """Return the number of periods of each recording of Fig. 8."""
    rows: pd.DataFrame = rows_where(tables, "08", {"receiver": "ours", "frame_rule_2d": "any"})
    return rows["periods"]


def frames_tried(tables: Tables, stated: str) -> ClaimResult:
    """Check how many frames a recording of Fig. 8 has (I17); recordings are not added up."""
    periods = _recordings(tables)
    ours = f"{periods.min()} .. {periods.max()} in one recording"
    return replace(compare(float(periods.min()), stated), ours=ours, is_input=True)


def seconds_tried(tables: Tables, stated: str) -> ClaimResult:
    """Check how long a recording of Fig. 8 lasts (I16), about: it has a whole number of periods."""
    seconds = _recordings(tables) * ReceiverSettings().delta_t_whole_us * 1e-6
    ours = f"{seconds.min():.3g} .. {seconds.max():.3g} s in one recording"
    return replace(compare(float(seconds.min()), f"~{stated}"), ours=ours, is_input=True)


def angle_turned(tables: Tables, stated: str) -> ClaimResult:
    """Check by how many degrees the markers of Fig. 14 turn (I27)."""
    rows: pd.DataFrame = rows_where(tables, "14", {})
    angles_deg = (6 * rows["rpm"] * rows["duration_s"]).round(0).unique().tolist()
    return replace(compare(angles_deg, stated), is_input=True)


def linear_in_current(tables: Tables, stated: str) -> ClaimResult:
    """Show that the model takes luminance as proportional to current (F8.8); agreement is no evidence."""
    slopes = [Marker(current_ma=current).luminance_ratio / current for current in (5.5, 10.7, 21.3)]
    return replace(fact("proportional, by the model", bool(np.allclose(slopes, slopes[0]))), is_input=True)


PACKET, RECEIVER = PacketFormat(), ReceiverSettings()
FACTS: dict[str, FactTest] = {
    "P01": as_stated(lambda: PACKET.packet_us / 1e3),  # the length of the checksum is derived from it
    "P02": as_stated(lambda: PACKET.payload_bits),
    "P03": as_stated(lambda: PACKET.f_id_hz),
    "P04": computed(lambda: round(PACKET.payload_rate_bps)),
    "P05": as_stated(lambda: PACKET.start_bits * 2 * PACKET.chip_us / 1e3),
    "P06": as_stated(lambda: PACKET.checksum_bits),
    "P07": fig_6_payload,
    "P08": led_rule,
    "P09": computed(lambda: longest_accepted_us("delta_t_id_us") / 1e3),
    "P10": accumulation_times,
    "P11": as_stated(lambda: 1 * 30),  # bits per frame times frames per second; the package has no such camera
    "P12": frame_rule,
    "P13": packets_per_period,
    "P14": shortest_window,
    "P15": window_above_blink,
    "P16": several_markers,
    "A3": as_stated(lambda: PACKET.f_id_hz),
    "I01": as_stated(lambda: RECEIVER.delta_t_2d_us / 1e3),
    "I02": as_stated(lambda: RECEIVER.delta_t_blinker_us / 1e3),
    "I03": as_stated(lambda: RECEIVER.delta_t_id_us / 1e3),
    "I04": as_stated(lambda: RECEIVER.delta_t_whole_us / 1e3),
    "I05": as_stated(lambda: Optics().focal_length_mm),
    "I06": as_stated(lambda: F_NUMBER_VISIBLE),
    "I07": as_stated(lambda: F_NUMBER_INFRARED),
    "I08": computed(field_of_view_deg),
    "I09": as_stated(lambda: Board().thickness_m * 1e3),
    "I10": untestable("the LED lights the plate from its side; the model leaves out the size of the LED"),
    "I11": untestable(A_PART),
    "I12": untestable(A_PART + "; the model tells infrared from visible light, but has no wavelength"),
    "I13": lambda tables, stated: replace(compare(100 * IR88_TRANSMITTANCE, "80"), is_input=True),
    "I14": untestable(A_PART + "; fabrication/bicode_tx.py is written for it"),
    "I15": untestable(A_PART + "; its 1280 x 720 pixels of 4.86 um are modelled"),
    "I16": seconds_tried,
    "I17": frames_tried,
    "I18": was_tried("08", "illuminance_lux"),
    "I19": was_tried("11", "illuminance_lux", {"band": "red"}),
    "I20": was_tried("10", "size_m", scale=100),
    "I21": was_tried("08", "current_ma"),
    "I22": was_tried("10", "current_ma"),
    "I23": was_tried("11", "current_ma", {"band": "infrared"}),
    "I24": was_tried("09", "yaw_deg"),
    "I25": was_tried("12", "speed_m_per_s"),
    "I26": was_tried("14", "rpm"),
    "I27": angle_turned,
    "F8.0": distances_tried("08"),
    "F8.8": linear_in_current,
    "F8.9": far_field_law,
    "F9.0": distances_tried("09"),
    "F10.8": equal_luminance,
    "F12.0": distances_tried("12"),
    "F12.7": untestable(
        "the delay arose in the authors' computer; our processing limit is a stand-in for it (F12.5), not evidence"
    ),
    "F14.0": distances_tried("14"),
}
