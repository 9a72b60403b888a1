"""A verdict for each claim of the paper, all by one rule.

    reproduced        the whole interval of our value is within the claim's bounds [lo, hi], widened by a band
    contradicted      the whole interval is outside these
    undecided         the interval reaches across a bound
    depends on the reading   the sentence leaves two readings open, and they have different verdicts
    used as stated    the package or its trials take the value from the paper, so agreement is no evidence
    not testable here the package has no model of what the claim is about; the note says why
    no trials yet     the trials of the figure have not been run

So "reproduced" and "contradicted" ask for the same certainty. The interval that is judged is wider than the 95 % one
that is shown: 40 claims are judged by trials, and in at least 95 % of cases all 40 intervals are to hold their true
values. So each end of one may fail in 1 of 1,600 cases (Bonferroni). Holm's rule would decide a little more, but then a
verdict on one claim would depend on the trials of all others.

The band is a difference that the paper itself cannot tell: 0.02 for accuracies (`statistics.ACCURACY_BAND`), 5 % for
regions (`region_claims.RATIO_BAND`). Ranges have none: each is a tested distance. The paper cannot tell it from what
lies within half of the gap to the next one, and no other tested distance lies there. Orders have none, either: their
bound is 0.

An order is judged by a difference that must be above 0. For ranges it is the difference of `ranges_m` at the step that
rises least. For accuracies it is the difference of the last and the first level, averaged over the places that they
share (see `bicode_studies.claims.differences.accuracy_rises`); a single step that goes the wrong way by more than
chance contradicts the order. A difference whose interval holds 0 is a tie. So an order is reproduced only if the whole
interval is above 0.

If a claim is about several conditions ("at every distance up to 2.5 m"), the one that agrees least is judged. Facts,
rules and parameters have no interval: they are reproduced if the package does what the paper says, and contradicted if
it does not.
"""

from __future__ import annotations

from typing import Any

import pandas as pd
from tqdm import tqdm

from bicode_studies.claims.claim_result import ClaimResult, NoTrials, Tables
from bicode_studies.claims.figure_claims import SECOND, TESTS
from bicode_studies.claims.readings import DEPENDS, Reading, by_reading, one_verdict, readings_of
from bicode_studies.claims.text_claims import FACTS

REPRODUCED, CONTRADICTED, UNDECIDED = "reproduced", "contradicted", "undecided"
AS_STATED, UNTESTABLE, NO_TRIALS = "used as stated", "not testable here", "no trials yet"
VERDICTS = (REPRODUCED, DEPENDS, UNDECIDED, CONTRADICTED, AS_STATED, UNTESTABLE, NO_TRIALS)
READING_COLUMNS = ["value", "low", "high", "lo", "hi", "verdict"]
COLUMNS = [
    *("id", "figure", "section", "kind", "class", "claim", "tested", "ours", "verdict"),
    *(f"{column}_{name}" for name in "ab" for column in READING_COLUMNS),
    "note",
]


def verdict(
    low: float, high: float, lo: float, hi: float, *, above: bool = False, below: bool = False, band: float = 0.0
) -> str:
    """Return the verdict on a number.

    Parameters
    ----------
    low, high : float
        Ends of the interval of our value.
    lo, hi : float
        Bounds of the claim.
    above, below : bool
        True if `lo`, or `hi`, itself is already outside.
    band : float
        By how much the bounds are widened.

    Returns
    -------
    str
        `REPRODUCED`, `UNDECIDED` or `CONTRADICTED`.

    Examples
    --------
    >>> [verdict(low, high, 0.9, 1, band=0.02) for low, high in ((0.89, 0.95), (0.85, 0.95), (0.8, 0.87))]
    ['reproduced', 'undecided', 'contradicted']
    """
    least, most = lo - band, hi + band
    if (low > least if above else low >= least) and (high < most if below else high <= most):
        return REPRODUCED
    reaches = (high > least if above else high >= least) and (low < most if below else low <= most)
    return UNDECIDED if reaches else CONTRADICTED


def order_verdict(low: float, high: float, broken: bool) -> str:
    """Return the verdict on an order, whose difference must be above 0.

    Parameters
    ----------
    low, high : float
        Ends of the interval of the difference.
    broken : bool
        True if a single step goes the wrong way by more than chance.

    Returns
    -------
    str
        `REPRODUCED`, `UNDECIDED` (a tie) or `CONTRADICTED`.

    Examples
    --------
    >>> order_verdict(0.1, 0.3, False), order_verdict(0, 0, False), order_verdict(-0.3, -0.1, False)
    ('reproduced', 'undecided', 'contradicted')
    """
    if broken or high < 0:
        return CONTRADICTED
    return REPRODUCED if low > 0 else UNDECIDED


def judge_claims(claims: pd.DataFrame, tables: Tables) -> pd.DataFrame:
    """Judge every claim by the trials.

    Parameters
    ----------
    claims : DataFrame
        ``data/paper_claims.csv``, all columns as text.
    tables : mapping of str to DataFrame
        Rows of trials by figure, "08" .. "14". The verdict says where a table is missing.

    Returns
    -------
    DataFrame
        One row for each claim, none left out: ``id``, ``figure``, ``section``, ``kind``, ``class``; ``claim``, a few
        words of the paper; ``tested``, what is asked of our value; ``ours``, our finding in words; ``verdict`` (one
        of `VERDICTS`) and ``note``. For the readings a and b: ``value_a``, ``low_a``, ``high_a``, the number that is
        judged and its 95 % interval; ``lo_a``, ``hi_a``, its bounds; ``verdict_a``; and the same with ``_b``. Numbers
        that do not apply are nan.

    Raises
    ------
    ValueError
        If a claim has no test.
    """
    bar = tqdm(claims.to_dict("records"), unit=" claims", leave=False, disable=None)
    rows = [judge_claim(claim, tables) for claim in bar]
    return pd.DataFrame(rows, columns=COLUMNS)


def judge_claim(claim: dict[Any, Any], tables: Tables) -> dict[str, Any]:
    """Judge one claim by the trials.

    Parameters
    ----------
    claim : dict
        A row of ``data/paper_claims.csv``, column to text.
    tables : mapping of str to DataFrame
        Rows of trials by figure.

    Returns
    -------
    dict
        A row of `judge_claims`.

    Raises
    ------
    ValueError
        If the claim has no test.
    """
    row = {column: claim[column] for column in ("id", "figure", "section", "kind", "class")}
    row |= {"claim": claim["quote"], "tested": _tested(claim)}
    readings = readings_of(claim)
    try:
        results = [_result(claim, reading, tables) for reading in readings]
    except NoTrials as missing:
        return {**row, "ours": "", "verdict": NO_TRIALS, "note": str(missing)}
    notes = [result.why_not for result in results]
    notes += [f"the other way: {result.broken}" for result in results if result.broken]
    notes += [claim["cause"], claim["tension"]]
    for reading, result in zip(readings, results, strict=True):
        lo, hi = result.bounds(reading.lo, reading.hi)
        found = _verdict_of(result, lo, hi, reading)
        numbers = (result.value, result.low, result.high, lo, hi, found)
        row |= {f"{column}_{reading.name}": each for column, each in zip(READING_COLUMNS, numbers, strict=True)}
    return {
        **row,
        "ours": by_reading([result.ours for result in results]),
        "verdict": one_verdict([row[f"verdict_{reading.name}"] for reading in readings]),
        "note": "; ".join(dict.fromkeys(filter(None, notes))),
    }


def _result(claim: dict[Any, Any], reading: Reading, tables: Tables) -> ClaimResult:
    """Return what we find for a reading of a claim."""
    name = claim["id"]
    tests = TESTS if reading.name == "a" else SECOND
    if name in tests:
        return tests[name](tables, reading.lo, reading.hi)
    if name in FACTS:
        return FACTS[name](tables, claim["value"])
    raise ValueError(
        f"reading {reading.name} of claim {name} has no test; add one to TESTS or SECOND of figure_claims, or to FACTS "
        "of text_claims"
    )


def _tested(claim: dict[Any, Any]) -> str:
    """Return in short what a claim asks of our value."""
    readings = readings_of(claim)
    words = [each.words for each in readings]
    asked = f"{claim['quantity']} {claim['op']} {claim['value']}".strip()
    asked += "" if claim["unit"] in ("", "-", "frac", "bits") else f" {claim['unit']}"
    if claim["kind"] == "number":
        asked = claim["quantity"]
        words = [f"{each.words}: {each.bounds}" if each.words else each.bounds for each in readings]
    where = "" if claim["condition"] in ("", "-", "any") else f", {claim['condition']}"
    return f"{asked}{where}" + (f"; {by_reading(words)}" if any(words) else "")


def _verdict_of(result: ClaimResult, lo: float, hi: float, reading: Reading) -> str:
    """Return the verdict on a result, given its bounds and whether the reading has these outside."""
    if result.why_not:
        return UNTESTABLE
    if result.holds is not None:
        agreed = AS_STATED if result.is_input else REPRODUCED
        return agreed if result.holds else CONTRADICTED
    low, high = result.judged_low, result.judged_high
    if low is None or high is None:
        raise ValueError("a ClaimResult needs a value with its intervals, `holds`, or `why_not`")
    if result.is_order:
        return order_verdict(low, high, bool(result.broken))
    return verdict(low, high, lo, hi, above=reading.lo_open, below=reading.hi_open, band=result.band)
