"""II-B: why a bit is two chips.   bits <-> chips

An event camera sees the LED switch, not the LED. Manchester coding makes every bit
switch in its middle: a 1 goes up and a 0 goes down (IEEE 802.3), or the other way
round (G. E. Thomas). The paper does not say which; the receiver can find out.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

Convention = Literal["ieee", "thomas"]


def manchester_encode(bits: npt.ArrayLike, convention: Convention = "ieee") -> npt.NDArray[np.uint8]:
    """Bits in, shape (n,), 0 or 1; chips out, shape (2 n,), 0 LED off, 1 LED on.

    Examples
    --------
    >>> manchester_encode([1, 0, 0])
    array([0, 1, 1, 0, 1, 0], dtype=uint8)
    >>> manchester_encode([1, 0, 0], "thomas")
    array([1, 0, 0, 1, 0, 1], dtype=uint8)
    """
    second = np.asarray(bits, np.uint8)
    if second.size and second.max() > 1:
        raise ValueError(f"bit {second.max()} is neither 0 nor 1")
    if convention == "thomas":
        second = 1 - second
    return np.stack([1 - second, second], axis=-1).ravel().astype(np.uint8)


def manchester_decode(
    chips: npt.ArrayLike, convention: Convention = "ieee"
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.bool_]]:
    """Chips in, shape (2 n,); bits out, shape (n,), and which of them are valid, shape (n,).

    A bit whose two chips are equal did not switch: it is invalid, and its value means nothing.

    Examples
    --------
    >>> manchester_decode([0, 1, 1, 0, 1, 1])
    (array([1, 0, 1], dtype=uint8), array([ True,  True, False]))
    """
    pairs = np.asarray(chips, np.uint8)
    if pairs.size % 2:
        raise ValueError(f"{pairs.size} chips do not make whole bits; a bit is two chips, so give an even number")
    pairs = pairs.reshape(-1, 2)
    bits = pairs[:, 1] if convention == "ieee" else pairs[:, 0]
    return bits.copy(), pairs[:, 0] != pairs[:, 1]
