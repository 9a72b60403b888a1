"""Find the LED's edges in ON and OFF counts, the transmitter's clock, and the chips of a packet (Fig. 2, box g).

`decode` uses these functions and explains the steps. Times are in bins of delta_t_ID here, from the first bin on.
"""

from __future__ import annotations

import numpy as np

from bicode_lab.kernels import njit

CLOCK_STEPS = 12  # number of chip lengths that are tried on either side of the nominal one
CLOCK_STEP = 0.005  # relative difference between them; 22 chips drift by a tenth of a chip, less than a bin
PHASES = 40  # places of the grid that are tried within a chip
MISFIT_CHIPS = 0.2  # the latency differs from edge to edge by about this much at 1 kHz
NEARNESS = 0.3  # weight of the distance to the grid lines: of two grids that fit, the nearer one is taken
CLOCK_DOUBT = 3.0  # weight of the clock error, 0.03 points per percent: of two that fit, the smaller error is taken
OFF_LATER_CHIPS = 0.1  # OFF edges are seen this much later than ON edges, +- half a chip


@njit(cache=True)
def find_edges(lead, gate_on, gate_off):  # type: ignore[no-untyped-def]
    """Find the edges of the LED's state.

    Parameters
    ----------
    lead : ndarray of int64, shape (n,)
        ON counts less OFF counts of each bin.
    gate_on, gate_off : float
        Lead that a bin needs to count, see `led_state.edge_gates`.

    Returns
    -------
    times : ndarray, shape (m,)
        Time of each edge: centre of mass of the lead in the bin of the edge and its neighbours [bins].
    rises : ndarray of bool, shape (m,)
        Whether the LED goes on.
    """
    times = np.empty(lead.size)
    rises = np.empty(lead.size, np.bool_)
    n = 0
    state = -1
    for b in range(lead.size):
        new = 1 if lead[b] > gate_on else (0 if lead[b] < -gate_off else -1)
        if new < 0 or new == state:
            continue
        sign = 1 if new else -1
        mass = 0.0
        moment = 0.0
        for k in range(max(b - 1, 0), min(b + 2, lead.size)):
            weight = max(sign * lead[k], 0)
            mass += weight
            moment += weight * (k + 0.5)
        times[n] = moment / mass
        rises[n] = new == 1
        state = new
        n += 1
    return times[:n], rises[:n]


@njit(cache=True)
def find_starts(times, rises, least_run):  # type: ignore[no-untyped-def]
    """Find the ON edges that end a long run in which the LED is off.

    Parameters
    ----------
    times, rises : ndarray, shape (m,)
        See `find_edges`.
    least_run : float
        Shortest run [bins].

    Returns
    -------
    ndarray of int64, shape (k,)
        Numbers of the edges.
    """
    starts = np.empty(times.size, np.int64)
    n = 0
    for i in range(times.size):
        before = times[i - 1] if i else 0.0
        if rises[i] and times[i] - before >= least_run:
            starts[n] = i
            n += 1
    return starts[:n]


@njit(cache=True)
def _fit_clock(times, rises, first, last, nominal):  # type: ignore[no-untyped-def]
    """Fit the grid of chips to the edges of one packet.

    Returns the length of a chip [bins] and the phases of ON and of OFF edges [chips]. An edge can lie anywhere in its
    bin, so it fits a grid line that is no farther than half a bin away. Each MISFIT_CHIPS more cost a point, up to one
    point per edge, so that a stray edge costs no more than that.
    """
    half_bin = 0.5 / nominal
    best = -1e9
    best_chip, best_on, best_off = nominal, 0.0, 0.0
    scores = np.empty((2, PHASES))
    for step in range(-CLOCK_STEPS, CLOCK_STEPS + 1):
        chip = nominal * (1 + step * CLOCK_STEP)
        scores[:] = 0.0
        for i in range(first, last):
            place = (times[i] - times[first]) / chip
            row = 1 if rises[i] else 0
            for k in range(PHASES):
                away = place - k / PHASES
                away = abs(away - np.floor(away + 0.5))
                misfit = max(away - half_bin, 0.0) / MISFIT_CHIPS
                scores[row, k] -= min(misfit, 1.0) + NEARNESS * away * away
        k_on, k_off = np.argmax(scores[1]), np.argmax(scores[0])
        score = scores[1, k_on] + scores[0, k_off] - CLOCK_DOUBT * abs(step) * CLOCK_STEP
        if score > best:
            best = score
            best_chip, best_on, best_off = chip, k_on / PHASES, k_off / PHASES
    best_on -= np.floor(best_on + 0.5)
    later = best_off - best_on - OFF_LATER_CHIPS
    return best_chip, best_on, best_on + OFF_LATER_CHIPS + later - np.floor(later + 0.5)


@njit(cache=True)
def read_chips(times, rises, first, n_chips, nominal):  # type: ignore[no-untyped-def]
    """Read the chips of one packet.

    Parameters
    ----------
    times, rises : ndarray, shape (m,)
        See `find_edges`.
    first : int
        Number of the first ON edge of the packet.
    n_chips : int
        Number of chips to read from that edge on.
    nominal : float
        Nominal length of a chip [bins].

    Returns
    -------
    chips : ndarray of uint8, shape (n_chips,)
        Levels of the LED.
    chip : float
        Length of a chip [bins].
    phase : float
        Time from the first ON edge to the grid line that it belongs to [bins].
    """
    last = first
    while last < times.size and times[last] - times[first] < (n_chips - 0.5) * nominal:
        last += 1
    chip, on_phase, off_phase = _fit_clock(times, rises, first, last, nominal)
    chips = np.zeros(n_chips, np.uint8)
    for i in range(first, last):
        place = int(np.round((times[i] - times[first]) / chip - (on_phase if rises[i] else off_phase)))
        for k in range(max(place, 0), n_chips):
            chips[k] = 1 if rises[i] else 0
    return chips, chip, on_phase * chip
