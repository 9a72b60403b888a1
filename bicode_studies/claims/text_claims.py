"""What the paper states that is no matter of chance (I to III).   id of a claim -> what this package makes of it

Most is worked out from the package: packets that are encoded, settings that are refused, markers that
are read. Parameters of the experiments are taken from the trials, so that it is seen that those were run.
Names of parts cannot be tested by a simulation.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from itertools import pairwise

import numpy as np
import pandas as pd

from bicode_lab.camera import Optics, PlacedMarker, Pose, Scene, Still, record
from bicode_lab.camera.optics import IR88_TRANSMITTANCE
from bicode_lab.events import make_events
from bicode_lab.marker import Board, Marker, PacketFormat, encode_packet
from bicode_lab.paper import F_NUMBER_INFRARED, F_NUMBER_VISIBLE, FIG_6_PAYLOAD
from bicode_lab.recognition import ReceiverSettings, Sighting, accumulate, led_state, recognise
from bicode_studies.claims.curves import Answer, Tables, Where, rows_where
from bicode_studies.link_budget.budget import link_budget

Fact = Callable[[Tables, str], Answer]
"""Tables of trials and the value the claim states in, our answer out."""

ABOUT = 0.1  # a value the paper gives as "about" may differ by this share
A_PART = "the name of a part; a simulation has none"


def is_so(ours: str, holds: bool) -> Answer:
    """What we find, and whether that is what the paper says, in; the answer out."""
    return Answer(ours=ours, holds=bool(holds))


def equal(ours: Callable[[], float | Iterable[float]]) -> Fact:
    """Something that gives a number or several in; a fact that holds where they are those the claim states out."""

    def fact(tables: Tables, stated: str) -> Answer:
        return compare(ours(), stated)

    return fact


def compare(ours: float | Iterable[float], stated: str) -> Answer:
    """A number or several, and a claim's value, in; whether they are the same out; "~" in it asks for about."""
    numbers = [float(value) for value in (ours if isinstance(ours, Iterable) else [ours])]
    paper = [float(value) for value in re.findall(r"\d+(?:\.\d+)?", stated)]
    share = ABOUT if "~" in stated else 1e-6
    same = len(numbers) == len(paper) and bool(np.allclose(sorted(numbers), sorted(paper), rtol=share))
    return is_so("; ".join(f"{value:.4g}" for value in numbers), same)


def tried(figure: str, column: str, where: Where | None = None, scale: float = 1.0) -> Fact:
    """A figure and a column in; a fact that holds where all values the claim states are among its trials' out."""

    def fact(tables: Tables, stated: str) -> Answer:
        values = scale * rows_where(tables, figure, where or {})[column].to_numpy(float)
        paper = [float(value) for value in stated.split(";")]
        there = [value for value in paper if np.isclose(values, value).any()]
        return is_so("; ".join(f"{value:g}" for value in there), there == paper)

    return fact


def span(figure: str, where: Where | None = None) -> Fact:
    """A figure in; a fact that holds where its trials reach from the first to the last distance stated out."""

    def fact(tables: Tables, stated: str) -> Answer:
        at = rows_where(tables, figure, where or {})["distance_m"]
        return compare((at.min(), at.max()), stated.replace("..", " "))

    return fact


def untestable(reason: str) -> Fact:
    """A reason in; a fact that is not testable out."""
    return lambda tables, stated: Answer(why_not=reason)


def periods_a_condition(tables: Tables, stated: str) -> Answer:
    """I17: periods of all seeds of one condition of Fig. 8."""
    rows = rows_where(tables, "08", {"receiver": "ours", "frame_rule_2d": "any"})
    return compare(float(rows.groupby(["current_ma", "distance_m"])["periods"].sum().median()), stated)


def seconds_a_condition(tables: Tables, stated: str) -> Answer:
    """I16: the same in seconds, about: seeds have whole numbers of periods."""
    periods = float(periods_a_condition(tables, stated).ours)
    return compare(periods * ReceiverSettings().delta_t_whole_us * 1e-6, f"~{stated}")


def longest_accepted_us(name: str) -> int:
    """A time of the receiver in, the longest that its settings do not refuse out [us], found by halving."""
    good, bad = 1, 1_000_000
    while bad - good > 1:
        middle = (good + bad) // 2
        try:
            ReceiverSettings(**{name: middle})  # type: ignore[arg-type]
            good = middle
        except ValueError:
            bad = middle
    return good


def accumulation_times(tables: Tables, stated: str) -> Answer:
    """P10: the longest delta_t_2D and delta_t_blinker that are accepted, against delta_t_whole."""
    longest = {longest_accepted_us(name) for name in ("delta_t_2d_us", "delta_t_blinker_us")}
    return is_so(f"up to {max(longest) / 1e3:g} ms", longest == {ReceiverSettings().delta_t_whole_us})


def read(payloads: Iterable[int], distance_m: float = 2.5) -> list[Sighting]:
    """Payloads in; what the receiver makes of markers side by side that send them, in one period, out."""
    places = [Pose.facing(distance_m, x_m=0.1 * i) for i, _ in enumerate(payloads)]
    optics = Optics(width=320, height=96)
    markers = [PlacedMarker(marker=Marker(payload=p), path=Still(at)) for p, at in zip(payloads, places, strict=True)]
    scene = Scene(markers=tuple(markers), optics=optics)
    settings = ReceiverSettings(width=optics.width, height=optics.height, detect_2d=False)
    return list(recognise(record(scene, settings.delta_t_whole_us * 1e-6, rng=0), settings, t0_us=0))


def fig_6_payload(tables: Tables, stated: str) -> Answer:
    """P07: Fig. 6's payload, sent and read."""
    ids = [format(s.id, "08b") for s in read([FIG_6_PAYLOAD]) if s.id is not None]
    return is_so(", ".join(ids), ids == [stated])


def several_markers(tables: Tables, stated: str) -> Answer:
    """P16: IDs of three markers in view, read in one period."""
    sent = (1, 2, 3)
    ids = sorted(s.id for s in read(sent) if s.id is not None)
    return is_so(f"{len(ids)} of {len(sent)} in one period", ids == list(sent))


def led_rule(tables: Tables, stated: str) -> Answer:
    """P08: more ON than OFF pixels is on, fewer is off, as many is as before."""
    states = led_state([3, 2, 2, 0], [2, 2, 3, 0]).tolist()
    return is_so("more ON: on; more OFF: off", states == [1, 1, 0, 0])


def frame_rule(tables: Tables, stated: str) -> Answer:
    """P12: a pixel of a "sum" frame is the sign of its events' sum."""
    events = make_events([0, 0, 0, 1, 2, 2, 3, 3, 3], [0] * 9, [1, 1, 0, 0, 1, 0, 0, 0, 1], range(9))
    values = accumulate(events, 4, 1, "sum")[0].tolist()
    return is_so(f"sums 1, -1, 0, -1 give {', '.join(map(str, values))}", values == [1, -1, 0, -1])


def data_edges_us() -> list[list[float]]:
    """Nothing in; for each payload the moments at which its LED switches between the start and the packet's end out."""
    packet = PacketFormat()
    chips = [encode_packet(payload, packet) for payload in range(2**packet.payload_bits)]
    return [(packet.chip_us * (np.flatnonzero(np.diff(each)) + 1)).tolist() for each in chips]


def longest_blink_us() -> float:
    """Nothing in, the longest time within data for which the LED stays on or off out [us]."""
    return max(then - first for edges in data_edges_us() for first, then in pairwise(edges))


def shortest_window(tables: Tables, stated: str) -> Answer:
    """P14: the shortest window that holds a rise and a fall wherever it lies within data.

    Edges alternate, so it is the longest time from an edge to the second one behind it.
    """
    needed = max(edges[i + 2] - edges[i] for edges in data_edges_us() for i in range(len(edges) - 2))
    return is_so(f"{needed / 1e3:g} ms hold a rise and a fall anywhere in the data", needed / 1e3 == float(stated))


def above_a_blink(tables: Tables, stated: str) -> Answer:
    """P15: delta_t_blinker against the longest blink."""
    window, blink = ReceiverSettings().delta_t_blinker_us / 1e3, longest_blink_us() / 1e3
    return is_so(f"{window:g} ms, a blink lasts up to {blink:g} ms", window > blink)


def whole_packets(tables: Tables, stated: str) -> Answer:
    """P13: whole packets in a period, for a packet that begins at every microsecond of its length."""
    packet_us, period_us = int(PacketFormat().packet_us), ReceiverSettings().delta_t_whole_us
    counts = (period_us - np.arange(packet_us)) // packet_us
    one, two = (counts == 1).mean(), (counts == 2).mean()
    return is_so(f"1 in {one:.0%}, 2 in {two:.0%} of phases", counts.min() >= 1 and one + two == 1)


def linear_in_current(tables: Tables, stated: str) -> Answer:
    """F8.8: luminance over current; the model takes it as exactly proportional."""
    slopes = [Marker(current_ma=current).luminance_ratio / current for current in (5.5, 10.7, 21.3)]
    return is_so("proportional, by the model", bool(np.allclose(slopes, slopes[0])))


def far_law(tables: Tables, stated: str) -> Answer:
    """F8.9: exponent of the brightest pixel's light where the image is much smaller than the lens's blur."""
    light = [np.expm1(link_budget(distance_m=distance_m).contrast) for distance_m in (160, 320)]
    exponent = float(np.log2(light[1] / light[0]))
    return is_so(f"d^{exponent:.2f} from 160 to 320 m", abs(exponent + 2) < ABOUT)


def equal_luminance(tables: Tables, stated: str) -> Answer:
    """F10.8: luminance of the three sizes at their currents, from the trials of Fig. 10."""
    pairs = rows_where(tables, "10", {})[["size_m", "current_ma"]].drop_duplicates().sort_values("size_m")
    ratios = [
        Marker(board=Board(size_m=size), current_ma=current).luminance_ratio
        for size, current in pairs.itertuples(index=False)
    ]
    told = ", ".join(f"{ratio:.2f}" for ratio in ratios)
    return is_so(told, max(ratios) / min(ratios) - 1 < ABOUT)


def field_of_view_deg() -> float:
    """Nothing in, the horizontal angle of view of the default camera out [deg]."""
    optics = Optics()
    return float(np.rad2deg(2 * np.arctan(optics.width / 2 / optics.focal_px)))


def _turned_deg(tables: Tables, stated: str) -> Answer:
    """I27: how far the markers of Fig. 14 turn."""
    rows: pd.DataFrame = rows_where(tables, "14", {})
    return compare((6 * rows["rpm"] * rows["duration_s"]).round(0).unique().tolist(), stated)


PACKET, RECEIVER = PacketFormat(), ReceiverSettings()
FACTS: dict[str, Fact] = {
    "P01": equal(lambda: PACKET.packet_us / 1e3),
    "P02": equal(lambda: PACKET.payload_bits),
    "P03": equal(lambda: PACKET.f_id_hz),
    "P04": equal(lambda: round(PACKET.payload_rate_bps)),
    "P05": equal(lambda: PACKET.start_bits * 2 * PACKET.chip_us / 1e3),
    "P06": equal(lambda: PACKET.checksum_bits),
    "P07": fig_6_payload,
    "P08": led_rule,
    "P09": equal(lambda: longest_accepted_us("delta_t_id_us") / 1e3),
    "P10": accumulation_times,
    "P11": equal(lambda: 1 * 30),  # bits a frame times frames a second: the paper's arithmetic
    "P12": frame_rule,
    "P13": whole_packets,
    "P14": shortest_window,
    "P15": above_a_blink,
    "P16": several_markers,
    "A3": equal(lambda: PACKET.f_id_hz),
    "I01": equal(lambda: RECEIVER.delta_t_2d_us / 1e3),
    "I02": equal(lambda: RECEIVER.delta_t_blinker_us / 1e3),
    "I03": equal(lambda: RECEIVER.delta_t_id_us / 1e3),
    "I04": equal(lambda: RECEIVER.delta_t_whole_us / 1e3),
    "I05": equal(lambda: Optics().focal_length_mm),
    "I06": equal(lambda: F_NUMBER_VISIBLE),
    "I07": equal(lambda: F_NUMBER_INFRARED),
    "I08": equal(field_of_view_deg),
    "I09": equal(lambda: Board().thickness_m * 1e3),
    "I10": untestable("the LED lights the plate from its side; its own size is not in the model"),
    "I11": untestable(A_PART),
    "I12": untestable(A_PART + "; infrared light is kept apart from visible light, without a wavelength"),
    "I13": lambda tables, stated: compare(100 * IR88_TRANSMITTANCE, "~80"),
    "I14": untestable(A_PART + "; marker/bicode_tx.py is written for it"),
    "I15": untestable(A_PART + "; its 1280 x 720 pixels of 4.86 um are modelled"),
    "I16": seconds_a_condition,
    "I17": periods_a_condition,
    "I18": tried("08", "illuminance_lux"),
    "I19": tried("11", "illuminance_lux", {"band": "red"}),
    "I20": tried("10", "size_m", scale=100),
    "I21": tried("08", "current_ma"),
    "I22": tried("10", "current_ma"),
    "I23": tried("11", "current_ma", {"band": "infrared"}),
    "I24": tried("09", "yaw_deg"),
    "I25": tried("12", "speed_m_per_s"),
    "I26": tried("14", "rpm"),
    "I27": _turned_deg,
    "F8.0": span("08"),
    "F8.8": linear_in_current,
    "F8.9": far_law,
    "F9.0": span("09"),
    "F10.8": equal_luminance,
    "F12.0": span("12"),
    "F12.7": untestable("the delay was in the authors' computer; ours is a stand-in for it (F12.5), not evidence"),
    "F14.0": span("14"),
}
