"""What the counts of a region say, and when it is believed.

A reading is believed only if it explains the events better than everything else that was tried. All gains and margins
are differences of log-likelihoods [nat], divided by the dispersion of the counts:

    gain      over events that come at any time and over bursts of clutter: with guessed levels, which have learned
              nothing from the path, or with learned ones, each of which costs `judge.LEVEL_COST`
    rival     over a lamp of any rate and over bursts of clutter, with learned levels on both sides
    place     over frames that begin at another chip
    margin    over the next value that passes the check
    conflict  what one polarity alone would gain by another value: ON edges alone say all, and so do OFF edges, so that
              wrong levels show when the two disagree
    misfit    dispersion along the path over the variance from frame to frame, of the polarity that is explained worse;
              1 if the levels explain all but chance; it does not count if the paper's rule, which learns no levels,
              reads the same value
    start     share of a usual edge's events that keep the clock in the quiet start; a marker has none

`MIN_GAIN` is the logarithm of what may be tried by chance, 28 chips x 8 phases x 2048 data words, which is 13, and of a
thousand regions more. `MIN_MARGIN` is odds of 3,000 to 1. A value whose bits are all alike, or alternate, looks like a
lamp that misses some pulses; it is believed after `MORE_FRAMES` frames only.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bicode_lab.recognition.decode import Reason
from bicode_lab.sequential.fold import Clock, Floats
from bicode_lab.sequential.levels import Contexts

MIN_GAIN = 20.0
MIN_MARGIN = 8.0
MAX_START = 0.35
MAX_MISFIT = 4.0  # the levels may miss the counts by no more than twice the standard deviation of chance
FEW_FRAMES_MISFIT = 2.0  # and by less where few frames were seen, so that neither of the two is known well
MORE_FRAMES = 6.0  # a lamp whose rate is wrong by 0.1 % or more is out of step after so many


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading:
    """The most likely value of the frames of a region; the top of this file explains the numbers.

    Parameters
    ----------
    value : int or None
        Most likely value; None if nothing can be read.
    check : bool
        Whether the check of the code holds.
    begin : float
        A moment at which a frame begins [nominal chips].
    clock : Clock or None
        Clock of the transmitter.
    gain, guessed_gain, rival, place, margin, conflict : float
        [nat]; `guessed_gain` is the gain with guessed levels alone.
    start, misfit : float
        Ratios, 0 or more.
    dispersion : ndarray, shape (2,)
        Of ON and OFF, 1 or more.
    contexts : ndarray of int32, shape (frame_chips,), or None
        Contexts of the chips of the value's frame, from chip `paths.FIRST` on.
    levels : ndarray or None
        Levels that were learned.
    n_frames : float
        Time that was weighed [frames].
    is_periodic : bool
        Whether the data of the value are periodic, as the light of a lamp is.
    is_seconded : bool
        Whether the paper's rule reads the same value.
    """

    value: int | None
    check: bool = False
    begin: float = 0.0
    clock: Clock | None = None
    gain: float = 0.0
    guessed_gain: float = 0.0
    rival: float = 0.0
    place: float = 0.0
    margin: float = 0.0
    conflict: float = 0.0
    start: float = 0.0
    misfit: float = 1.0
    dispersion: Floats = field(default_factory=lambda: np.ones(2))
    contexts: Contexts | None = None
    levels: Floats | None = None
    n_frames: float = 0.0
    is_periodic: bool = False
    is_seconded: bool = False

    @property
    def is_structured(self) -> bool:
        """Whether the light sends frames of the code, be they read or not."""
        return (
            self.value is not None
            and self.gain >= MIN_GAIN
            and min(self.rival, self.place) >= MIN_MARGIN
            and self.start <= MAX_START
        )

    @property
    def is_beyond_chance(self) -> bool:
        """Whether gain, rival and margin are twice what is asked: one of many periods is believed by itself then."""
        return self.gain >= 2 * MIN_GAIN and min(self.rival, self.margin) >= 2 * MIN_MARGIN

    @property
    def is_misfit(self) -> bool:
        """Whether the levels miss the counts by more than is allowed."""
        return self.misfit > (FEW_FRAMES_MISFIT if self.n_frames < MORE_FRAMES else MAX_MISFIT)

    @property
    def doubt(self) -> Reason | None:
        """Why the reading is not believed, one of `decode.REASONS`; None if it is believed.

        Examples
        --------
        >>> Reading(value=None).doubt, Reading(value=37).doubt
        ('no_events', 'no_start')
        >>> Reading(value=37, check=True, gain=90, rival=90, place=50, margin=40).doubt
        >>> Reading(value=37, check=True, gain=90, rival=90, place=50, margin=40, misfit=5).doubt
        'manchester'
        >>> Reading(value=37, check=True, gain=90, rival=90, place=50, margin=40, misfit=5).doubt
        'manchester'
        """
        if self.value is None:
            return "no_events"
        if not self.is_structured:
            return "no_start"
        if not self.check:
            return "checksum"
        if self.is_periodic and self.n_frames < MORE_FRAMES:
            return "manchester"
        if self.is_misfit and not self.is_seconded:
            return "manchester"
        if self.margin < MIN_MARGIN or self.conflict > MIN_MARGIN:
            return "manchester"
        return None


NOTHING = Reading(value=None)


@dataclass(frozen=True, kw_only=True)
class FrameReading:
    """One frame that was read for itself.

    Parameters
    ----------
    value : int
        Most likely value.
    check : bool
        Whether the check of the code holds.
    is_whole : bool
        Whether all its chips were seen.
    is_periodic : bool
        Whether its data are periodic; a single frame of that kind is not believed.
    begin : float
        [nominal chips]
    gain, margin, conflict : float
        [nat]
    """

    value: int
    check: bool
    is_whole: bool
    is_periodic: bool
    begin: float
    gain: float
    margin: float
    conflict: float

    @property
    def is_sure(self) -> bool:
        """Whether the frame is believed, if the light as a whole is."""
        return (
            self.check
            and self.is_whole
            and not self.is_periodic
            and self.gain >= MIN_GAIN
            and self.margin >= MIN_MARGIN
            and self.conflict <= MIN_MARGIN
        )


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """How well a reading explains counts of another time, or of a part of the time.

    Parameters
    ----------
    presence : float
        Gain of its value over events that come at any time [nat].
    contradiction : float
        By how much another value explains a single frame better [nat], the largest of all frames.
    """

    presence: float
    contradiction: float
