"""The distance of a candidate from Fig. 8 and from the measurements: a sum of squared misfits, each in its own scale.

It has the form of minus twice a log-likelihood. The statements of section IV-A are read as two readers wrote them down
(``data/readings``): recognised is an accuracy of one half or more.

    F8.1   at 10.7 mA the 2D marker has 100 % at 0.5, 1 and 2.5 m (0.995 or more); a lack of `WHOLE_SCALE` counts as one
    F8.2   it has less than one half at 7.5 m; 5 m itself is left open. An excess of `HALF_SCALE` counts as one
    F8.3   at 10.7 mA the ID has one half or more at 20 m (a); whether less at 25 m (b) is open, see `evidence.either`
    F8.4   at 21.3 mA the same at 30 m (a) and 35 m (b)
    F8.5   the ID's range at 21.3 mA is longer than at 5.5 mA: of 30, 40 and 50 m, the first one at which 5.5 mA is not
           recognised is one at which 21.3 mA is. At 30 m this is F8.4 (a) already, and counts once. If 5.5 mA is still
           recognised at 50 m, where the paper's distances end, the ranges are the same
    F8.6   the 2D marker's range is shorter at 21.3 mA than at 5.5 mA, by `STEP_M` or more, and does not grow from one
           current to the next. A lack of `STEP_M` counts as one

The terms are in the order of cost: what needs no recording first, then cells that tell most for their time. A candidate
whose sum passes the tolerance is not tried on the rest, since no term is negative.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from bicode_studies.calibration.candidates import NAMES, NOT_IN_FIG_8, Candidate, other_constants
from bicode_studies.calibration.cells import (
    HIGH_MA,
    LOW_MA,
    STANDARD_MA,
    Cell,
    cell_accuracy,
    cell_name,
    seeds_of,
)
from bicode_studies.calibration.evidence import (
    blink_misfit,
    either,
    latency_misfit,
    quiet_misfit,
    refractory_misfit,
)
from bicode_studies.statistics import HALF, ranges_m

HALF_SCALE = 0.1  # of an accuracy near one half; eight seeds far away scatter by so much
WHOLE_SCALE = 0.05  # of an accuracy near 100 %, where seeds scatter less
WHOLE = 0.995  # rounds to 100 %
STEP_M = 0.3  # of a range of the 2D marker; it is interpolated between distances with accuracies that scatter by 0.1
RANGE_M = (1.0, 2.5, 5.0, 7.5)  # the 2D marker is taken as recognised at the first and not at the last
TERMS = (
    "latency", "quiet_rate", "refractory", "F8.1 2.5 m", "F8.3a", "F8.4a", "F8.6", "F8.2", "F8.1 1 m", "F8.3b", "F8.4b",
    "F8.5", "blinks", "F8.1 0.5 m",
)  # fmt: skip
FITTED = (*NAMES, *NOT_IN_FIG_8)  # here, or to another claim
Accuracy = Callable[[Cell], float]


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """A candidate that is to be tried.

    Attributes
    ----------
    candidate : Candidate
    tolerance : float
        Distance beyond which it is given up.
    others : str
        Values of the constants that are not fitted, so that a trial is kept under them.
    """

    candidate: Candidate
    tolerance: float
    others: str


def terms(candidate: Candidate, accuracy: Accuracy) -> Iterator[tuple[str, float]]:
    """Yield the terms of the distance of a candidate, each when it is asked for.

    Parameters
    ----------
    candidate : Candidate
    accuracy : callable
        Takes a cell and returns the candidate's accuracy in it.

    Yields
    ------
    name : str
        In the order of `TERMS`.
    term : float
        0 or more.
    """
    yield "latency", either(latency_misfit(candidate))
    yield "quiet_rate", quiet_misfit(candidate) ** 2
    yield "refractory", refractory_misfit(candidate) ** 2
    yield "F8.1 2.5 m", _lack(accuracy(("2D", STANDARD_MA, 2.5)), WHOLE, WHOLE_SCALE) ** 2
    yield "F8.3a", _lack(accuracy(("ID", STANDARD_MA, 20.0)), HALF, HALF_SCALE) ** 2
    yield "F8.4a", _lack(accuracy(("ID", HIGH_MA, 30.0)), HALF, HALF_SCALE) ** 2
    yield "F8.6", ranges_term(accuracy)
    yield "F8.2", _excess(accuracy(("2D", STANDARD_MA, 7.5))) ** 2
    yield "F8.1 1 m", _lack(accuracy(("2D", STANDARD_MA, 1.0)), WHOLE, WHOLE_SCALE) ** 2
    yield "F8.3b", either(_excess(accuracy(("ID", STANDARD_MA, 25.0))))
    yield "F8.4b", either(_excess(accuracy(("ID", HIGH_MA, 35.0))))
    yield "F8.5", order_term(accuracy)
    yield "blinks", blink_misfit(candidate) ** 2
    yield "F8.1 0.5 m", _lack(accuracy(("2D", STANDARD_MA, 0.5)), WHOLE, WHOLE_SCALE) ** 2


def _lack(value: float, least: float, scale: float) -> float:
    """Return by how much a value is below what it should be at least, in units of a scale."""
    return max(0.0, least - value) / scale


def _excess(accuracy: float) -> float:
    """Return by how much an accuracy is above one half, in units of its scale."""
    return max(0.0, accuracy - HALF) / HALF_SCALE


def ranges_term(accuracy: Accuracy) -> float:
    """Return the term of the order of the 2D marker's ranges (F8.6).

    Parameters
    ----------
    accuracy : callable

    Returns
    -------
    float
    """
    found = []
    for current_ma in (LOW_MA, STANDARD_MA, HIGH_MA):
        curve = [1.0, *(accuracy(("2D", current_ma, distance_m)) for distance_m in RANGE_M[1:3]), 0.0]
        found.append(float(ranges_m(np.array(RANGE_M), np.array([curve]))[0]))
    ends = _lack(found[0] - found[-1], STEP_M, STEP_M)
    steps = [_lack(less - more, 0.0, STEP_M) for less, more in pairwise(found)]
    return float(sum(z**2 for z in (ends, *steps)))


def order_term(accuracy: Accuracy) -> float:
    """Return the term of the order of the ID's ranges (F8.5).

    Parameters
    ----------
    accuracy : callable

    Returns
    -------
    float
    """
    if accuracy(("ID", LOW_MA, 30.0)) < HALF:
        return 0.0
    for distance_m in (40.0, 50.0):
        if accuracy(("ID", LOW_MA, distance_m)) < HALF:
            return _lack(accuracy(("ID", HIGH_MA, distance_m)), HALF, HALF_SCALE) ** 2
    return _excess(accuracy(("ID", LOW_MA, 50.0))) ** 2


def try_proposal(proposal: Proposal, seed: int) -> list[dict[str, Any]]:
    """Find the distance of a candidate, up to its tolerance.

    Parameters
    ----------
    proposal : Proposal
    seed : int
        Number of the trial; it decides the seeds of all recordings, see `cells.seeds_of`.

    Returns
    -------
    list of dict
        One row: the constants; ``number``; ``distance`` (so far), ``is_whole`` (1 if all terms are in it); the terms
        that were worked out, by name; the accuracies in the cells that were tried, by `cell_name`.

    Raises
    ------
    ValueError
        If the constants that are not fitted have other values here than those that the trial is kept under.
    """
    if proposal.others != other_constants(FITTED):
        raise ValueError("constants.csv has changed since the run was started; start it anew")
    candidate = proposal.candidate
    found: dict[Cell, float] = {}

    def accuracy(cell: Cell) -> float:
        if cell not in found:
            found[cell] = cell_accuracy(candidate, cell, seeds_of(cell, seed))
        return found[cell]

    parts: dict[str, float] = {}
    for name, term in terms(candidate, accuracy):
        parts[name] = term
        if sum(parts.values()) > proposal.tolerance:
            break
    row = {"number": seed, "distance": sum(parts.values()), "is_whole": int(len(parts) == len(TERMS))}
    return [{**asdict(candidate), **row, **parts, **{cell_name(cell): share for cell, share in found.items()}}]
