"""IV-E, IV-F: two explanations of the loss near the camera.   trials -> rates and losses; a late box -> accuracy

The paper blames an abundance of events; `processing_limit` models that. Here its rows are laid beside those without
it, and the other explanation is tried: that the box in which blinks are counted comes from an earlier period, and a
moving marker has left it. Evaluation may use the truth, so the late box is exactly where the marker was.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from tqdm import tqdm

from bicode_lab import paper
from bicode_lab.camera import Recorder, Scene, truth_at
from bicode_lab.events import Events, windows
from bicode_lab.recognition import ReceiverSettings
from bicode_lab.recognition.decode import decode_packets
from bicode_lab.recognition.led_state import count_on_off
from bicode_studies.paper_experiments.scenes import Condition, scene_of
from bicode_studies.paper_experiments.trial_rows import PERIOD_S, receiver_settings
from bicode_studies.statistics import over_seeds

Box = tuple[int, int, int, int]
HOWS = ("still", "pan", "spin")


def rate_and_loss(tables: dict[str, pd.DataFrame], levels: dict[str, str]) -> pd.DataFrame:
    """Trials of still and moving markers in; their rate of events and the IDs lost, with and without the limit, out.

    Parameters
    ----------
    tables : dict
        How the marker was seen ("still", "pan", "spin") to rows of `trials.run_trial`, of one current.
    levels : dict
        The same to the column that tells its curves apart, such as "rpm"; "" where there is one only.

    Returns
    -------
    DataFrame
        ``how``, ``level``, ``receiver``, ``distance_m``, ``mev_per_s`` (mean), ``lost``, ``low`` and ``high`` (share of
        periods without the right ID, with its 95 % interval over seeds).
    """
    parts = []
    for how, table in tables.items():
        rows = table[table["frame_rule_2d"] == "any"].assign(level=table[levels[how]] if levels[how] else 0.0)
        keys = ["receiver", "level", "distance_m"]
        right = over_seeds(rows, keys)
        rates = rows.groupby(keys, as_index=False)["mev_per_s"].mean()
        parts.append(right.merge(rates, on=keys).assign(how=how))
    both = pd.concat(parts, ignore_index=True)
    both = both.assign(lost=1 - both["accuracy"], low=1 - both["high"], high=1 - both["low"])
    return both[["how", "level", "receiver", "distance_m", "mev_per_s", "lost", "low", "high"]]


def at_distances(rates: pd.DataFrame, value: str) -> pd.DataFrame:
    """Rows of `rate_and_loss` and "mev_per_s" or "lost" in; a row a distance, a column for each way of motion, out."""
    chosen = rates if value == "lost" else rates[rates["receiver"] == "ours"]
    names = chosen["how"] + chosen["level"].map(lambda level: f" {level:g}" if level else "")
    if value == "lost":
        names = names + ", " + chosen["receiver"]
    table = chosen.assign(name=names).pivot(index="distance_m", columns="name", values=value)
    return table[list(dict.fromkeys(names))]


def lag_table(conditions: Sequence[Condition], lags: Sequence[int], seeds: int, periods: int) -> pd.DataFrame:
    """Conditions, delays of the box [periods], numbers of seeds and periods in; IDs read right in the late box out.

    Returns
    -------
    DataFrame
        A row for each condition, delay and seed: ``distance_m``, ``speed_m_per_s``, ``rpm``, ``lag``, ``seed``,
        ``periods``, ``id_right`` (counts), ``overlap`` (share of the marker's box that the late box still holds).
    """
    todo = [(condition, seed) for condition in conditions for seed in range(seeds)]
    rows = []
    for condition, seed in tqdm(todo, desc="late boxes", disable=None, leave=False):
        rows += _lag_rows(condition, lags, seed, periods)
    return pd.DataFrame(rows)


def _lag_rows(condition: Condition, lags: Sequence[int], seed: int, periods: int) -> list[dict[str, float]]:
    """One recording, read in boxes of several delays."""
    scene, settings = scene_of(condition, seed), receiver_settings(condition)
    payload = scene.markers[0].marker.payload
    right, shares = dict.fromkeys(lags, 0), dict.fromkeys(lags, 0.0)
    recorder = Recorder(scene, periods * PERIOD_S, np.random.default_rng([seed, 2]))
    for start_us, events in windows(recorder, settings.delta_t_whole_us, t0_us=0):
        now = box_of(scene, start_us, settings)
        for lag in lags:
            late = box_of(scene, start_us - lag * settings.delta_t_whole_us, settings)
            right[lag] += read_in(events, late, start_us, settings) == {payload}
            shares[lag] += overlap(now, late) / periods
    told = {"distance_m": condition.distance_m, "speed_m_per_s": condition.speed_m_per_s, "rpm": condition.rpm}
    return [
        {**told, "lag": lag, "seed": seed, "periods": periods, "id_right": right[lag], "overlap": shares[lag]}
        for lag in lags
    ]


def box_of(scene: Scene, start_us: float, settings: ReceiverSettings) -> Box:
    """A scene and a period's start in, even before the recording; the marker's box amid that period out [px]."""
    x, y, w, h = truth_at(scene, start_us + settings.delta_t_whole_us / 2)[0].box_px
    x0, y0 = int(np.floor(x)), int(np.floor(y))
    return x0, y0, int(np.ceil(x + w)) - x0 + 1, int(np.ceil(y + h)) - y0 + 1


def overlap(box: Box, other: Box) -> float:
    """Two boxes in, the share of the first that lies in the second out.

    Examples
    --------
    >>> overlap((0, 0, 10, 10), (5, 0, 10, 10)), overlap((0, 0, 10, 10), (20, 0, 5, 5))
    (0.5, 0.0)
    """
    (x, y, w, h), (left, top, width, height) = box, other
    wide = max(min(x + w, left + width) - max(x, left), 0)
    tall = max(min(y + h, top + height) - max(y, top), 0)
    return wide * tall / (w * h)


def read_in(events: Events, box: Box, start_us: int, settings: ReceiverSettings) -> set[int]:
    """A period's events, a box and the period's start in; the checked IDs of packets whole in it out."""
    n_bins = -(-settings.delta_t_whole_us // settings.delta_t_id_us)
    x, y = max(box[0], 0), max(box[1], 0)
    w, h = min(box[0] + box[2], settings.width) - x, min(box[1] + box[3], settings.height) - y
    if w <= 0 or h <= 0:
        return set()
    counts = count_on_off(events, (x, y, w, h), start_us, n_bins, settings.delta_t_id_us, settings.led_count)
    packets, _ = decode_packets(
        *counts, start_us, settings.delta_t_id_us, settings.packet_format, gate=settings.led_gate,
        latency_us=settings.latency_us,
    )  # fmt: skip
    return {packet.payload for packet in packets if packet.checksum_ok and packet.payload is not None}


def expected_overlap(speed_m_per_s: float, lag: int, size_m: float = 0.05) -> float:
    """A speed, a delay in periods and the marker's side in; the overlap that is left, at whatever distance, out.

    In `lag` periods the marker moves by ``speed * lag * delta_t_whole``, as a share of its side; distance falls out.

    Examples
    --------
    >>> [round(expected_overlap(0.314, lag), 2) for lag in (0, 1, 4, 8)]
    [1.0, 0.79, 0.17, 0.0]
    """
    return max(0.0, 1 - speed_m_per_s * lag * paper.DELTA_T_WHOLE_US * 1e-6 / size_m)
