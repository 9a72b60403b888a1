"""Read a text of UART characters, such as a public LED beacon sends, from the events of one light.

1. Clocks, phases and orders of ON and OFF are tried, and the likeliest is learned over the whole recording
   (`text.starts`, `text.learn`), with both ways to weigh a bin (`text.amounts`).
2. The most likely path is found over all chips of the recording. The parity takes part, because a character of odd
   parity is never sent. What the light says without this help is kept beside it: `parity_ok`.
3. A path that may take any levels checks the text (`text.check`). It decides which way to weigh a bin is better, and
   whether any letter is given. Where it fails, there is no letter but a reason.

A recording may begin and end within a frame, so the first and the last character are returned only if they hold without
the help of the code.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events
from bicode_lab.soft_receiver.line_code import LineCode
from bicode_lab.soft_receiver.nodes import build_free_nodes, build_nodes
from bicode_lab.soft_receiver.text.amounts import OFF, Weighing
from bicode_lab.soft_receiver.text.check import TextCheck, believed_near, doubt_text
from bicode_lab.soft_receiver.text.edge_rates import Floats, rate_scores
from bicode_lab.soft_receiver.text.learn import MEMORY, LearnedText, find_best_starts, learn_text
from bicode_lab.soft_receiver.viterbi import likeliest_path, likeliest_path_with_margins

LEAST_EVENTS = 20
MOST_CHIPS = 4_000_000  # some 2 GB
MIN_FRACTION = 0.1  # of the ON amount, and of the OFF amount, of a usual frame
MIN_GAIN = 6.0  # of the log-likelihood of a frame over that of a light that stays on
GOOD_ENOUGH = 0.995  # if this share of letters holds, no other way to weigh a bin is tried
BEGIN_OF_FALL = 0.05  # a fall is dated when this share of its events has come
Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class UartCharacter:
    """One frame of a text.

    Parameters
    ----------
    t_us : int
        When the events of its start chip begin, in the time of the recording [us].
    letter : str
        One character, code 0 .. 127.
    parity_ok : bool
        Whether the parity holds on the path that does not know the check.
    sure : float
        Probability 0.5 .. 1 of the least sure chip of the frame, by the learned rates.
    """

    t_us: int
    letter: str
    parity_ok: bool
    sure: float = 1.0


@dataclass(frozen=True, kw_only=True)
class TextReading:
    """What was read of a light.

    Parameters
    ----------
    characters : tuple of UartCharacter
        In the order of time; none if the text is not believed.
    check : TextCheck
        What decided this; its `reason` says why there is no reading.
    left_out : int
        Number of letters that are not given because too few letters around them hold.
    """

    characters: tuple[UartCharacter, ...] = ()
    check: TextCheck = field(default_factory=TextCheck)
    left_out: int = 0

    @property
    def warning(self) -> str | None:
        """One sentence for the user if not all that was found is given; None otherwise."""
        if self.check.reason is not None:
            return f"no reading: {self.check.reason}"
        if self.left_out:
            return f"{self.left_out} of {self.check.n_letters} letters are left out: too few around them are sure"
        return None


@dataclass(frozen=True, eq=False)
class _Frames:
    """The frames of a learned light: first chip, code, parity without help, whether it holds, and margin of each."""

    begins: npt.NDArray[np.int64]
    codes: npt.NDArray[np.int64]
    parity_ok: Bools
    held: Bools
    margin: Floats

    def at(self, keep: Bools) -> _Frames:
        """Keep some of them."""
        return _Frames(self.begins[keep], self.codes[keep], self.parity_ok[keep], self.held[keep], self.margin[keep])


def read_uart(events: Events, line: LineCode) -> list[UartCharacter]:
    """Read the characters that a light sends; see `read_text` for the reason if there are none.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Events of one region; x and y are not used.
    line : LineCode
        A code whose frames are characters, such as `UartLine`.

    Returns
    -------
    list of UartCharacter
        In the order of time.

    Examples
    --------
    >>> from bicode_lab.soft_receiver.line_code import UartLine
    >>> from bicode_lab.events import no_events
    >>> read_uart(no_events(), UartLine(rate_hz=504))
    []
    """
    return list(read_text(events, line).characters)


def read_text(events: Events, line: LineCode) -> TextReading:
    """Read the characters that a light sends, and say whether they are to be believed.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Events of one region; x and y are not used.
    line : LineCode
        A code whose frames are characters, such as `UartLine`.

    Returns
    -------
    TextReading

    Raises
    ------
    ValueError
        If the events span more than `MOST_CHIPS` chips.

    Examples
    --------
    >>> from bicode_lab.soft_receiver.line_code import UartLine
    >>> from bicode_lab.events import no_events
    >>> read_text(no_events(), UartLine(rate_hz=504)).warning
    'no reading: 0 events are too few for a text'
    """
    if events.size < LEAST_EVENTS:
        return TextReading(check=TextCheck(reason=f"{events.size} events are too few for a text"))
    nominal, is_on = (events["t"] - events["t"][0]) / line.chip_us, events["p"] > 0
    if nominal[-1] > MOST_CHIPS:
        raise ValueError(
            f"the events span {nominal[-1] * line.chip_us * 1e-6:,.0f} s, {nominal[-1]:,.0f} chips; give up to "
            f"{MOST_CHIPS:,} chips, and times in the unit of the file's format"
        )
    starts = find_best_starts(nominal, is_on, line)
    best: tuple[LearnedText, _Frames] | None = None
    ways: tuple[Weighing, ...] = ("events", "marks")
    for weighing in ways:
        text = learn_text(nominal, is_on, line, starts, weighing)
        found = _read_frames(text, line)
        if best is None or _merit(found) > _merit(best[1]):
            best = text, found
        if _merit(best[1])[0] >= GOOD_ENOUGH:
            break
    assert best is not None
    return _judge(*best, events, line)


def _merit(frames: _Frames) -> tuple[float, float]:
    """Return the share of frames that hold, and how sure they are on average: the larger, the better."""
    if not frames.held.size:
        return 0.0, 0.0
    return float(frames.held.mean()), float(_sure(frames.margin).mean())


def _judge(text: LearnedText, frames: _Frames, events: Events, line: LineCode) -> TextReading:
    """Check a text, and give the letters that are believed."""
    inner = np.ones(frames.held.size, np.bool_)
    inner[[0, -1] if inner.size else []] = frames.held[[0, -1] if inner.size else []]
    frames = frames.at(inner)
    check = TextCheck(
        n_letters=frames.held.size,
        held=float(frames.held.mean()) if frames.held.size else 0.0,
        parity=float(frames.parity_ok.mean()) if frames.held.size else 0.0,
        explained=_explained(text, line),
        reason=doubt_text(frames.codes, frames.held),
    )
    if check.reason is not None:
        return TextReading(check=check)
    near = believed_near(frames.held)
    given = frames.at(near)
    fall = np.cumsum(text.learned.kernels.edge[OFF].ravel())
    late = float(np.searchsorted(fall, BEGIN_OF_FALL * fall[-1])) / (fall.size // (MEMORY - 1))
    t_us = np.round(np.interp(given.begins + late, np.sort(text.chips), events["t"])).astype(np.int64)
    rows = zip(t_us, given.codes, given.parity_ok, np.round(_sure(given.margin), 4), strict=True)
    characters = tuple(UartCharacter(int(t), chr(code), bool(ok), float(sure)) for t, code, ok, sure in rows)
    return TextReading(characters=characters, check=check, left_out=int((~near).sum()))


def _sure(margin: Floats) -> Floats:
    """Turn margins into probabilities."""
    return np.asarray(1 / (1 + np.exp(-np.minimum(margin, 700))), np.float64)


def _read_frames(text: LearnedText, line: LineCode) -> _Frames:
    """Find the frames on the likeliest path, and what other paths say of them."""
    scores = rate_scores(text.amounts, text.learned.rates, text.learned.dispersion)
    checked, unchecked, free = build_nodes(line, MEMORY, True), build_nodes(line, MEMORY), build_free_nodes(MEMORY)
    path, margins = likeliest_path_with_margins(scores, checked)
    context = checked.context[path]
    begins = np.flatnonzero(checked.place[path] == 0)
    begins = begins[begins + line.frame_chips <= len(path)]
    if begins.size:
        n = line.frame_chips
        begins = begins[_is_whole(text, begins, n) & _beats_idle(scores, context, begins, n)]
    at = begins[:, None] + np.arange(line.frame_chips)
    sent = context[at] & 1
    codes, _, _ = _decode(sent, line)
    _, parity_ok, _ = _decode(unchecked.context[likeliest_path(scores, unchecked)][at] & 1, line)
    _, free_ok, is_frame = _decode(free.context[likeliest_path(scores, free)][at] & 1, line)
    return _Frames(begins, codes, parity_ok, free_ok & is_frame, margins[at].min(axis=1, initial=np.inf))


def _decode(levels: npt.NDArray[np.int32], line: LineCode) -> tuple[npt.NDArray[np.int64], Bools, Bools]:
    """Return the code of each frame, whether its check holds, and whether it is a frame of the line code at all."""
    if not len(levels):
        return np.zeros(0, np.int64), np.zeros(0, np.bool_), np.zeros(0, np.bool_)
    kinds, which = np.unique(levels, axis=0, return_inverse=True)
    said = [line.decode(kind) for kind in kinds]
    codes = np.array([value for value, _ in said], np.int64)
    holds = np.array([check for _, check in said], np.bool_)
    whole = np.array([bool((line.encode(v) == kind).all()) for (v, _), kind in zip(said, kinds, strict=True)], np.bool_)
    which = which.ravel()
    return codes[which], holds[which], whole[which]


def _is_whole(text: LearnedText, begins: npt.NDArray[np.int64], length: int) -> Bools:
    """Tell which frames, given by their first chips, hold both a fall and a rise.

    Every frame has one of each: its start, and its stop at the latest. Where the light stops for good, the events of
    one polarity are missing, or all but some noise.
    """
    total = np.concatenate([np.zeros((1, 2)), text.amounts.sum(axis=1, dtype=np.float64).cumsum(axis=0)])
    said = total[np.minimum(begins + length + 1, len(total) - 1)] - total[begins]
    return np.asarray((said >= MIN_FRACTION * np.median(said, axis=0)).all(axis=1) & (said > 0).all(axis=1), np.bool_)


def _beats_idle(scores: Floats, context: npt.NDArray[np.int32], begins: npt.NDArray[np.int64], length: int) -> Bools:
    """Tell which frames explain more than a light that stays on: two stray events are no letter."""
    gain = scores[np.arange(len(context)), context] - scores[:, -1]  # the last context is on for all its chips
    total = np.concatenate([[0.0], np.cumsum(gain)])
    return np.asarray(total[begins + length] - total[begins] >= MIN_GAIN, np.bool_)


def _explained(text: LearnedText, line: LineCode) -> float:
    """Return the share of the amounts that lie where an edge of the path is more likely than the background."""
    context = build_nodes(line, MEMORY, True).context[text.learned.path]
    by_edge = (text.learned.rates > 2 * text.learned.kernels.background)[context]
    return float((text.amounts * by_edge).sum(dtype=np.float64) / text.amounts.sum(dtype=np.float64))
