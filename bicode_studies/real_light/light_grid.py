"""Read texts of several hundred synthetic lights, beside a reader that knows the levels and the timing.

The lights are drawn from ranges that are wider than those of the recordings at hand, and nothing of the receiver is
chosen by them one by one. Half of the lights have a habit beside: bursts, a refractory period, tails of OFF edges, a
readout that delays events to its steps, a lamp on top, missing stretches, a clock that drifts, pauses of any length.

``python -m bicode_studies.real_light.light_grid FILE.csv 315`` writes the table of 315 lights; the committed one is
``results/light_grid.csv``. There is no marker and no camera in it, so `trial.run` and `sweep` do not fit.
"""

from __future__ import annotations

import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bicode_lab.soft_receiver import TextReading, UartLine, read_text
from bicode_studies.real_light.known_reader import known_share, letters_seen
from bicode_studies.real_light.synthetic_lights import Light, Sent, send
from bicode_studies.statistics import wilson

MOST_CHIPS, MOST_CHIPS_OF_TENTH = 15_000, 100_000  # of a light, and of every tenth
MOST_EVENTS = 3e6
MANY = 1000  # letters are enough to find the delay
NEAR_CHIPS = 3.0  # a letter is in its place if its time is that near, up to a delay that all have
HABITS: dict[str, dict[str, Any]] = {
    "bursts": {"burst": 0.3},
    "refractory": {"refractory": 1.5},
    "tails": {"tail_off": 0.6},
    "comb": {"comb_us": 0.2},  # chips
    "lamp": {"lamp_hz": 100.0, "lamp_events": 0.5},  # events of an edge
    "missing": {"missing": 0.1},
    "drift": {"drift_ppm": 20.0},
    "pauses": {"idle": 0.3, "whole_idle": False},
}


def draw_light(seed: int, most_chips: float = MOST_CHIPS) -> tuple[Light, str]:
    """Draw a light.

    Parameters
    ----------
    seed : int
        Decides all of it.
    most_chips : float
        The recording is cut to this many chips, but for at least one second.

    Returns
    -------
    light : Light
        Rate 250 Hz .. 10 kHz, 1 .. 30 s, 1 .. 300 events an edge, ON over OFF 0.3 .. 3, latencies 0 .. 0.6 chip (alike
        in half of the lights), jitter 0 .. 0.35 chip (of edges, of events, or of both), clock +-1000 ppm, idle in half
        of them, stray events in half.
    habit : str
        One of `HABITS`, or "none".

    Examples
    --------
    >>> light, habit = draw_light(3)
    >>> 250 <= light.rate_hz <= 10_000, 1 <= light.length_s <= 30, abs(light.clock_ppm) <= 1000
    (True, True, True)
    """
    rng = np.random.default_rng([14, seed])
    rate_hz, length_s, events, ratio = np.exp(rng.uniform(np.log([250, 1, 1, 0.3]), np.log([10_000, 30, 300, 3])))
    length_s = max(1.0, min(length_s, most_chips / rate_hz))
    events = min(events, MOST_EVENTS / (0.5 * rate_hz * length_s))
    jitter, of_edges = rng.uniform(0, 0.35), rng.choice([0.0, 1.0, rng.uniform()])
    latency, other = rng.uniform(0, 0.6, 2)
    light = Light(
        rate_hz=float(rate_hz),
        length_s=float(length_s),
        events=float(events),
        ratio=float(ratio),
        latency_on=float(latency),
        latency_off=float(other if rng.random() < 0.5 else latency),
        edge_jitter=float(jitter * of_edges),
        event_jitter=float(max(0.01, jitter * np.sqrt(1 - of_edges**2))),
        clock_ppm=float(rng.uniform(-1000, 1000)),
        idle=float(rng.uniform(0, 0.6) * rng.integers(2)),
        stray_hz=float(rng.uniform(0, 0.05) * events * rate_hz * rng.integers(2)),
    )
    habit = str(rng.choice([*HABITS, *["none"] * len(HABITS)]))
    changes = dict(HABITS.get(habit, {}))
    if habit == "comb":
        changes["comb_us"] *= 1e6 / light.rate_hz
    if habit == "lamp":
        changes["lamp_events"] *= light.events
    return replace(light, **changes), habit


def score_reading(reading: TextReading, sent: Sent, light: Light) -> tuple[float, float]:
    """Compare what was read with what was sent, letter by letter and by their times.

    Parameters
    ----------
    reading : TextReading
    sent : Sent
    light : Light

    Returns
    -------
    read : float
        Share of the letters sent that were read right, 0 .. 1; letters in missing stretches do not count.
    right : float
        Share of the letters given that are right, 0 .. 1; nan if none is given.
    """
    if not reading.characters:
        return 0.0, float("nan")
    chip_us = 1e6 / light.rate_hz
    t_us = np.array([character.t_us for character in reading.characters], np.float64)
    first = t_us[:MANY]
    near = sent.start_us[np.abs(first[:, None] - sent.start_us[None, : 2 * MANY]).argmin(axis=1)]
    delay_us = float(np.median(first - near))
    at = np.maximum(np.searchsorted(sent.start_us + delay_us - NEAR_CHIPS * chip_us, t_us) - 1, 0)
    in_place = np.abs(t_us - delay_us - sent.start_us[at]) < NEAR_CHIPS * chip_us
    same = np.array([character.letter == sent.text[k] for character, k in zip(reading.characters, at, strict=True)])
    seen = letters_seen(sent, light, UartLine(rate_hz=light.rate_hz).frame_chips)
    found = np.zeros(len(sent.text), np.bool_)
    found[at[in_place & same]] = True
    return float(found[seen].mean()) if seen.any() else 0.0, float((in_place & same).mean())


def try_light(seed: int) -> dict[str, Any]:
    """Draw a light, let it send, and read it in both ways.

    Parameters
    ----------
    seed : int

    Returns
    -------
    dict
        The settings of the light; ``letters`` sent; ``known``, the share that the reader with known levels and timing
        reads; ``read`` and ``right`` of `score_reading`; ``given``, the number of letters; mean ``sure``; ``held``,
        ``parity`` and ``explained`` of the check; ``left_out``; ``reason``.
    """
    light, habit = draw_light(seed, MOST_CHIPS if seed % 10 else MOST_CHIPS_OF_TENTH)
    rng, other = np.random.default_rng([15, seed]).spawn(2)
    sent = send(light, rng)
    reading = read_text(sent.events, UartLine(rate_hz=light.rate_hz))
    read, right = score_reading(reading, sent, light)
    sure = [character.sure for character in reading.characters]
    return {
        "seed": seed,
        "habit": habit,
        **asdict(light),
        "letters": len(sent.text),
        "known": known_share(sent, light, other),
        "read": read,
        "given": len(reading.characters),
        "right": right,
        "sure": float(np.mean(sure)) if sure else float("nan"),
        "held": reading.check.held,
        "parity": reading.check.parity,
        "explained": reading.check.explained,
        "left_out": reading.left_out,
        "reason": reading.check.reason or "",
    }


def summarise(table: pd.DataFrame) -> pd.DataFrame:
    """Count how the lights of a table were read, by what the reader with known levels and timing reads of them.

    Parameters
    ----------
    table : DataFrame
        One row per light, see `try_light`.

    Returns
    -------
    DataFrame
        One row per class of ``known``: ``lights``; ``read_99``, the share of them of which 0.99 of the letters are
        read, with its 95 % interval; ``given``, the share of which any letter is given; ``right``, the share of the
        letters given that are right, over all lights; ``least_right``, that of the worst light.
    """
    classes = [("0.999 and more", 0.999, 1.1), ("0.9 to 0.999", 0.9, 0.999), ("0.7 to 0.9", 0.7, 0.9)]
    rows = []
    for name, low, high in [*classes, ("below 0.7", -1.0, 0.7)]:
        part = table[(table["known"] >= low) & (table["known"] < high)]
        some = part[part["given"] > 0]
        n_good = int((part["read"] >= 0.99).sum())
        ends = wilson(n_good, len(part)) if len(part) else (float("nan"),) * 2
        right = float((some["right"] * some["given"]).sum() / max(int(some["given"].sum()), 1))
        share, given = (n / max(len(part), 1) for n in (n_good, len(some)))
        least = float(some["right"].min()) if len(some) else float("nan")
        rows.append((name, len(part), share, float(ends[0]), float(ends[1]), given, right, least))
    names = ["known", "lights", "read_99", "read_99_low", "read_99_high", "given", "right", "least_right"]
    return pd.DataFrame(rows, columns=names)


def write_table(path: Path, n_lights: int) -> pd.DataFrame:
    """Try lights and write the table after each, so that a run can be stopped.

    Parameters
    ----------
    path : Path
        Where to write it (CSV); the lights in it are not tried again.
    n_lights : int
        Seeds 0 .. n_lights - 1.

    Returns
    -------
    DataFrame
    """
    table = pd.read_csv(path) if path.exists() else pd.DataFrame()
    for seed in range(len(table), n_lights):
        table = pd.concat([table, pd.DataFrame([try_light(seed)])], ignore_index=True)
        table.to_csv(path, index=False, float_format="%.6g", lineterminator="\n")
    return pd.read_csv(path).fillna({"reason": ""})


if __name__ == "__main__":
    summary = summarise(write_table(Path(sys.argv[1]), int(sys.argv[2])))
    sys.stdout.write(summary.to_string(index=False) + "\n")
