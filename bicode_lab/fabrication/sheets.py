"""The drawings of a marker (III-A, Fig. 4): what is engraved, cut and printed.

The LED sits in a pocket in the middle of the plate's left side. The pocket is cut through the plate, because the LED is
as thick as the plate. It stays inside the outer ring of cells and takes at most 0.6 of it. On a "black" plate, where
that ring belongs to the pattern, 0.6 of it is a tenth of the side, less than the 0.12 of the side that ArUco smooths
away when it fits a square. A dark notch of 0.7 of a cell hid the pattern of some plates, one of 0.6 of none (see the
tests and docs/design.md).

The paper names a reflection tape and a shading plate without saying where they are. Here the tape goes round the edges,
to keep the light in. The shading plate lies behind the plate, so that clear acrylic looks dark, and has a tongue that
hides the part of the LED that sticks out.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from bicode_lab.fabrication.drawing import BASELINE_TO_MIDDLE, Drawing, Layer, Point, Polyline, Text
from bicode_lab.marker import Board

# A 5 mm LED, as makers draw it (e.g. NTE30048: 5.0 across, flange 5.7, 8.7 long); measure yours.
LED_MM = 5.0
LED_LONG_MM = 8.7
FLANGE_MM = 5.8
FLANGE_THICK_MM = 1.0
CLEARANCE_MM = 0.1  # the pocket is wider than the LED by this; a laser's kerf adds to it
MIN_DEPTH_MM = 2.5  # the LED's round end
POCKET_SHARE_OF_CELL = 0.6
TONGUE_MM = (2.0, 12.0)  # of the shading plate: past the LED's end, and wide
PLATE_AT_MM = (32.0, 36.0)  # top left corner of the plate on its sheet
MAX_SIZE_M = 1.0

ENGRAVE, CUT_POCKET, CUT_OUTLINE = "1 engrave (glows)", "2 cut LED pocket", "3 cut plate outline"
CUT_SHADING, NOTES, PRINT = "4 cut shading plate", "5 notes (not for the machine)", "1 print"
BLACK, MAGENTA, RED, GREEN, GREY = "#000000", "#ff00ff", "#ff0000", "#008000", "#5f6b7a"
A4_MM = (210.0, 297.0)


def pocket_depth_mm(board: Board) -> float:
    """Return the depth of the LED's pocket in a plate.

    Parameters
    ----------
    board : Board

    Returns
    -------
    float
        Depth, measured from the edge of the plate [mm].

    Raises
    ------
    ValueError
        If the outer ring of cells is too narrow for an LED, or the plate is larger than 1 m.

    Examples
    --------
    >>> [round(pocket_depth_mm(Board(size_m=size)), 2) for size in (0.025, 0.05, 0.1)]
    [2.5, 5.0, 7.7]
    """
    if not board.size_m <= MAX_SIZE_M:
        raise ValueError(f"size_m={board.size_m} is larger than {MAX_SIZE_M:g} m; choose the plate's side in metres")
    n = len(board.cells())
    depth = min(POCKET_SHARE_OF_CELL * board.size_m * 1000 / n, LED_LONG_MM - FLANGE_THICK_MM)
    if depth < MIN_DEPTH_MM - 1e-9:
        least = {"black": n, "white": n}
        least["white" if board.glow == "black" else "black"] += 2 if board.glow == "black" else -2
        size_mm = {glow: MIN_DEPTH_MM / POCKET_SHARE_OF_CELL * count for glow, count in least.items()}
        raise ValueError(
            f"size_m={board.size_m:g} leaves {depth:.1f} mm for the LED pocket, which needs {MIN_DEPTH_MM} mm; "
            f"choose a size_m of {_up_to_mm(size_mm['black'])} or more with glow 'black', "
            f"{_up_to_mm(size_mm['white'])} or more with glow 'white'"
        )
    return depth


def draw_plate(board: Board, title: str) -> Drawing:
    """Draw the sheet for the laser: engraving, pocket, outline, shading plate and notes.

    Parameters
    ----------
    board : Board
    title : str

    Returns
    -------
    Drawing
        The plate seen from the front, its top left corner at `PLATE_AT_MM`.

    Raises
    ------
    ValueError
        See `pocket_depth_mm`.
    """
    depth, size = pocket_depth_mm(board), board.size_m * 1000
    x, y = PLATE_AT_MM
    middle, half = y + size / 2, (LED_MM + CLEARANCE_MM) / 2
    pocket = ((x, middle - half), (x + depth, middle - half), (x + depth, middle + half), (x, middle + half))
    cell = size / len(board.cells())
    tongue = LED_LONG_MM - depth + TONGUE_MM[0]
    shade_x = x + size + 16 + tongue
    cover_x = shade_x + size + 8
    wide = TONGUE_MM[1] / 2
    shading = (
        (shade_x, y), (shade_x + size, y), (shade_x + size, y + size), (shade_x, y + size),
        (shade_x, middle + wide), (shade_x - tongue, middle + wide), (shade_x - tongue, middle - wide),
        (shade_x, middle - wide),
    )  # fmt: skip
    cover = _box(cover_x, middle - wide, tongue, 2 * wide)
    marks, labels = _dimensions(board, depth, (x, y), (shade_x, cover_x, tongue))
    notes = [title, "Seen from the front, true size, all measures in mm. Cut the pocket first, the outline last."]
    below = [
        f"Engrave the black areas: they glow. This plate glows in its {board.glow} cells"
        + (" (frame included)." if board.glow == "black" else " and a margin of one cell."),
        f"Plate: clear acrylic, {board.thickness_m * 1000:g} mm thick. Pocket: cut through, for a {LED_MM:g} mm LED.",
        "Shading plate: black, any thickness, behind the plate; the small piece goes over the LED in front.",
        f"Cell {cell:.3f} mm. Pattern, frame to frame (for the pose): {board.pattern_size_m * 1000:.3f} mm.",
        "Check after printing or importing: the plate's side is " + f"{size:.2f} mm.",
    ]
    texts = [Text(at=(8.0, 9.0 + 5.0 * i), words=line, size_mm=3.6 - 0.6 * i) for i, line in enumerate(notes)]
    texts += [Text(at=(8.0, y + size + 20 + 4.6 * i), words=line) for i, line in enumerate(below)]
    texts += labels
    width = max(cover_x + tongue + 10, 8 + max(text.width_mm for text in texts) + 10)
    return Drawing(
        title=title,
        width_mm=math.ceil(width),
        height_mm=math.ceil(y + size + 20 + 4.6 * len(below) + 4),
        layers=(
            Layer(name=ENGRAVE, colour=BLACK, filled=True, paths=(_cells(board.cells(), (x, y), size),)),
            Layer(name=CUT_POCKET, colour=MAGENTA, paths=(Polyline(loops=(pocket,), closed=False),)),
            Layer(name=CUT_OUTLINE, colour=RED, paths=(Polyline(loops=(_box(x, y, size, size),)),)),
            Layer(name=CUT_SHADING, colour=GREEN, paths=(Polyline(loops=(shading,)), Polyline(loops=(cover,)))),
            Layer(name=NOTES, colour=GREY, paths=(*marks, *_led(x + depth, middle)), texts=tuple(texts)),
        ),
    )


def _dimensions(
    board: Board, depth: float, at: Point, places: tuple[float, float, float]
) -> tuple[list[Polyline], list[Text]]:
    """Return the dimension lines of plate and shading plate, and their labels."""
    (x, y), (shade_x, cover_x, tongue), size = at, places, board.size_m * 1000
    middle, half, wide = y + size / 2, (LED_MM + CLEARANCE_MM) / 2, TONGUE_MM[1] / 2
    cell = size / len(board.cells())
    far = y + size
    tongue_line, tongue_text = _across(shade_x - tongue, shade_x, middle + wide + 4, f"{tongue:.2f}", under=True)
    clear_x = shade_x - 0.8 - tongue_text.width_mm / 2  # of the shading plate's outline
    lines = [
        _across(x, x + size, y - 9, f"{size:.2f}"),
        _across(x, x + depth, y - 3, f"{depth:.2f}", beside=True),
        _across(x + size - cell, x + size, far + 4, f"{cell:.3f}", under=True),
        _upright(middle - half, middle + half, x - 16, f"{2 * half:.2f}"),
        _upright(y, far, x - 22, f"{size:.2f}"),
        _across(shade_x, shade_x + size, y - 9, f"{size:.2f}"),
        (tongue_line, replace(tongue_text, at=(min(tongue_text.at[0], clear_x), tongue_text.at[1]))),
        _upright(middle - wide, middle + wide, shade_x - tongue - 3, f"{2 * wide:.2f}"),
    ]
    labels = [
        Text(at=(x + size / 2, far + 13), words="plate", centred=True),
        Text(at=(shade_x + size / 2, middle), words="shading plate", centred=True),
        Text(at=(cover_x + tongue / 2, middle - wide - 2), words="LED cover", size_mm=2.5, centred=True),
        Text(at=(x - 14, middle + FLANGE_MM / 2 + 4), words="LED", size_mm=2.5),
    ]
    return [path for path, _ in lines], [*(text for _, text in lines), *labels]


def draw_paper(board: Board, title: str) -> Drawing:
    """Draw a sheet of paper for trials of the 2D part: white where the plate glows, black elsewhere.

    Around the pattern of a plate that glows in its black cells, a black border of one cell stands for the dark
    surroundings of the plate. The page is A4, or larger where the pattern needs it.

    Parameters
    ----------
    board : Board
    title : str

    Returns
    -------
    Drawing

    Raises
    ------
    ValueError
        If the plate is larger than 1 m.
    """
    if not 0 < board.size_m <= MAX_SIZE_M:
        raise ValueError(f"size_m={board.size_m} is not in 0 .. {MAX_SIZE_M:g} m; choose the plate's side in metres")
    size, cells = board.size_m * 1000, board.cells()
    dark = 1 - cells
    cell = size / len(cells)
    if board.glow == "black":
        dark = np.pad(dark, 1, constant_values=1)
    side = cell * len(dark)
    width, height = max(A4_MM[0], math.ceil(side + 40)), max(A4_MM[1], math.ceil(side + 110))
    x, y = (width - side) / 2, 45.0
    plate = _box((width - size) / 2, y + (side - size) / 2, size, size)
    rule_x, rule_y = (width - 100) / 2, y + side + 22
    rule = [((rule_x + 10 * i, rule_y - (3 if i % 5 else 5)), (rule_x + 10 * i, rule_y)) for i in range(11)]
    rule.append(((rule_x, rule_y), (rule_x + 100, rule_y)))
    ticks = [Polyline(loops=(line,), closed=False) for line in rule]
    mark, label = _across(plate[0][0], plate[1][0], y - 4, f"{size:.2f}")
    lines = [
        "Print at 100 % (not fitted to the page): the line above must be 100 mm long.",
        f"Pattern, frame to frame (for the pose): {board.pattern_size_m * 1000:.3f} mm.",
        "Light the paper in a dark room with a lamp that blinks, such as an LED torch on the transmitter's driver.",
        "White areas stand for the cells that glow: the event camera sees the plate's pattern.",
        "To a common camera this is an inverted ArUco marker: invert the picture, or allow inverted markers."
        if board.glow == "black"
        else "Tell the receiver: ReceiverSettings(glow='white'). A common camera finds it as it is.",
    ]
    texts = [
        Text(at=(20.0, 18.0), words=title, size_mm=4.2),
        Text(at=(20.0, 25.0), words=f"Paper for trying the 2D part; glows: {board.glow} cells.", size_mm=3.5),
        *(Text(at=(20.0, rule_y + 9 + 5.5 * i), words=line, size_mm=3.3) for i, line in enumerate(lines)),
        *(Text(at=(rule_x + 100 * i, rule_y + 3.5), words=f"{100 * i} mm", size_mm=2.5, centred=True) for i in (0, 1)),
        label,
    ]
    return Drawing(
        title=title,
        width_mm=width,
        height_mm=height,
        layers=(
            Layer(name=PRINT, colour=BLACK, filled=True, paths=(_cells(dark, (x, y), side),)),
            Layer(name="2 notes", colour=GREY, line_mm=0.2, paths=(mark, *ticks), texts=tuple(texts)),
        ),
    )


def outlines(cells: npt.NDArray[np.uint8]) -> list[list[tuple[int, int]]]:
    """Return the outlines of filled areas of cells.

    Cells that touch share one outline, so that neither the eye nor the laser sees a seam.

    Parameters
    ----------
    cells : ndarray of uint8, shape (n, n)
        1 where a cell is filled.

    Returns
    -------
    list of lists of (column, row)
        The corners of each loop.

    Examples
    --------
    >>> outlines(np.array([[1, 1], [0, 1]], np.uint8))
    [[(0, 0), (2, 0), (2, 2), (1, 2), (1, 1), (0, 1)]]
    """
    filled = np.pad(cells, 1)
    ahead: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for row, column in np.argwhere(filled).tolist():
        c, r = column - 1, row - 1
        corners = [(c, r), (c + 1, r), (c + 1, r + 1), (c, r + 1)]
        beyond = [(row - 1, column), (row, column + 1), (row + 1, column), (row, column - 1)]
        for k, neighbour in enumerate(beyond):
            if not filled[neighbour]:
                ahead.setdefault(corners[k], []).append(corners[(k + 1) % 4])
    loops = []
    while ahead:
        loop = [min(ahead, key=lambda corner: (corner[1], corner[0]))]
        while loop[-1] in ahead:
            following = ahead[loop[-1]].pop()
            if not ahead[loop[-1]]:
                del ahead[loop[-1]]
            loop.append(following)
        loop.pop()  # the last corner is the first one again
        kept = [b for a, b, c in zip(loop[-1:] + loop[:-1], loop, loop[1:] + loop[:1], strict=True)
                if (b[0] - a[0]) * (c[1] - b[1]) != (b[1] - a[1]) * (c[0] - b[0])]  # fmt: skip
        loops.append(kept)
    return loops


def _cells(cells: npt.NDArray[np.uint8], at: Point, size: float) -> Polyline:
    """Return the outlines of cells on the sheet."""
    cell = size / len(cells)
    loops = (tuple((at[0] + c * cell, at[1] + r * cell) for c, r in loop) for loop in outlines(cells))
    return Polyline(loops=tuple(loops))


def _box(x: float, y: float, width: float, height: float) -> tuple[Point, ...]:
    """Return the corners of a rectangle on the sheet."""
    return (x, y), (x + width, y), (x + width, y + height), (x, y + height)


def _led(tip_x: float, middle: float) -> list[Polyline]:
    """Return the outline of the LED, with its round end at `tip_x`."""
    radius, end = LED_MM / 2, tip_x - LED_LONG_MM
    angles = np.linspace(-np.pi / 2, np.pi / 2, 25)
    dome = [(tip_x - radius + radius * math.cos(a), middle + radius * math.sin(a)) for a in angles]
    body = ((end + FLANGE_THICK_MM, middle - radius), *dome, (end + FLANGE_THICK_MM, middle + radius))
    flange = _box(end, middle - FLANGE_MM / 2, FLANGE_THICK_MM, FLANGE_MM)
    leads = [Polyline(loops=(((end - 3, middle + d), (end, middle + d)),), closed=False) for d in (-1.27, 1.27)]
    return [Polyline(loops=(body,), closed=False), Polyline(loops=(flange,)), *leads]


def _across(
    x0: float, x1: float, y: float, words: str, under: bool = False, beside: bool = False
) -> tuple[Polyline, Text]:
    """Return a dimension from left to right: its line with end marks, and its label."""
    line = (((x0, y), (x1, y)), ((x0, y - 1), (x0, y + 1)), ((x1, y - 1), (x1, y + 1)))
    at = (x1 + 1.5, y + 2.5 * BASELINE_TO_MIDDLE) if beside else ((x0 + x1) / 2, y + 3.2 if under else y - 1.2)
    return Polyline(loops=line, closed=False), Text(at=at, words=words, size_mm=2.5, centred=not beside)


def _upright(y0: float, y1: float, x: float, words: str) -> tuple[Polyline, Text]:
    """Return a dimension from top to bottom: its line with end marks, and its label, which runs from bottom to top."""
    line = (((x, y0), (x, y1)), ((x - 1, y0), (x + 1, y0)), ((x - 1, y1), (x + 1, y1)))
    return Polyline(loops=line, closed=False), Text(
        at=(x - 1.2, (y0 + y1) / 2), words=words, size_mm=2.5, centred=True, upright=True
    )


def _up_to_mm(size_mm: float) -> str:
    """Return a size in metres, rounded up to a tenth of a millimetre, as text."""
    return f"{math.ceil(size_mm * 10 - 1e-6) / 10000:g}"
