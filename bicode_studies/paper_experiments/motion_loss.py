"""Two explanations of the IDs that are lost near the camera when something moves (IV-E, IV-F).

The paper names an abundance of events as the cause; `processing_limit` models that. `rate_and_loss` compares trials
with and without that limit. The other explanation is tried in `lag_table`: the box in which blinks are counted comes
from an earlier period, and a moving marker has left it. The late box is taken from the truth, which an evaluation may
use and a receiver may not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from tqdm import tqdm

from bicode_lab import paper
from bicode_lab.boxes import Box
from bicode_lab.camera import Recorder, Scene, truth_at
from bicode_lab.events import Events, windows
from bicode_lab.recognition import ReceiverSettings
from bicode_lab.recognition.decode import decode_packets
from bicode_lab.recognition.led_state import count_on_off
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.scenes import scene_of
from bicode_studies.statistics import over_seeds
from bicode_studies.trial import PERIOD_S

SIZE_M = 0.05  # side of the marker of IV-E and IV-F


def rate_and_loss(tables: dict[str, pd.DataFrame], levels: dict[str, str]) -> pd.DataFrame:
    """Return the rate of events and the share of lost IDs of each condition, with and without the processing limit.

    Parameters
    ----------
    tables : dict of str to DataFrame
        Rows of `trial_rows.run_trial`, all of one current, by the way the marker was seen: "still", "pan" or "spin".
    levels : dict of str to str
        By the same keys, the column that tells the curves of a table apart, such as "rpm"; "" where there is one only.

    Returns
    -------
    DataFrame
        ``how`` (the key), ``level`` (of the column; 0 without one), ``receiver``, ``distance_m``, ``mev_per_s`` (mean
        rate [Mev/s]); ``lost``, ``low`` and ``high`` (share of periods without the right ID, 0 .. 1, with its 95 %
        interval over seeds).
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
    """Arrange the rates or the losses in one row per distance and one column per way of motion.

    Parameters
    ----------
    rates : DataFrame
        As `rate_and_loss` returns it.
    value : {"mev_per_s", "lost"}
        Column to arrange; losses have a column for each receiver.

    Returns
    -------
    DataFrame
        Index ``distance_m``; columns such as "pan 0.314", or "pan 0.314, ours" for losses.
    """
    chosen = rates if value == "lost" else rates[rates["receiver"] == "ours"]
    names = chosen["how"] + chosen["level"].map(lambda level: f" {level:g}" if level else "")
    if value == "lost":
        names = names + ", " + chosen["receiver"]
    table = chosen.assign(name=names).pivot(index="distance_m", columns="name", values=value)
    return table[list(dict.fromkeys(names))]


def lag_table(conditions: Sequence[Condition], lags: Sequence[int], seeds: int, periods: int) -> pd.DataFrame:
    """Count the IDs that are read right in a box which is some periods late.

    Parameters
    ----------
    conditions : sequence of Condition
        Their `duration_s` is not used.
    lags : sequence of int
        Delays of the box, in periods, 0 or more.
    seeds : int
        Number of recordings of each condition.
    periods : int
        Length of each recording, in periods.

    Returns
    -------
    DataFrame
        One row for each condition, delay and seed: ``distance_m``, ``speed_m_per_s``, ``rpm``, ``lag``, ``seed``,
        ``periods`` and ``id_right`` (counts), ``overlap`` (mean share of the marker's box that lies in the late box).
    """
    todo = [(condition, seed) for condition in conditions for seed in range(seeds)]
    rows = []
    for condition, seed in tqdm(todo, desc="late boxes", disable=None, leave=False):
        rows += _lag_rows(condition, lags, seed, periods)
    return pd.DataFrame(rows)


def _lag_rows(condition: Condition, lags: Sequence[int], seed: int, periods: int) -> list[dict[str, float]]:
    """Read one recording in boxes of several delays."""
    scene, settings = scene_of(condition, seed), receiver_settings(condition)
    payload = scene.markers[0].marker.payload
    right, shares = dict.fromkeys(lags, 0), dict.fromkeys(lags, 0.0)
    # trial.run does not fit: its score takes an ID for the marker's only where the box still lies on the marker.
    recorder = Recorder(scene, periods * PERIOD_S, np.random.default_rng([seed, 2]))
    for start_us, events in windows(recorder, settings.delta_t_whole_us, t0_us=0):
        now = box_of(scene, start_us, settings)
        for lag in lags:
            late = box_of(scene, start_us - lag * settings.delta_t_whole_us, settings)
            right[lag] += ids_in_box(events, late, start_us, settings) == {payload}
            shares[lag] += now.shared_area(late) / now.area / periods
    stated = {"distance_m": condition.distance_m, "speed_m_per_s": condition.speed_m_per_s, "rpm": condition.rpm}
    return [
        {**stated, "lag": lag, "seed": seed, "periods": periods, "id_right": right[lag], "overlap": shares[lag]}
        for lag in lags
    ]


def box_of(scene: Scene, start_us: float, settings: ReceiverSettings) -> Box:
    """Return the true box of the first marker in the middle of a period.

    Parameters
    ----------
    scene : Scene
    start_us : float
        Start of the period [us]; it may lie before the recording.
    settings : ReceiverSettings
        Its delta_t_whole is the length of the period.

    Returns
    -------
    Box
        It may reach beyond the sensor.
    """
    x, y, w, h = truth_at(scene, start_us + settings.delta_t_whole_us / 2)[0].box_px
    x0, y0 = int(np.floor(x)), int(np.floor(y))
    return Box.between(x0, y0, int(np.ceil(x + w)) + 1, int(np.ceil(y + h)) + 1)


def ids_in_box(events: Events, box: Box, start_us: int, settings: ReceiverSettings) -> set[int]:
    """Return the IDs, with a right checksum, of the packets that lie whole in a period and a box.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Those of the period.
    box : Box
        What lies beyond the sensor is cut off.
    start_us : int
        Start of the period [us].
    settings : ReceiverSettings

    Returns
    -------
    set of int
        Empty where no packet is read.
    """
    n_bins = -(-settings.delta_t_whole_us // settings.delta_t_id_us)
    inside = box.clipped(settings.width, settings.height)
    if inside.is_empty:
        return set()
    counts = count_on_off(events, inside, start_us, n_bins, settings.delta_t_id_us, settings.led_count)
    packets, _ = decode_packets(
        *counts, start_us, settings.delta_t_id_us, settings.packet_format, gate=settings.led_gate,
        latency_us=settings.latency_us,
    )  # fmt: skip
    return {packet.payload for packet in packets if packet.checksum_ok and packet.payload is not None}


def expected_overlap(speed_m_per_s: float, lag: float) -> float:
    """Return the share of the box of a moving marker that a late box still covers.

    In ``lag`` periods the marker moves by ``speed * lag * delta_t_whole``. Divided by the side of the marker, 5 cm,
    that is the share that has left the box; it does not depend on the distance.

    Parameters
    ----------
    speed_m_per_s : float
        Tangential speed [m/s].
    lag : float
        Delay of the box, in periods.

    Returns
    -------
    float
        Share, 0 .. 1.

    Examples
    --------
    >>> [round(expected_overlap(0.314, lag), 2) for lag in (0, 1, 4, 8)]
    [1.0, 0.79, 0.17, 0.0]
    """
    return max(0.0, 1 - speed_m_per_s * lag * paper.DELTA_T_WHOLE_US * 1e-6 / SIZE_M)
