"""Tables of trials from a world that is as the paper says, for the tests of claims; no camera is simulated."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd

DISTANCES_M = (0.5, 1, 2.5, 5, 7.5, 10, 15, 20, 25, 30, 35, 40, 50)
SEEDS, PERIODS = 300, 200  # from 265 seeds on, "all right" is certain to within 0.025
Accuracy = Callable[[float], float]


def ends_at(half_m: float) -> Accuracy:
    """Return an accuracy that falls through one half at a distance."""
    return lambda d: float(np.clip(1 / (1 + np.exp((d - half_m) * 12 / half_m)), 0, 1)) if d > 0.75 * half_m else 1.0


def rows(
    id_right: Accuracy, plate_right: Accuracy, most_m: float = 50, **condition: object
) -> Iterator[dict[str, object]]:
    """Yield the trials of a condition; chance draws the counts of each seed from two accuracy curves."""
    rng = np.random.default_rng([len(str(condition)), round(1000 * most_m)])
    lost = 0.15 * float(str(condition.get("speed_m_per_s", 0)))
    for d in (d for d in DISTANCES_M if d <= most_m):
        for seed in range(SEEDS):
            for receiver in ("ours", "authors"):
                near = 0.85 + 0.05 * min(d, 2.5) - lost if receiver == "authors" and condition.get("near_loss") else 1.0
                counts = {"periods": PERIODS, "id_right": rng.binomial(PERIODS, near * id_right(d))}
                for rule in ("any", "count"):
                    plates = rng.binomial(PERIODS, plate_right(d))
                    yield {**condition, "distance_m": d, "seed": seed, "receiver": receiver, "frame_rule_2d": rule,
                           **counts, "marker_2d_right": plates, "events": 1000}  # fmt: skip


def never(d: float) -> float:
    """Return an accuracy of 0."""
    return 0.0


def paper_world() -> dict[str, pd.DataFrame]:
    """Return the trials by figure of a world in which every claim holds, in all readings that can hold together."""
    base = {"size_m": 0.05, "current_ma": 10.7, "band": "red", "illuminance_lux": 350.0, "yaw_deg": 0.0}
    currents = {5.5: (14, 4.2), 10.7: (21.5, 3.6), 21.3: (31.5, 2.9)}
    yaws = {0.0: (21.5, 3.6), 40.0: (19.5, 3.4), 80.0: (11, None)}
    sizes = {0.025: (2.7, 8.2, 1.6), 0.05: (10.7, 21.5, 3.6), 0.1: (40.9, 46, 13)}
    fig_8 = [r for i, (b, p) in currents.items() for r in rows(ends_at(b), ends_at(p), **{**base, "current_ma": i})]
    fig_9 = [
        r for yaw, (b, p) in yaws.items()
        for r in rows(ends_at(b), ends_at(p) if p else never, 35, **{**base, "yaw_deg": yaw})
    ]  # fmt: skip
    fig_10 = [
        r for size, (i, b, p) in sizes.items()
        for r in rows(ends_at(b), ends_at(p), **{**base, "size_m": size, "current_ma": i})
    ]  # fmt: skip
    infrared = {**base, "band": "infrared", "current_ma": 20.4}
    office, evening = ({**infrared, "illuminance_lux": lux} for lux in (350.0, 2000.0))
    fig_11 = [r for light in (office, evening) for r in rows(ends_at(20), ends_at(3.6), **light)]
    fig_11 += rows(never, never, 20, **{**base, "illuminance_lux": 2000.0})
    fig_11 += [r for lux in (1e4, 5e4) for r in rows(never, never, 20, **{**infrared, "illuminance_lux": lux})]
    pans = {0.105: {0.5: 1, 1: 0.98, 2.5: 0.6}, 0.209: {0.5: 0.98, 1: 0.8, 2.5: 0.2}, 0.314: {0.5: 0.96, 1: 0.5}}
    fig_12 = [
        r for v, at in pans.items()
        for r in rows(ends_at(40), lambda d, at=at: at.get(d, 0.0), 25,
                      **{**base, "speed_m_per_s": v, "near_loss": 1})
    ]  # fmt: skip
    spins = {16.0: (0.99, 0.95), 32.0: (0.92, 0.8), 64.0: (0.85, 0.5)}
    fig_14 = [
        r for rpm, (b, far) in spins.items()
        for r in rows(lambda d, b=b: b + 0.02 * d if b < 0.9 else b, lambda d, far=far: 1.0 if d <= 1 else far, 2.5,
                      **{**base, "rpm": rpm, "near_loss": 1, "duration_s": 30 / rpm})
    ]  # fmt: skip
    tables = {"08": fig_8, "09": fig_9, "10": fig_10, "11": fig_11, "12": fig_12, "14": fig_14}
    return {"13": panels(), **{figure: pd.DataFrame(each) for figure, each in tables.items()}}


def panels() -> pd.DataFrame:
    """Return the regions of the frames of Fig. 13, which differ by some pixels from seed to seed."""
    area = dict(zip("abcdefghijk", (900, 1000, 1200, 800, 270, 260, 4000, 90, 90, 9000, 900), strict=True))
    rng = np.random.default_rng(0)
    return pd.DataFrame(
        [{"panel": p, "seed": s, "region_px": n + rng.integers(-9, 10)} for p, n in area.items() for s in range(SEEDS)]
    )
