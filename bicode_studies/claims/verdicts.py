"""Does it come out as the paper says?   claims, trials -> a verdict for each claim

One rule for all of them:

    reproduced        our value is inside the claim's bounds [lo, hi]; a ">" leaves lo itself out
    contradicted      our value and its whole 95 % interval are outside
    undecided         our value is outside, but its interval reaches in; or an order is a tie
    calibrated on     a constant was fitted to it, so that it agrees is no news
    not testable here what it is about is not in the package, with the reason
    no trials yet     the figure's trials have not been run

An order is judged by a difference that must be above 0. Of ranges it is that of the interpolated 50 % distances, at
the step that rises least. Of accuracies it is that between the first and the last level, mean over the places they
share (see `claim_statistics.better`), and a single step beyond chance the wrong way contradicts the order. A
difference whose interval holds 0 is a tie, so for orders "reproduced" asks for more than a value on the right side.

Where a claim is about several conditions ("at every distance up to 2.5 m") the one that agrees least is judged.
Facts, rules and parameters have no interval: they are reproduced where the package does or has what the paper says,
and contradicted where not.
"""

from __future__ import annotations

import math
from typing import Any

import pandas as pd
from tqdm import tqdm

from bicode_studies.claims.curves import Answer, NoTrials, Tables
from bicode_studies.claims.figure_claims import TESTS
from bicode_studies.claims.text_claims import FACTS

REPRODUCED, CONTRADICTED, UNDECIDED = "reproduced", "contradicted", "undecided"
CALIBRATED, UNTESTABLE, NO_TRIALS = "calibrated on", "not testable here", "no trials yet"
VERDICTS = (REPRODUCED, CONTRADICTED, UNDECIDED, CALIBRATED, UNTESTABLE, NO_TRIALS)

FIG_8 = "the free constants of light path and pixel are fitted to Fig. 8"
CALIBRATED_ON = {
    **dict.fromkeys((f"F8.{number}" for number in range(1, 8)), FIG_8),
    "A1": FIG_8 + ", of which the abstract gives a summary",
    "A2": FIG_8 + ", of which the abstract gives a summary",
    "F9.3": "Fig. 8 has no plate seen from the side; the glow of its edges is fitted to this range",
    "F11.2": "Fig. 8 has no infrared light; that LED's brightness behind the filter is fitted to this point",
    "F14.5": "the speed of the authors' computer is not in Fig. 8; its limit is fitted to this loss",
}
"""Claims that constants were fitted to, with the reason. No other claim may be looked at for a constant."""

TENSION = dict.fromkeys(
    ("F8.3", "F11.2", "F11.3", "F12.4"),
    "the paper pulls both ways: at 20 m about half (F11.2, called nearly equal to red light's in F11.3), "
    "as far as it goes when still (F8.3), and more than 90 % when panned (F12.4)",
)
"""Claims that can hardly all hold together; each is tested as written."""

CAUSES: dict[str, str] = {
    "F9.1": "in most of the periods lost at 40 deg the pattern is found in its place, with its pose mirrored: at 2.5 m "
    "perspective moves its corners by less than half a pixel (notebook 09)",
    "F9.5": "glowing pixels are counted, and the turned plate keeps more of them than of its outline: the face has "
    "dark cells and the edge has none, and light spreads beyond both (notebook 13)",
    "F10.1": "the lens's blur closes dark cells of 3.7 px; with a sharper lens they stay open (notebook 10)",
    "F12.1": "smear adds to the swelling of bright cells: at half the current the pose is kept more often, and on "
    "frames that count events always (notebook 12, notebook 14)",
    "F14.1": "as F12.1 (notebook 14)",
}
"""Why a claim is contradicted or undecided, with the notebook whose experiment shows it."""

COLUMNS = [
    "id",
    "figure",
    "section",
    "kind",
    "claim",
    "tested",
    "ours",
    "value",
    "low",
    "high",
    "lo",
    "hi",
    "verdict",
    "note",
]


def verdict(
    value: float, low: float, high: float, lo: float, hi: float, *, above: bool = False, below: bool = False
) -> str:
    """A value with its interval and a claim's bounds in, the verdict out.

    Parameters
    ----------
    value, low, high : float
        Ours, with its 95 % interval.
    lo, hi : float
        The claim's.
    above, below : bool
        Whether `lo`, or `hi`, itself is already outside.

    Examples
    --------
    >>> verdict(0.97, 0.95, 0.98, 0.99, 1), verdict(0.97, 0.95, 1, 0.99, 1), verdict(1, 0.98, 1, 0.99, 1)
    ('contradicted', 'undecided', 'reproduced')
    """
    if _is_inside(value, lo, hi, above, below):
        return REPRODUCED
    reaches = (high > lo if above else high >= lo) and (low < hi if below else low <= hi)
    return UNDECIDED if reaches else CONTRADICTED


def order_verdict(low: float, high: float, broken: bool) -> str:
    """The interval of a difference that must be above 0, and whether a step goes the wrong way, in; the verdict out.

    Examples
    --------
    >>> order_verdict(0.1, 0.3, False), order_verdict(0, 0, False), order_verdict(-0.3, -0.1, False)
    ('reproduced', 'undecided', 'contradicted')
    """
    if broken or high < 0:
        return CONTRADICTED
    return REPRODUCED if low > 0 else UNDECIDED


def _is_inside(value: float, lo: float, hi: float, above: bool, below: bool) -> bool:
    """True where a value is within bounds, of which `lo` or `hi` may be outside."""
    return (value > lo if above else value >= lo) and (value < hi if below else value <= hi)


def judge_claims(claims: pd.DataFrame, tables: Tables) -> pd.DataFrame:
    """The paper's claims and the trials in, one row for each claim out; none is left out.

    Parameters
    ----------
    claims : DataFrame
        ``data/paper_claims.csv``, all columns as text.
    tables : mapping of str to DataFrame
        Rows of trials by figure, "08" .. "14"; what is missing is said in the verdict.

    Returns
    -------
    DataFrame
        ``id``, ``figure``, ``section``, ``kind``; ``claim``, the paper's words in short; ``tested``, what is asked of
        our value; ``ours``, our answer in words; ``value``, ``low``, ``high``, what was judged with its 95 % interval;
        ``lo``, ``hi``, its bounds; ``verdict`` (one of `VERDICTS`) and ``note``. Numbers that do not apply are nan.

    Raises
    ------
    ValueError
        A claim without a test.
    """
    bar = tqdm(claims.to_dict("records"), unit=" claims", leave=False, disable=None)
    rows = [judge(claim, tables) for claim in bar]
    return pd.DataFrame(rows, columns=COLUMNS)


def judge(claim: dict[Any, Any], tables: Tables) -> dict[str, Any]:
    """One claim and the trials in, its row out."""
    name = claim["id"]
    row = {column: claim[column] for column in ("id", "figure", "section", "kind")}
    row |= {"claim": claim["quote"], "tested": _tested(claim)}
    lo, hi = _number(claim["lo"], -math.inf), _number(claim["hi"], math.inf)
    try:
        if name in TESTS:
            answer = TESTS[name](tables, lo, hi)
        elif name in FACTS:
            answer = FACTS[name](tables, claim["value"])
        else:
            raise ValueError(f"claim {name} has no test; give it one in claim_tests or claim_facts")
    except NoTrials as missing:
        return {**row, "ours": "", "verdict": NO_TRIALS, "note": str(missing)}
    lo, hi = (lo if answer.lo is None else answer.lo), (hi if answer.hi is None else answer.hi)
    if answer.is_order:
        lo, hi = 0.0, math.inf
    found = _verdict_of(answer, claim["op"], lo, hi)
    notes = [answer.why_not, f"the other way: {answer.broken}" if answer.broken else ""]
    notes += [CAUSES.get(name, ""), TENSION.get(name, "")]
    if name in CALIBRATED_ON:
        notes = [CALIBRATED_ON[name], f"the value alone would be {found}", *notes]
        found = CALIBRATED
    return {
        **row, "ours": answer.ours, "value": answer.value, "low": answer.low, "high": answer.high,
        "lo": lo, "hi": hi, "verdict": found, "note": "; ".join(filter(None, notes)),
    }  # fmt: skip


def _tested(claim: dict[Any, Any]) -> str:
    """A claim in, what is asked of our value in short out."""
    asked = f"{claim['quantity']} {claim['op']} {claim['value']}".strip()
    unit = "" if claim["unit"] in ("", "-", "frac", "bits") else f" {claim['unit']}"
    where = "" if claim["condition"] in ("", "-", "any") else f", {claim['condition']}"
    return f"{asked}{unit}{where}"


def _verdict_of(answer: Answer, op: str, lo: float, hi: float) -> str:
    """An answer, the claim's operator and its bounds in, the verdict out."""
    if answer.why_not:
        return UNTESTABLE
    if answer.holds is not None:
        return REPRODUCED if answer.holds else CONTRADICTED
    if answer.value is None or answer.low is None or answer.high is None:
        raise ValueError("an answer is a value with its interval, a fact, or a reason why there is none")
    if answer.is_order:
        return order_verdict(answer.low, answer.high, bool(answer.broken))
    return verdict(answer.value, answer.low, answer.high, lo, hi, above=op == ">", below=op == "<")


def _number(text: object, missing: float) -> float:
    """A cell of the claims file in, its number out; `missing` where it is empty."""
    return float(str(text)) if str(text) not in ("", "nan") else missing


def count_verdicts(judged: pd.DataFrame) -> pd.DataFrame:
    """Rows of `judge_claims` in; how many of the numbers and orders, and of all others, have each verdict, out."""
    measured = judged["kind"].isin(["number", "order"])
    kinds = measured.map({True: "numbers and orders", False: "facts, rules and parameters"})
    counts = pd.crosstab(kinds, judged["verdict"]).reindex(columns=VERDICTS, fill_value=0)
    return counts.loc[:, (counts > 0).any()].rename_axis(index="", columns="")
