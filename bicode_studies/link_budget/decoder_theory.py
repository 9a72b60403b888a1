"""Expected shares of bits and packets that are read through a channel without stray events.

With m the probability that an edge is missed,

- a chip is read right if the edge before it was detected, or if it was missed when the chip before was wrong: states
  alternate, so one missed edge spoils one run of chips. r_mid = 1 - m r_first after the edge in the middle of a bit;
  half of the bits begin with an edge, so r_first = (r_mid + 1 - m r_mid) / 2.
- a bit is read if its first chip is right and the edge in its middle is detected: (1 - m) r_first. Otherwise its chips
  are equal and it is unread; without stray events no bit is ever inverted.
- a packet is read if none of its n rises and n falls is missed, nor the fall before its start: (1 - m)^(2 n + 1),
  averaged over the payloads.

An edge is detected if a bin of delta_t_ID holds more of its events than the gate (`led_state.edge_gates`), which is
computed from the counts and so varies by chance.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.stats import norm, poisson

from bicode_lab.marker import PacketFormat
from bicode_studies.link_budget.decoder_limits import PACKETS_PER_STREAM, Channel
from bicode_studies.link_budget.packet_counts import count_rises

Floats = npt.NDArray[np.float64]

PHASES = 16  # places of an edge within a bin


def edge_missed(channel: Channel, delta_t_id_us: int, gate: float, edges: int) -> tuple[Floats, Floats]:
    """Return the probability that an edge is missed, for each value that the gate may take, without stray events.

    The gate is a share of a usual count, ``sum(N^2) / sum(N)`` over the counted edges of one side. That count varies by
    chance, and a count is a whole number, so a gate of 0.99 and one of 1.01 differ much. Each whole number that the
    gate may lie above has its weight, from a normal distribution.

    Parameters
    ----------
    channel : Channel
        Its stray events are left out.
    delta_t_id_us : int
        Length of a bin [us].
    gate : float
        Share of a usual count that a count must exceed, 0 .. 1; 0 lets any event count.
    edges : int
        Number of edges of one side that the gate is computed from.

    Returns
    -------
    missed, weights : ndarray, shape (gates, PHASES)
        Probability, 0 .. 1, and weight of the gate (sum 1 over gates), for `PHASES` places of an edge in a bin.

    Examples
    --------
    >>> missed, weights = edge_missed(Channel(events_per_edge=3.0), 250, gate=0.0, edges=40)
    >>> bool(np.allclose(missed, np.exp(-3.0))), weights.shape
    (True, (1, 16))
    """
    if channel.events_per_edge == 0:
        return np.ones((1, PHASES)), np.ones((1, PHASES))
    borders = np.arange(1, 64)[:, None] - (np.arange(PHASES) + 0.5) / PHASES
    reached = 1 - np.exp(-borders * delta_t_id_us / channel.spread_us)
    mean = channel.events_per_edge * np.diff(reached, axis=0, prepend=0.0)
    usual = (mean**2 + mean).sum(0) / mean.sum(0)
    # Variance of N^2 - usual N for a Poisson number N, for the error of the ratio.
    scatter = 4 * mean**3 + 6 * mean**2 + mean - 2 * usual * (2 * mean**2 + mean) + usual**2 * mean
    error = np.sqrt(scatter.sum(0) / edges) / mean.sum(0)
    whole = np.arange(int(np.floor((gate * (usual + 4 * error)).max())) + 1)[:, None]
    weights = norm.cdf((whole + 1 - gate * usual) / (gate * error)) if gate else np.ones((1, PHASES))
    weights = np.diff(weights, axis=0, prepend=0.0)
    missed = poisson.cdf(whole[:, None], mean).prod(1)
    return missed, weights / weights.sum(0)


def predict(channel: Channel, packet_format: PacketFormat, delta_t_id_us: int, gate: float) -> dict[str, float]:
    """Return the expected shares of bits and of packets that are read, without stray events.

    Parameters
    ----------
    channel : Channel
        Its stray events are left out.
    packet_format : PacketFormat
    delta_t_id_us : int
        Length of a bin [us].
    gate : float
        Share of a usual count that a count must exceed, 0 .. 1; 0 lets any event count.

    Returns
    -------
    dict of str to float
        ``bits`` and ``packets``, 0 .. 1.
    """
    rises = count_rises(packet_format)
    missed, weights = edge_missed(channel, delta_t_id_us, gate, round(PACKETS_PER_STREAM * float(rises.mean())))
    m = (missed * weights).sum(0)
    first_right = (1 - m / 2) / (1 + m * (1 - m) / 2)
    detected = (1 - missed)[:, :, None]
    # Each side has its own gate.
    on, off = ((detected**n * weights[:, :, None]).sum(0) for n in (rises, rises + 1))
    return {"bits": float(((1 - m) * first_right).mean()), "packets": float((on * off).mean())}
