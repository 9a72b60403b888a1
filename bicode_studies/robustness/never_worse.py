"""Whether one receiver reads at least as often as the better of two others, condition by condition."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from bicode_studies.robustness.link_conditions import COLUMNS
from bicode_studies.statistics import interval_of_mean, interval_of_sum, interval_over_seeds, over_seeds

OTHERS = ("paper", "soft")
ONE = "sequential"


def verdicts(table: pd.DataFrame, one: str = ONE, others: Sequence[str] = OTHERS) -> pd.DataFrame:
    """Compare one receiver with the better of some others in each condition.

    All receivers read the same recordings, so the difference is taken seed by seed, and its interval is that of the
    mean of these differences. A second interval takes the accuracies as independent, which makes it wider.
    The better receiver is chosen by the same trials, so chance favours it a little.

    Parameters
    ----------
    table : DataFrame
        Rows of `link_trials.link_rows`, with two or more seeds of each condition.
    one : str
        The receiver that is judged.
    others : sequence of str

    Returns
    -------
    DataFrame
        One row for each condition: the fields of the condition; ``seeds``; the accuracy of each receiver, by its name;
        ``better``, which of the others reads more; ``difference``, by how much `one` reads more than that, with the
        95 % intervals ``low``, ``high`` (seed by seed) and ``low_apart``, ``high_apart``; ``is_worse``, whether
        ``high`` is below 0; ``is_worse_apart``, whether ``high_apart`` is; and ``wrong_ids`` of `one`.
    """
    rows = []
    for key, group in table.groupby(list(COLUMNS), sort=False):
        by_receiver = {str(name): each.sort_values("seed") for name, each in group.groupby("receiver")}
        shares = {name: (each["right"] / each["periods"]).to_numpy(float) for name, each in by_receiver.items()}
        better = max(others, key=lambda name: shares[name].mean())
        apart = [_interval(by_receiver[name]) for name in (one, better)]
        means = [shares[name].mean() for name in (one, better)]
        low, high = interval_of_mean(shares[one] - shares[better])
        low_apart, high_apart = interval_of_sum([1, -1], means, apart)
        rows.append(
            {
                **dict(zip(COLUMNS, key, strict=True)),
                "seeds": len(shares[one]),
                **{name: shares[name].mean() for name in (*others, one)},
                "better": better, "difference": means[0] - means[1],
                "low": low, "high": high, "low_apart": low_apart, "high_apart": high_apart,
                "is_worse": high < 0, "is_worse_apart": high_apart < 0,
                "wrong_ids": int(by_receiver[one]["wrong_ids"].sum()),
            }
        )  # fmt: skip
    return pd.DataFrame(rows)


def _interval(trials: pd.DataFrame) -> tuple[float, float]:
    """Return the interval of an accuracy over seeds."""
    return interval_over_seeds(trials["right"].to_numpy(float), trials["periods"].to_numpy(int))


def clutter_curves(table: pd.DataFrame, clutter: str, distance_m: float) -> pd.DataFrame:
    """Return the accuracy of each receiver over the amount of one kind of clutter, as `plots.draw_stress` takes it.

    Parameters
    ----------
    table : DataFrame
        Rows of `link_trials.link_rows` of `link_conditions.clutter_conditions`.
    clutter : str
        Its kind; recordings without clutter are the amount 0.
    distance_m : float
        [m]

    Returns
    -------
    DataFrame
        ``receiver``, ``level`` (the amount), and the columns of `statistics.over_seeds`.
    """
    own = table[table["clutter"].isin(["none", clutter]) & (table["distance_m"] == distance_m)]
    return over_seeds(own.rename(columns={"amount": "level"}), ["receiver", "level"], "right")


def totals(table: pd.DataFrame, by: Sequence[str] = ("receiver",)) -> pd.DataFrame:
    """Add up the counts of trials.

    Parameters
    ----------
    table : DataFrame
        Rows of `link_trials.link_rows`.
    by : sequence of str
        Columns that tell groups apart.

    Returns
    -------
    DataFrame
        One row for each group: ``periods``; ``accuracy``; ``right_first`` and ``right_fifth`` (shares of the
        recordings); ``packets_right`` (share); ``wrong_ids`` (count); ``false_rows`` and ``rows`` per period;
        ``first_right_ms`` (median over the recordings in which there is one) and ``ms_per_period`` (median).
    """
    rows = []
    for key, group in table.groupby(list(by), sort=False):
        total = group[["periods", "right", "packets", "packets_right", "wrong_ids", "false_rows", "rows"]].sum()
        rows.append(
            {
                **dict(zip(by, key, strict=True)),
                "periods": total["periods"], "accuracy": total["right"] / total["periods"],
                "right_first": group["right_first"].mean(), "right_fifth": group["right_fifth"].mean(),
                "packets_right": total["packets_right"] / max(total["packets"], 1), "wrong_ids": total["wrong_ids"],
                "false_rows": total["false_rows"] / total["periods"], "rows": total["rows"] / total["periods"],
                "first_right_ms": np.nanmedian(group["first_right_ms"].to_numpy(float))
                if group["first_right_ms"].notna().any() else np.nan,
                "ms_per_period": group["ms_per_period"].median(),
            }
        )  # fmt: skip
    return pd.DataFrame(rows)
