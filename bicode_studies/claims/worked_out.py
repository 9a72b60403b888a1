"""What the package says to statements of the paper that are no matter of chance: each is worked out by computation.

Packets are encoded and read, settings are refused, events become frames. Each function that takes `tables` and
`stated` is a `FactTest`, whose parameters are described there.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from itertools import pairwise

import numpy as np

from bicode_lab.camera import Optics, PlacedMarker, Pose, Scene, Still, record
from bicode_lab.events import make_events
from bicode_lab.marker import Board, Marker, PacketFormat, encode_packet
from bicode_lab.paper import FIG_6_PAYLOAD
from bicode_lab.recognition import ReceiverSettings, Sighting, accumulate, led_state, recognise
from bicode_studies.claims.claim_result import ClaimResult, Tables
from bicode_studies.claims.curves import rows_where
from bicode_studies.link_budget.budget import link_budget

FactTest = Callable[[Tables, str], ClaimResult]
"""A test of a claim without chance. It takes `tables`, the rows of trials by figure, and `stated`, the value that the
claim states, as text; it returns a `ClaimResult`."""

ABOUT = 0.1  # a value that the paper gives as "about" may differ by this share


def fact(ours: str, holds: bool) -> ClaimResult:
    """Return a result without chance.

    Parameters
    ----------
    ours : str
        Our finding in words.
    holds : bool
        Whether it is as the paper says.

    Returns
    -------
    ClaimResult
    """
    return ClaimResult(ours=ours, holds=bool(holds))


def compare(ours: float | Iterable[float], stated: str) -> ClaimResult:
    """Compare numbers of ours with those that a claim states.

    Parameters
    ----------
    ours : float or iterable of float
    stated : str
        The claim's value. With "~" in it, numbers may differ by the share `ABOUT`, else by a millionth.

    Returns
    -------
    ClaimResult
    """
    numbers = [float(value) for value in (ours if isinstance(ours, Iterable) else [ours])]
    paper = [float(value) for value in re.findall(r"\d+(?:\.\d+)?", stated)]
    share = ABOUT if "~" in stated else 1e-6
    same = len(numbers) == len(paper) and bool(np.allclose(sorted(numbers), sorted(paper), rtol=share))
    return fact("; ".join(f"{value:.4g}" for value in numbers), same)


def longest_accepted_us(name: str) -> int:
    """Find the longest time that the receiver's settings accept, by halving.

    Parameters
    ----------
    name : str
        A field of `ReceiverSettings`, in us.

    Returns
    -------
    int
        Time in us.
    """
    good, bad = 1, 1_000_000
    while bad - good > 1:
        middle = (good + bad) // 2
        try:
            ReceiverSettings(**{name: middle})  # type: ignore[arg-type]
            good = middle
        except ValueError:
            bad = middle
    return good


def accumulation_times(tables: Tables, stated: str) -> ClaimResult:
    """Compare the longest delta_t_2D and delta_t_blinker that are accepted with delta_t_whole (P10)."""
    longest = {longest_accepted_us(name) for name in ("delta_t_2d_us", "delta_t_blinker_us")}
    return fact(f"up to {max(longest) / 1e3:g} ms", longest == {ReceiverSettings().delta_t_whole_us})


def read(payloads: Iterable[int], distance_m: float = 2.5) -> list[Sighting]:
    """Read markers side by side for one period.

    Parameters
    ----------
    payloads : iterable of int
        What the markers send, 0 .. 255; one marker for each.
    distance_m : float

    Returns
    -------
    list of Sighting
    """
    places = [Pose.facing(distance_m, x_m=0.1 * i) for i, _ in enumerate(payloads)]
    optics = Optics(width=320, height=96)
    markers = [PlacedMarker(marker=Marker(payload=p), path=Still(at)) for p, at in zip(payloads, places, strict=True)]
    scene = Scene(markers=tuple(markers), optics=optics)
    settings = ReceiverSettings(width=optics.width, height=optics.height, detect_2d=False)
    return list(recognise(record(scene, settings.delta_t_whole_us * 1e-6, rng=0), settings, t0_us=0))


def fig_6_payload(tables: Tables, stated: str) -> ClaimResult:
    """Send and read the payload of Fig. 6 (P07)."""
    ids = [format(s.id, "08b") for s in read([FIG_6_PAYLOAD]) if s.id is not None]
    return fact(", ".join(ids), ids == [stated])


def several_markers(tables: Tables, stated: str) -> ClaimResult:
    """Read the IDs of three markers in view in one period (P16)."""
    sent = (1, 2, 3)
    ids = sorted(s.id for s in read(sent) if s.id is not None)
    return fact(f"{len(ids)} of {len(sent)} in one period", ids == list(sent))


def led_rule(tables: Tables, stated: str) -> ClaimResult:
    """Check that more ON than OFF pixels mean on, fewer mean off, and as many leave the state as it was (P08)."""
    states = led_state([3, 2, 2, 0], [2, 2, 3, 0]).tolist()
    return fact("more ON: on; more OFF: off", states == [1, 1, 0, 0])


def frame_rule(tables: Tables, stated: str) -> ClaimResult:
    """Check that each pixel of a "sum" frame is the sign of the sum of its events (P12)."""
    events = make_events([0, 0, 0, 1, 2, 2, 3, 3, 3], [0] * 9, [1, 1, 0, 0, 1, 0, 0, 0, 1], range(9))
    values = accumulate(events, 4, 1, "sum")[0].tolist()
    return fact(f"sums 1, -1, 0, -1 give {', '.join(map(str, values))}", values == [1, -1, 0, -1])


def data_edges_us() -> list[list[float]]:
    """Return for each payload when its LED switches between the start and the end of the packet [us]."""
    packet = PacketFormat()
    chips = [encode_packet(payload, packet) for payload in range(2**packet.payload_bits)]
    return [(packet.chip_us * (np.flatnonzero(np.diff(each)) + 1)).tolist() for each in chips]


def longest_blink_us() -> float:
    """Return the longest time for which the LED stays on or off within the data [us]."""
    return max(then - first for edges in data_edges_us() for first, then in pairwise(edges))


def shortest_window(tables: Tables, stated: str) -> ClaimResult:
    """Find the shortest window that holds a rise and a fall wherever it lies within the data (P14).

    Rises and falls alternate, so it is the longest time from an edge to the second edge after it.
    """
    needed = max(edges[i + 2] - edges[i] for edges in data_edges_us() for i in range(len(edges) - 2))
    return fact(f"{needed / 1e3:g} ms hold a rise and a fall anywhere in the data", needed / 1e3 == float(stated))


def window_above_blink(tables: Tables, stated: str) -> ClaimResult:
    """Compare delta_t_blinker with the longest blink (P15)."""
    window, blink = ReceiverSettings().delta_t_blinker_us / 1e3, longest_blink_us() / 1e3
    return fact(f"{window:g} ms, a blink lasts up to {blink:g} ms", window > blink)


def packets_per_period(tables: Tables, stated: str) -> ClaimResult:
    """Count the whole packets in a period, for a packet that begins at every microsecond of its length (P13)."""
    packet_us, period_us = int(PacketFormat().packet_us), ReceiverSettings().delta_t_whole_us
    counts = (period_us - np.arange(packet_us)) // packet_us
    one, two = (counts == 1).mean(), (counts == 2).mean()
    return fact(f"1 in {one:.0%}, 2 in {two:.0%} of phases", counts.min() >= 1 and one + two == 1)


def far_field_law(tables: Tables, stated: str) -> ClaimResult:
    """Find how the light on the brightest pixel falls with distance in the far field (F8.9)."""
    light = [np.expm1(link_budget(distance_m=distance_m).contrast) for distance_m in (160, 320)]
    exponent = float(np.log2(light[1] / light[0]))
    return fact(f"d^{exponent:.2f} from 160 to 320 m", abs(exponent + 2) < ABOUT)


def equal_luminance(tables: Tables, stated: str) -> ClaimResult:
    """Compare the luminance of the three marker sizes at their currents, from the trials of Fig. 10 (F10.8)."""
    pairs = rows_where(tables, "10", {})[["size_m", "current_ma"]].drop_duplicates().sort_values("size_m")
    ratios = [
        Marker(board=Board(size_m=size), current_ma=current).luminance_ratio
        for size, current in pairs.itertuples(index=False)
    ]
    listed = ", ".join(f"{ratio:.2f}" for ratio in ratios)
    return fact(listed, max(ratios) / min(ratios) - 1 < ABOUT)


def field_of_view_deg() -> float:
    """Return the horizontal angle of view of the default camera [deg]."""
    optics = Optics()
    return float(np.rad2deg(2 * np.arctan(optics.width / 2 / optics.focal_px)))
