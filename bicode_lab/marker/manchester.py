"""Manchester coding (II-B): each bit is sent as two chips, and the LED switches in the middle of each bit.

An event camera sees changes of the light and not the light itself, so a run of equal bits would make no events. With
Manchester coding a 1 switches the LED on and a 0 switches it off (IEEE 802.3), or the other way round (G. E. Thomas).
The paper does not say which convention it uses; the receiver can find out.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

Convention = Literal["ieee", "thomas"]


def manchester_encode(bits: npt.ArrayLike, convention: Convention = "ieee") -> npt.NDArray[np.uint8]:
    """Encode bits as chips.

    Parameters
    ----------
    bits : array_like, shape (n,)
        0 or 1.
    convention : {"ieee", "thomas"}
        Whether a 1 is sent as off, on ("ieee") or as on, off ("thomas").

    Returns
    -------
    ndarray of uint8, shape (2 * n,)
        LED state of each chip: 0 off, 1 on.

    Raises
    ------
    ValueError
        If a bit is neither 0 nor 1.

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
    """Decode chips to bits.

    Parameters
    ----------
    chips : array_like, shape (2 * n,)
        LED state of each chip: 0 off, 1 on.
    convention : {"ieee", "thomas"}
        See `manchester_encode`.

    Returns
    -------
    bits : ndarray of uint8, shape (n,)
    valid : ndarray of bool, shape (n,)
        False for a bit whose two chips are equal: the LED did not switch, and the value of the bit means nothing.

    Raises
    ------
    ValueError
        If the number of chips is odd.

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
