"""Turn pixels that look like a blinker into boxes (Fig. 2, box f): opening, connected components, merging.

The functions go through lists of kept pixels, of which there are few, and never through a whole frame.
"""

from __future__ import annotations

import numpy as np

from bicode_lab.kernels import njit

MAX_REACH_OF_WORDS = 4  # a row of up to this many pixels to both sides lies in two words of eight pixels


@njit(cache=True, nogil=True)
def open_squares(kept, votes, width, height, side):  # type: ignore[no-untyped-def]
    """Drop the kept pixels that lie in no full square of kept pixels (morphological opening).

    Parameters
    ----------
    kept : ndarray of int32, shape (n,)
        Numbers of the kept pixels, y width + x. Afterwards those that stay come first.
    votes : ndarray of uint8, shape (height * width,)
        Votes of each pixel, above 0 where it is kept. Those of dropped pixels become 0.
    width, height : int
        Sensor size [px].
    side : int
        Side of the square [px].

    Returns
    -------
    int
        Number of pixels that stay.
    """
    stays = np.zeros(kept.size, np.bool_)
    for i in range(kept.size):
        y, x = kept[i] // width, kept[i] % width
        for y0 in range(max(y - side + 1, 0), min(y, height - side) + 1):
            for x0 in range(max(x - side + 1, 0), min(x, width - side) + 1):
                full = True
                for ny in range(y0, y0 + side):
                    for nx in range(x0, x0 + side):
                        full &= votes[ny * width + nx] > 0
                if full:
                    stays[i] = True
    n_kept = 0
    for i in range(kept.size):
        if stays[i]:
            kept[n_kept] = kept[i]
            n_kept += 1
        else:
            votes[kept[i]] = 0
    return n_kept


@njit(cache=True, nogil=True)
def components(kept, votes, eights, width, height, reach, stack):  # type: ignore[no-untyped-def]
    """Group the kept pixels that are no more than `reach` apart (connected components).

    Parameters
    ----------
    kept : ndarray of int32, shape (n,)
        Numbers of the kept pixels, y width + x.
    votes : ndarray of uint8, shape (height * width,)
        Votes of each pixel, above 0 where it is kept. All become 0: they mark the pixels that are in no group yet.
    eights : ndarray of uint64
        The memory of `votes` with eight pixels per word. Most words soon are 0, so that looking at the two ends of a
        row is enough.
    width, height : int
        Sensor size [px].
    reach : int
        Largest distance between neighbours in a group, in x and in y [px].
    stack : ndarray of int32, shape (height * width,)
        Working memory.

    Returns
    -------
    ndarray of int64, shape (m, 6)
        For each group the first and the last column and row as x0, y0, x1, y1 [px], the number of pixels and the sum
        of their votes.
    """
    boxes = np.empty((kept.size, 6), np.int64)
    n_boxes = 0
    for i in range(kept.size):
        if votes[kept[i]] == 0:
            continue
        x0, y0, x1, y1, n_pixels, n_votes = width, height, 0, 0, 0, np.int64(votes[kept[i]])
        stack[0] = kept[i]
        votes[kept[i]] = 0
        n_stack = 1
        while n_stack:
            n_stack -= 1
            y, x = stack[n_stack] // width, stack[n_stack] % width
            n_pixels += 1
            x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x), max(y1, y)
            for ny in range(max(y - reach, 0), min(y + reach + 1, height)):
                left, right = ny * width + max(x - reach, 0), ny * width + min(x + reach, width - 1)
                if reach <= MAX_REACH_OF_WORDS and eights[left >> 3] | eights[right >> 3] == 0:
                    continue
                for neighbour in range(left, right + 1):
                    if votes[neighbour]:
                        n_votes += votes[neighbour]
                        votes[neighbour] = 0
                        stack[n_stack] = neighbour
                        n_stack += 1
        boxes[n_boxes] = (x0, y0, x1, y1, n_pixels, n_votes)
        n_boxes += 1
    return boxes[:n_boxes]


@njit(cache=True, nogil=True)
def merge_overlapping(boxes):  # type: ignore[no-untyped-def]
    """Merge groups whose boxes overlap until none do.

    Parameters
    ----------
    boxes : ndarray of int64, shape (n, 6)
        As `components` returns them.

    Returns
    -------
    ndarray of int64, shape (m, 6)
        The same for the merged groups.
    """
    merged = boxes.copy()
    i, n = 0, merged.shape[0]
    while i < n:
        grown = False
        j = i + 1
        while j < n:
            a, b = merged[i], merged[j]
            if a[0] <= b[2] and b[0] <= a[2] and a[1] <= b[3] and b[1] <= a[3]:
                a[0], a[1] = min(a[0], b[0]), min(a[1], b[1])
                a[2], a[3] = max(a[2], b[2]), max(a[3], b[3])
                a[4:] += b[4:]
                n -= 1
                merged[j] = merged[n]
                grown = True
            else:
                j += 1
        i = 0 if grown else i + 1
    return merged[:n]
