"""Tests of the sheets: measures read from the SVG, patterns found by ArUco as printed, the PDF at true size."""

from __future__ import annotations

import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from bicode_lab.fabrication import Drawing, draw_paper, draw_plate, pocket_depth_mm, to_pdf, to_svg
from bicode_lab.marker import Board

SVG = "{http://www.w3.org/2000/svg}"
INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
MM = 0.01  # what the sheets must hold

Loop = npt.NDArray[np.float64]
Image = npt.NDArray[np.uint8]

BOARDS = [
    Board(size_m=size_m, glow=glow, aruco_id=aruco_id, dictionary=dictionary)
    for size_m in (0.034, 0.05, 0.1)
    for glow in ("black", "white")
    for aruco_id, dictionary in ((7, "DICT_4X4_50"), (41, "DICT_4X4_50"))
] + [
    Board(size_m=0.025),
    Board(size_m=0.0637, glow="white", aruco_id=203, dictionary="DICT_6X6_250"),
    Board(size_m=0.3, aruco_id=3, dictionary="DICT_ARUCO_ORIGINAL"),
]
each_board = pytest.mark.parametrize(
    "board", BOARDS, ids=lambda b: f"{b.size_m * 1000:g}mm-{b.glow}-{b.dictionary}-{b.aruco_id}"
)


def layers_of(svg: str) -> dict[str, list[list[Loop]]]:
    """Return the paths of each named layer of an SVG, each a list of loops (n, 2) [mm]; check the units."""
    root = ET.fromstring(svg)
    x, y, width, height = map(float, root.attrib["viewBox"].split())
    assert (x, y) == (0, 0)
    assert (root.attrib["width"], root.attrib["height"]) == (f"{width:g}mm", f"{height:g}mm")  # 1 unit is 1 mm
    layers = {}
    for group in root.iter(f"{SVG}g"):
        assert group.attrib[f"{INKSCAPE}groupmode"] == "layer"
        layers[group.attrib[f"{INKSCAPE}label"]] = [loops_of(p.attrib["d"]) for p in group.iter(f"{SVG}path")]
    return layers


def loops_of(d: str) -> list[Loop]:
    """Return the loops of the text of a path of straight lines."""
    assert not re.sub(r"[MLZ0-9. -]", "", d), d
    return [np.array(re.findall(r"(\S+) (\S+)", part.replace("L", "").replace("Z", "")), float)
            for part in d.split("M")[1:]]  # fmt: skip


def cells_in(loops: list[Loop], n: int, corner: Loop, cell: float) -> Image:
    """Return which of n x n cells are inside (even-odd) at their middles."""
    middles = [(corner[0] + (c + 0.5) * cell, corner[1] + (r + 0.5) * cell) for r in range(n) for c in range(n)]
    inside = [sum(is_inside(loop, x, y) for loop in loops) % 2 for x, y in middles]
    return np.array(inside, np.uint8).reshape(n, n)


def is_inside(loop: Loop, x: float, y: float) -> bool:
    (x0, y0), (x1, y1) = loop.T, np.roll(loop, -1, axis=0).T
    crosses = (y0 > y) != (y1 > y)
    at = x0[crosses] + (y - y0[crosses]) / (y1 - y0)[crosses] * (x1 - x0)[crosses]
    return bool(np.count_nonzero(at > x) % 2)


@each_board
def test_measures_of_the_svg_are_the_plates(board: Board) -> None:
    layers = layers_of(to_svg(draw_plate(board, "a marker")))
    assert list(layers) == [
        "1 engrave (glows)", "2 cut LED pocket", "3 cut plate outline", "4 cut shading plate",
        "5 notes (not for the machine)",
    ]  # fmt: skip
    size, n = board.size_m * 1000, len(board.cells())
    ((outline,),) = layers["3 cut plate outline"]
    corner = outline.min(axis=0)
    np.testing.assert_allclose(np.ptp(outline, axis=0), [size, size], atol=MM)
    # Engraved: every corner on the plate's grid of cells, and inside just where the plate glows.
    (engraved,) = layers["1 engrave (glows)"]
    on_grid = (np.concatenate(engraved) - corner) / (size / n)
    np.testing.assert_allclose(on_grid * size / n, np.round(on_grid) * size / n, atol=MM)
    np.testing.assert_array_equal(cells_in(engraved, n, corner, size / n), board.cells())
    # The pocket: open to the left side, in its middle, for a 5 mm LED, inside the outer ring of cells.
    ((pocket,),) = layers["2 cut LED pocket"]
    assert pocket.shape == (4, 2)
    np.testing.assert_allclose(pocket[[0, 3], 0], corner[0], atol=MM)
    np.testing.assert_allclose(pocket[:, 1].mean(), corner[1] + size / 2, atol=MM)
    depth, width = np.ptp(pocket, axis=0)
    np.testing.assert_allclose([depth, width], [pocket_depth_mm(board), 5.1], atol=MM)
    assert 2.5 - MM <= depth <= 0.6 * size / n + MM
    # The shading plate hides the plate and all of the LED that sticks out.
    (shading,), (cover,) = layers["4 cut shading plate"]
    np.testing.assert_allclose(np.ptp(shading, axis=0), [size + 8.7 - depth + 2, size], atol=MM)
    np.testing.assert_allclose(np.ptp(cover, axis=0), [8.7 - depth + 2, 12], atol=MM)


@each_board
def test_everything_is_on_the_sheet_and_nothing_overlaps(board: Board) -> None:
    for drawing in (draw_plate(board, "a marker"), draw_paper(board, "a marker")):
        for layer in drawing.layers:
            for path in layer.paths:
                points = np.concatenate([np.array(loop) for loop in path.loops])
                assert points.min() > 0
                assert (points.max(axis=0) < (drawing.width_mm, drawing.height_mm)).all()
            for text in layer.texts:
                before = text.width_mm / 2 if text.centred and not text.upright else 0.0
                assert text.at[0] - before > 0
                assert text.upright or text.at[0] - before + text.width_mm < drawing.width_mm, text.words
    plate = layers_of(to_svg(draw_plate(board, "a marker")))
    right_of_plate = plate["3 cut plate outline"][0][0].max(axis=0)[0]
    assert plate["4 cut shading plate"][0][0].min(axis=0)[0] > right_of_plate


def test_paper_has_the_plates_size_and_is_dark_where_it_does_not_glow() -> None:
    for board in BOARDS:
        layers = layers_of(to_svg(draw_paper(board, "a marker")))
        (dark,) = layers["1 print"]
        points = np.concatenate(dark)
        n, cell = len(board.cells()), board.size_m * 1000 / len(board.cells())
        if board.glow == "black":
            np.testing.assert_allclose(np.ptp(points, axis=0), (n + 2) * cell, atol=MM)
            np.testing.assert_array_equal(cells_in(dark, n, points.min(axis=0) + cell, cell), 1 - board.cells())
        else:  # the margin is paper
            np.testing.assert_allclose(np.ptp(points, axis=0), board.pattern_size_m * 1000, atol=MM)
            np.testing.assert_array_equal(cells_in(dark, n, points.min(axis=0) - cell, cell), 1 - board.cells())


def rasterised(drawing: Drawing, dots_per_inch: float, layers: list[str]) -> Image:
    """Return the layers of a drawing as printed, black on white paper, shape (height, width)."""
    scale = dots_per_inch / 25.4
    found = layers_of(to_svg(drawing))
    paper = np.full((round(drawing.height_mm * scale), round(drawing.width_mm * scale)), 255, np.uint8)
    for name in layers:
        for loops in found[name]:
            # Pixel centres are at whole numbers, so paper's edge is at -0.5; OpenCV takes 1/256 pixels.
            dots = [np.round((loop * scale - 0.5) * 256).astype(np.int32) for loop in loops]
            cv2.fillPoly(paper, dots, 0, shift=8)
    return paper


def found_ids(picture: Image, dictionary: str) -> list[int]:
    """Return the ids of common (not inverted) markers that default ArUco finds in a picture."""
    used = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    _, ids, _ = cv2.aruco.ArucoDetector(used, cv2.aruco.DetectorParameters()).detectMarkers(picture)
    return [] if ids is None else np.ravel(ids).tolist()


@each_board
@pytest.mark.parametrize("dots_per_inch", [50, 75, 150, 300, 600])
def test_aruco_finds_the_paper_at_every_resolution(board: Board, dots_per_inch: int) -> None:
    if board.size_m > 0.2 and dots_per_inch > 300:
        pytest.skip("over 50 million dots")
    picture = rasterised(draw_paper(board, "a marker"), dots_per_inch, ["1 print"])
    if board.glow == "black":
        picture = 255 - picture
    assert found_ids(picture, board.dictionary) == [board.aruco_id]


@each_board
@pytest.mark.parametrize("pocket", ["dark", "bright"])
@pytest.mark.parametrize("dots_per_inch", [50, 75, 150, 300])
def test_aruco_finds_the_plate_in_spite_of_the_led_pocket(board: Board, pocket: str, dots_per_inch: int) -> None:
    """Check that what glows is engraved, whether the pocket shows the LED as bright as the rest or nothing at all."""
    drawing = draw_plate(board, "a marker")
    engraved = rasterised(drawing, dots_per_inch, ["1 engrave (glows)"]) == 0
    cut = rasterised(drawing, dots_per_inch, ["2 cut LED pocket"]) == 0
    glows = engraved | cut if pocket == "bright" else engraved & ~cut
    assert np.count_nonzero(cut) > 0
    picture = np.where(glows, 255, 0).astype(np.uint8)
    if board.glow == "black":
        picture = 255 - picture
    assert found_ids(picture, board.dictionary) == [board.aruco_id]


def test_pdf_page_is_as_large_as_the_drawing_and_has_its_layers() -> None:
    for board in BOARDS:
        for drawing in (draw_plate(board, "a (marker)"), draw_paper(board, "a (marker)")):
            pdf = to_pdf(drawing).decode("latin-1")
            (box,) = re.findall(r"/MediaBox \[0 0 (\S+) (\S+)\]", pdf)
            page_mm = np.array(box, float) / 72 * 25.4
            np.testing.assert_allclose(page_mm, [drawing.width_mm, drawing.height_mm], atol=MM)
            scale = float(re.search(r"(\S+) 0 0 -\S+ 0 \S+ cm", pdf).group(1))
            assert scale * 25.4 / 72 == pytest.approx(1, abs=1e-7)  # a user unit is a millimetre
            names = re.findall(r"/Type /OCG /Name \((.*)\) >>", pdf)
            assert [name.replace("\\", "") for name in names] == [layer.name for layer in drawing.layers]
            for number, place in enumerate(re.findall(r"(\d{10}) 00000 n", pdf), 1):
                assert pdf[int(place) :].startswith(f"{number} 0 obj")


def test_pdf_draws_the_points_of_the_svg() -> None:
    drawing = draw_plate(BOARDS[0], "a marker")
    pdf = to_pdf(drawing).decode("latin-1")
    loops = [loop for paths in layers_of(to_svg(drawing)).values() for path in paths for loop in path]
    drawn = re.findall(r"(\S+) (\S+) [ml]\b", pdf)
    np.testing.assert_array_equal(np.array(drawn, float), np.concatenate(loops))


@pytest.mark.skipif(shutil.which("pdftoppm") is None, reason="no pdftoppm (poppler-utils) here")
@pytest.mark.parametrize("board", BOARDS[4:8], ids=range(4))
def test_printed_pdf_measures_right_and_is_found(board: Board, tmp_path: Path) -> None:
    for draw in (draw_plate, draw_paper):
        (tmp_path / "sheet.pdf").write_bytes(to_pdf(draw(board, "a marker")))
        for dots_per_inch in (75, 300):
            done = subprocess.run(
                ["pdftoppm", "-gray", "-r", str(dots_per_inch), "-singlefile", "sheet.pdf", "sheet"],
                cwd=tmp_path, capture_output=True, text=True,
            )  # fmt: skip
            assert (done.returncode, done.stderr) == (0, "")
            picture = cv2.imread(str(tmp_path / "sheet.pgm"), cv2.IMREAD_GRAYSCALE)
            inverted = board.glow == ("white" if draw is draw_plate else "black")
            assert found_ids(255 - picture if inverted else picture, board.dictionary) == [board.aruco_id]
        if draw is draw_paper and board.glow == "white":
            rows, columns = np.nonzero(picture < 40)
            side_mm = (np.array([np.ptp(rows), np.ptp(columns)]) + 1) / 300 * 25.4
            np.testing.assert_allclose(side_mm, board.pattern_size_m * 1000, atol=25.4 / 300)


@pytest.mark.parametrize(
    ("board", "words"),
    [
        (Board(size_m=0.0249), "choose a size_m of 0.025 or more with glow 'black', 0.0334 or more with glow 'white'"),
        (Board(size_m=0.033, glow="white"), "0.025 or more with glow 'black', 0.0334 or more with glow 'white'"),
        (Board(size_m=0.03, dictionary="DICT_6X6_250"), "0.0334 or more with glow 'black'"),
        (Board(size_m=50), "in metres"),
    ],
)
def test_a_plate_that_cannot_be_built_is_refused_with_words(board: Board, words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        draw_plate(board, "a marker")


def test_the_same_board_gives_the_same_bytes() -> None:
    one, other = (draw_plate(Board(), "a marker") for _ in range(2))
    assert (to_pdf(one), to_svg(one)) == (to_pdf(other), to_svg(other))
