"""Check the answers to a notebook's exercises without ever stopping its run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np


def check_answer(answer: Any, test: Callable[[Any], Any], hint: str) -> None:
    """Print in one line whether an answer is right; never raise, so that the run goes on.

    Parameters
    ----------
    answer : object
        ``None`` or ``...`` if nobody has tried yet.
    test : callable
        Takes the answer. Returns whether it is right, or ``...`` if it was not attempted
        (useful when the answer is a function whose body is ``...``).
    hint : str
        What to think of next. It is printed when the answer is wrong.

    Examples
    --------
    >>> check_answer(..., lambda bps: bps == 571, "8 bits in 14 ms")
    not attempted yet
    >>> check_answer(8, lambda bps: bps == 571, "8 bits in 14 ms")
    not yet: 8 bits in 14 ms
    >>> check_answer(571, lambda bps: bps == 571, "8 bits in 14 ms")
    correct
    """
    if answer is None or answer is ...:
        print("not attempted yet")
        return
    try:
        verdict = test(answer)
        right = bool(np.all(verdict))
    except Exception as error:  # a wrong answer may be of any type, and must not stop the run
        print(f"not yet: {hint} (the check stopped with {type(error).__name__}: {error})")
        return
    print("not attempted yet" if verdict is ... else "correct" if right else f"not yet: {hint}")
