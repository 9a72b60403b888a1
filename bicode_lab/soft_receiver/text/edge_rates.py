"""How many events each bin of a chip is expected to hold: learned from one light, without knowing what it sent.

A chip is divided into `PHASES` bins. The *rates* are the expected ON events and OFF events of each bin, for each
context: the levels of the last `memory` chips. They begin with two kernels and a background. A kernel is what one edge
makes, bin by bin, over ``memory - 1`` chips; a rise makes ON events, a fall makes OFF events, and what several edges
make adds up. So a start needs nothing but the middles and the widths of two kernels, and little data are enough to
learn them. In a second stage each context has rates of its own, with those of the kernels as a guess that counts like
`GUESS_CHIPS` chips: a refractory period, or a tail that ends when the light switches again, is no sum over edges.

The log-likelihood is that of a Poisson process, divided by the dispersion: the variance over the mean of what the rates
leave unexplained, over 1 to 16 bins, the largest of them (quasi-likelihood, Wedderburn 1974). So an edge of forty
events that arrive together does not count as forty independent ones, and margins are comparable between lights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.soft_receiver.levels import PHASES
from bicode_lab.soft_receiver.nodes import Nodes
from bicode_lab.soft_receiver.text.amounts import Amounts
from bicode_lab.soft_receiver.viterbi import likeliest_path

Floats = npt.NDArray[np.float64]

GUESS_CHIPS = 24.0  # the kernels have the weight of this many chips of each context
GUESS_EDGES = 0.5  # the kernels of the start have the weight of this many edges
FIT_ROUNDS = 15
FLOOR = 1e-7  # smallest rate
WIDTHS = tuple(1 << k for k in range(PHASES.bit_length()))  # bins over which the dispersion is looked at


@dataclass(frozen=True, eq=False)
class Kernels:
    """What an edge makes, and what comes without any edge.

    Parameters
    ----------
    edge : ndarray, shape (2, chips, PHASES)
        Expected ON amount of a rise and OFF amount of a fall in each bin after it.
    background : ndarray, shape (2,)
        Expected ON and OFF amount of each bin without an edge, above 0.
    """

    edge: Floats
    background: Floats


@dataclass(frozen=True, eq=False)
class Learned:
    """What was learned of a light.

    Parameters
    ----------
    kernels : Kernels
    rates : ndarray, shape (contexts, PHASES, 2)
        Expected amounts, above 0.
    dispersion : ndarray, shape (2,)
        Variance over mean of what is left unexplained, ON and OFF, above 0.
    gain : float
        Log-likelihood of the likeliest path over that of amounts that come at any time, both not divided by the
        dispersion.
    path : ndarray of int32, shape (chips,)
        The likeliest path.
    """

    kernels: Kernels
    rates: Floats
    dispersion: Floats
    gain: float
    path: npt.NDArray[np.int32]


def edge_contexts(memory: int) -> Floats:
    """Tell which edges each context holds.

    Parameters
    ----------
    memory : int
        Number of chips in a context.

    Returns
    -------
    ndarray, shape (2, contexts, memory - 1)
        1 where there is a rise (0), or a fall (1), that many chips ago.

    Examples
    --------
    >>> edge_contexts(2)[:, :, 0].tolist()  # contexts 00, 01 (a rise), 10 (a fall), 11
    [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]
    """
    levels = np.arange(1 << memory)[:, None] >> np.arange(memory) & 1
    turns = levels[:, :-1] - levels[:, 1:]
    return np.stack([turns == 1, turns == -1]).astype(np.float64)


def kernel_rates(kernels: Kernels, edges: Floats) -> Floats:
    """Add up what the edges of each context make.

    Parameters
    ----------
    kernels : Kernels
    edges : ndarray, shape (2, contexts, chips)
        See `edge_contexts`.

    Returns
    -------
    ndarray, shape (contexts, PHASES, 2)
        Above 0.
    """
    rates = np.einsum("sck,skp->cps", edges, kernels.edge) + kernels.background
    return np.asarray(np.maximum(rates, FLOOR), np.float64)


def rate_scores(amounts: Amounts, rates: Floats, dispersion: Floats) -> Floats:
    """Compute the log-likelihood of each chip under each context, up to what all contexts have in common.

    Parameters
    ----------
    amounts : ndarray, shape (chips, PHASES, 2)
    rates : ndarray, shape (contexts, PHASES, 2)
    dispersion : ndarray, shape (2,)

    Returns
    -------
    ndarray, shape (chips, contexts)
    """
    weights = np.log(rates) / dispersion
    by_bin = np.ascontiguousarray(weights.reshape(len(rates), -1).T)
    scores = _weighted_sums(amounts.reshape(len(amounts), -1), by_bin, -(rates / dispersion).sum(axis=(1, 2)))
    return np.asarray(scores, np.float64)


def learn_rates(
    amounts: Amounts, nodes: Nodes, memory: int, start: Kernels, *, rates: Floats | None = None, rounds: tuple[int, int]
) -> Learned:
    """Find the likeliest path and estimate the rates along it, in turn.

    Parameters
    ----------
    amounts : ndarray, shape (chips, PHASES, 2)
    nodes : Nodes
        Those of the line code with this memory.
    memory : int
        Number of chips in a context.
    start : Kernels
        Where to begin.
    rates : ndarray, optional
        Rates of each context to begin with instead of those of the kernels.
    rounds : (int, int)
        Rounds with the kernels only, and rounds with rates for each context.

    Returns
    -------
    Learned
    """
    edges, kernels, one = edge_contexts(memory), start, np.ones(2)
    rates, spread = kernel_rates(kernels, edges) if rates is None else rates, one
    for k in range(sum(rounds)):
        path = likeliest_path(rate_scores(amounts, rates, spread), nodes)
        context = nodes.context[path]
        visits, sums = _sums_by_context(amounts, context, 1 << memory)
        kernels = _fit_kernels(visits, sums, kernels, edges, start)
        rates = kernel_rates(kernels, edges)
        if k >= rounds[0]:
            seen = visits[:, None, None]
            rates = np.maximum((sums + GUESS_CHIPS * rates) / (seen + GUESS_CHIPS), FLOOR)
        spread = dispersion_of(amounts, rates[context])
    path = likeliest_path(rate_scores(amounts, rates, spread), nodes)
    plain = rate_scores(amounts, rates, one)
    total = float(plain[np.arange(len(path)), nodes.context[path]].sum())
    mean = np.maximum(amounts.mean(axis=(0, 1), dtype=np.float64), FLOOR)
    anytime = float((amounts.sum(axis=(0, 1), dtype=np.float64) * np.log(mean)).sum() - mean.sum() * PHASES * len(path))
    return Learned(kernels, rates, spread, total - anytime, path)


def dispersion_of(amounts: Amounts, expected: Floats) -> Floats:
    """Measure how much more the amounts vary than those of a Poisson process of the expected mean.

    Parameters
    ----------
    amounts, expected : ndarray, shape (chips, PHASES, 2)

    Returns
    -------
    ndarray, shape (2,)
        Variance over mean for ON and for OFF, over the width from 1 to 16 bins that gives the most; above 0.
    """
    left = (amounts - expected).reshape(-1, 2)
    mean = np.maximum(expected.reshape(-1, 2).sum(axis=0), FLOOR)
    found = np.full(2, FLOOR)
    for width in WIDTHS:
        left = left if width == 1 else left[::2] + left[1::2]
        found = np.maximum(found, np.einsum("ks,ks->s", left, left) / mean)
    return found


def _sums_by_context(amounts: Amounts, context: npt.NDArray[np.int32], n_contexts: int) -> tuple[Floats, Floats]:
    """Return how many chips have each context, and the sums of their amounts."""
    visits = np.bincount(context, minlength=n_contexts)
    order, ends = np.argsort(context, kind="stable"), np.cumsum(visits)
    sums = np.zeros((n_contexts, *amounts.shape[1:]))
    for c in np.flatnonzero(visits):
        sums[c] = amounts[order[ends[c] - visits[c] : ends[c]]].sum(axis=0, dtype=np.float64)
    return visits.astype(np.float64), sums


def _fit_kernels(visits: Floats, sums: Floats, kernels: Kernels, edges: Floats, guess: Kernels) -> Kernels:
    """Share the sums among edges and background (expectation maximisation for added Poisson processes)."""
    edge, background = kernels.edge, kernels.background
    n_edges = np.einsum("sck,c->sk", edges, visits)[..., None]
    n_bins = max(float(visits.sum()) * PHASES, 1.0)
    for _ in range(FIT_ROUNDS):
        ratio = sums / kernel_rates(Kernels(edge, background), edges)
        shared = edge * np.einsum("sck,cps->skp", edges, ratio)
        edge = (shared + GUESS_EDGES * guess.edge) / (n_edges + GUESS_EDGES)
        background = np.maximum(background * ratio.sum(axis=(0, 1)) / n_bins, FLOOR)
    return Kernels(edge, background)


@njit(cache=True)
def _weighted_sums(amounts, weights, offset):  # type: ignore[no-untyped-def]
    """Return for each chip the sum of its amounts, weighed for each context, plus an offset; most amounts are 0."""
    n, n_bins = amounts.shape
    sums = np.empty((n, offset.size))
    for k in range(n):
        sums[k] = offset
        for j in range(n_bins):
            amount = amounts[k, j]
            if amount != 0:
                for c in range(offset.size):
                    sums[k, c] += amount * weights[j, c]
    return sums
