"""Tests of the image of a plate: no light is lost, and an independent drawing gives the same picture."""

import numpy as np
import pytest
from scipy import ndimage

from bicode_lab.boxes import Box
from bicode_lab.camera import Optics, Pose
from bicode_lab.camera.plate_image import EDGE_LOBE, make_template, plate_box, read_template, still_fits
from bicode_lab.marker import Board

OPTICS = Optics(blur_px=1.2, halo_fraction=0.03, halo_px=8.0)
SAMPLES = 4  # points a fine pixel and direction when a plate is drawn


def area(polygon) -> float:
    """Return the area inside corners of shape (n, 2) by the shoelace formula [px^2]."""
    x, y = polygon.T
    return 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def visible_faces(board, pose, optics, edge_glow):
    """Return (polygon in the image, luminance) of every cell and side face that the camera sees."""
    h, thick, n = board.size_m / 2, board.thickness_m, board.cells().shape[0]
    lines = np.linspace(-h, h, n + 1)
    faces = []
    for row in range(n):
        for column in range(n):
            left, right, top, bottom = lines[column], lines[column + 1], -lines[row], -lines[row + 1]
            cell = np.array([[left, top, 0], [right, top, 0], [right, bottom, 0], [left, bottom, 0]])
            faces.append((cell, np.array([0, 0, 1.0]), float(board.cells()[row, column])))
    for normal in ([1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]):
        out = np.array(normal, float) * h
        along = np.array([normal[1], normal[0], 0], float) * h
        back = np.array([0, 0, -thick])
        faces.append((np.array([out - along, out + along, out + along + back, out - along + back]), out, edge_glow))
    seen = []
    for corners, normal, luminance in faces:
        placed = pose.apply(corners)
        if (pose.rotation @ normal) @ placed.mean(0) < 0:  # the outward normal points to the camera
            if normal[2] == 0:  # a side face shines about its normal
                towards = (
                    -(pose.rotation @ normal) @ placed.mean(0) / np.linalg.norm(normal) / np.linalg.norm(placed.mean(0))
                )
                luminance *= towards**EDGE_LOBE
            seen.append((optics.project(placed), luminance))
    return seen


def image_of(board, pose, optics=OPTICS, edge_glow=1.0):
    """Return glow and mask of a plate over all the pixels that it reaches."""
    box = plate_box(board, pose, optics)
    return read_template(make_template(board, pose, optics, edge_glow), pose, optics, box)


POSES = {
    "near": Pose.facing(0.6),
    "at 2.5 m": Pose.facing(2.5, x_m=0.013, y_m=-0.021),
    "far": Pose.facing(20, x_m=0.005),
    "off the axis": Pose.facing(1.2, x_m=0.35, y_m=0.1),
    "yaw 40": Pose.facing(1.0, yaw_deg=40),
    "yaw -65, roll 30": Pose.facing(1.0, yaw_deg=-65, roll_deg=30),
    "yaw 80": Pose.facing(2.5, yaw_deg=80),
    "roll 45": Pose.facing(2.5, roll_deg=45),
}


@pytest.mark.parametrize("halo", [0.0, 0.03, 0.3])
@pytest.mark.parametrize("glow", ["black", "white"])
@pytest.mark.parametrize("name", POSES)
def test_light_is_neither_lost_nor_made(name, glow, halo):
    board, pose = Board(glow=glow), POSES[name]
    optics = Optics(halo_fraction=halo)
    faces = visible_faces(board, pose, optics, edge_glow=0.7)
    found_glow, found_mask = image_of(board, pose, optics, edge_glow=0.7)
    polygons = np.concatenate([polygon for polygon, _ in faces])
    finer = np.clip(np.ceil(64 / np.ptp(polygons, axis=0).max()), 2, 8)
    # Every straight border is drawn within half a sample, so each is wrong by its length times
    # at most that, uniformly: 4 standard deviations of the sum over all borders. On top, what
    # lies beyond 4 sigma of the core (1.3e-4) and 3 sigma of the halo (0.54 % of its share).
    half = 0.5 / (SAMPLES * finer)
    borders = np.concatenate([np.linalg.norm(p - np.roll(p, 1, 0), axis=1) for p, _ in faces])
    drawing = 4 * half / np.sqrt(3) * np.sqrt((borders**2).sum())
    for found, expected in [
        (found_glow.sum(), sum(area(p) * luminance for p, luminance in faces)),
        (found_mask.sum(), sum(area(p) for p, _ in faces)),
    ]:
        assert abs(found - expected) <= drawing + (2e-4 + 0.0055 * halo) * expected + 1e-3


def test_a_steep_plate_shows_its_edge():
    # cos 80 deg + (5 mm / 50 mm) sin 80 deg = 0.272 of the face (physics: the reversed sentence of IV-B).
    facing, steep = (image_of(Board(), Pose.facing(5, yaw_deg=yaw))[1].sum() for yaw in (0, 80))
    expected = np.cos(np.deg2rad(80)) + 0.1 * np.sin(np.deg2rad(80))
    assert expected == pytest.approx(0.272, abs=5e-4)
    # At 80 deg the plate is 16.5 x 0.272 = 4.5 px wide, drawn with 4 x 4 samples a px: one of 72 may be off.
    assert steep / facing == pytest.approx(expected, rel=1 / 72)
    thin = image_of(Board(thickness_m=1e-6), Pose.facing(5, yaw_deg=80))[1].sum()
    assert thin / facing == pytest.approx(np.cos(np.deg2rad(80)), rel=1 / 46)


def test_the_back_of_a_plate_does_not_glow():
    # Turned past 90 deg only the edge is seen, 30 deg off its normal: sin 60 deg x 0.1 of the face's area.
    back = image_of(Board(), Pose.facing(1, yaw_deg=120))[0].sum()
    face = area(OPTICS.project(Pose.facing(1).apply(Board().plate_corners_m())))
    assert back / face == pytest.approx(
        0.1 * np.sin(np.deg2rad(60)) * np.cos(np.deg2rad(30)) ** EDGE_LOBE, rel=0.05
    )  # +-2.5 % nearer and farther, +-1 sample


def drawn_another_way(board, pose, optics, box, finer=15):
    """Draw a sharp image by ray casting at 15 x 15 points per pixel, blur it with scipy, and average each pixel."""
    pad = int(5 * optics.halo_px if optics.halo_fraction else 6 * optics.blur_px)
    x = (np.arange((box.w + 2 * pad) * finer) + 0.5) / finer - 0.5 + box.x - pad
    y = (np.arange((box.h + 2 * pad) * finer) + 0.5) / finer - 0.5 + box.y - pad
    rays = np.stack([*np.meshgrid(x, y), np.ones((y.size, x.size))], -1) @ np.linalg.inv(optics.matrix).T
    normal = pose.rotation[:, 2]
    depth = (normal @ pose.position_m) / (rays @ normal)
    on_plate = (rays * depth[..., None] - pose.position_m) @ pose.rotation  # in the marker's axes
    n = board.cells().shape[0]
    column = np.floor((on_plate[..., 0] / board.size_m + 0.5) * n).astype(int)
    row = np.floor((0.5 - on_plate[..., 1] / board.size_m) * n).astype(int)
    inside = (column >= 0) & (column < n) & (row >= 0) & (row < n)
    sharp = np.where(inside, board.cells()[np.clip(row, 0, n - 1), np.clip(column, 0, n - 1)], 0).astype(float)
    core = ndimage.gaussian_filter(sharp, optics.blur_px * finer, truncate=6)
    halo = ndimage.gaussian_filter(sharp, optics.halo_px * finer, truncate=5) if optics.halo_fraction else 0
    image = (1 - optics.halo_fraction) * core + optics.halo_fraction * halo
    means = image.reshape(y.size // finer, finer, x.size // finer, finer).mean((1, 3))
    return means[pad:-pad, pad:-pad]


@pytest.mark.parametrize(
    ("pose", "optics"),
    [
        (Pose.facing(5.0, x_m=0.003, roll_deg=20), Optics(halo_fraction=0.0)),
        (Pose.facing(5.0, yaw_deg=50, roll_deg=-10), Optics(halo_fraction=0.0, blur_px=1.5)),
        (Pose.facing(8.0, y_m=-0.01), Optics(halo_fraction=0.05, halo_px=4.0)),
    ],
    ids=["rolled", "yawed", "halo"],
)
def test_another_way_to_draw_gives_the_same_picture(pose, optics):
    board = Board(thickness_m=1e-9)  # the face alone
    box = plate_box(board, pose, optics)
    found = image_of(board, pose, optics)[0]
    # Half a sample, 0.5 / (4 x finer) <= 0.04 px here, times the steepest slope of an edge,
    # 1 / (sqrt(2 pi) 1.2 px): 0.013; the pixel's square taken for a Gaussian: 0.003; reading between
    # fine pixels: 0.003.
    assert np.abs(found - drawn_another_way(board, pose, optics, box)).max() <= 0.02


@pytest.mark.parametrize(
    ("drawn", "read"),
    [
        (Pose.facing(2.5), Pose.facing(2.5, x_m=0.0271, y_m=-0.0183)),
        (Pose.facing(2.5), Pose.facing(2.5, roll_deg=37)),
        (Pose.facing(2.5), Pose.facing(2.54, roll_deg=-140)),
        (Pose.facing(1.0, yaw_deg=40), Pose.facing(1.005, yaw_deg=40.5, x_m=0.002)),
        (Pose.facing(10.0), Pose.facing(10.1, x_m=1.0)),
    ],
    ids=["shifted", "rolled", "farther", "yawed", "far"],
)
def test_a_template_read_elsewhere_is_the_plate_drawn_there(drawn, read):
    board = Board(thickness_m=1e-6)
    template = make_template(board, drawn, OPTICS, 1.0)
    assert still_fits(template, board, read, OPTICS)
    box = plate_box(board, read, OPTICS)
    there = read_template(make_template(board, read, OPTICS, 1.0), read, OPTICS, box)
    moved = read_template(template, read, OPTICS, box)
    # A border is drawn within half a sample of 1/8 px (two fine pixels a px), twice: 0.125 px x slope 0.33
    # = 0.04; a blur wrong by the tolerated 2 %: 0.02 x 0.24 = 0.005; reading between fine pixels: 0.005.
    for a, b in zip(moved, there, strict=True):
        assert np.abs(a - b).max() <= 0.05
        assert a.sum() == pytest.approx(b.sum(), rel=0.01)


def test_a_template_does_not_serve_another_shape():
    template = make_template(Board(), Pose.facing(2.5), OPTICS, 1.0)
    for pose in (Pose.facing(2.6), Pose.facing(2.4), Pose.facing(2.5, yaw_deg=15), Pose.facing(2.5, yaw_deg=-15)):
        assert not still_fits(template, Board(), pose, OPTICS)


def test_a_shift_by_whole_pixels_only_shifts_the_picture():
    board, step_m = Board(thickness_m=1e-9), 5.0 / OPTICS.focal_px
    here, there = Pose.facing(5.0), Pose.facing(5.0, x_m=7 * step_m, y_m=-3 * step_m)
    box = plate_box(board, here, OPTICS)
    moved = Box(box.x + 7, box.y - 3, box.w, box.h)
    a = read_template(make_template(board, here, OPTICS, 1.0), here, OPTICS, box)[0]
    b = read_template(make_template(board, there, OPTICS, 1.0), there, OPTICS, moved)[0]
    # A sample that lies on a border may fall on either side of it: one row of 1/16 px, slope 0.33.
    assert np.abs(a - b).max() <= 0.33 / 16


@pytest.mark.parametrize(
    ("pose", "what"),
    [
        (Pose.facing(2.5), "inside"),
        (Pose.facing(2.5, x_m=-0.97), "partly"),
        (Pose.facing(2.5, y_m=0.56), "partly"),
        (Pose.facing(0.05), "partly"),
        (Pose.facing(2.5, x_m=1.5), "outside"),
        (Pose.facing(2.5, y_m=-3.0), "outside"),
        (Pose(position_m=np.array([0, 0, -2.5])), "outside"),
        (Pose(Pose.facing(1).rotation, np.array([0, 0, 0.0])), "outside"),
    ],
)
def test_the_box_stays_on_the_sensor(pose, what):
    box = plate_box(Board(), pose, OPTICS)
    assert box.is_empty == (what == "outside")
    if what == "outside":
        return
    assert 0 <= box.x < box.right <= 1280
    assert 0 <= box.y < box.bottom <= 720
    touches = box.x == 0 or box.y == 0 or box.right == 1280 or box.bottom == 720
    assert touches == (what == "partly")


@pytest.mark.parametrize("name", POSES)
def test_next_to_no_light_falls_outside_the_box(name):
    pose, board = POSES[name], Board()
    box = plate_box(board, pose, OPTICS)
    wide = Box(box.x - 30, box.y - 30, box.w + 60, box.h + 60)
    glow = read_template(make_template(board, pose, OPTICS, 1.0), pose, OPTICS, wide)[0]
    glow[30:-30, 30:-30] = 0
    # Beyond 3 sigma of the halo, beside a straight border, lies 0.13 % of its 3 %.
    assert glow.max() <= 0.03 * 0.00135 + 1e-6
