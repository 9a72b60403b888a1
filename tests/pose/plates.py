"""What the tests of poses share: a plain drawing of a plate, and random poses."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.marker import Board
from bicode_lab.pose.light_model import N_IMAGE, draw

Floats = npt.NDArray[np.float64]
CAMERA = np.array([1646.0, 320.0, 240.0])
THICKNESS = 0.6  # of the paper's plate [cells]


def pose(tilt_deg: float, axis_deg: float, roll_deg: float, depth: float, x: float = 10.0) -> tuple[Floats, Floats]:
    """Return rotation and place [cells] of a plate that is turned in its plane and then tilted about an image axis."""
    a, t, r = np.deg2rad([axis_deg, tilt_deg, roll_deg])
    tilt = cv2.Rodrigues(t * np.array([np.cos(a), np.sin(a), 0]))[0]
    roll = cv2.Rodrigues(np.array([0, 0, r]))[0]
    return np.asarray(tilt @ np.diag([1.0, -1, -1]) @ roll, float), np.array([x, -0.5 * x, depth])


def drawn(
    rotation: Floats, place: Floats, *, size: int = 60, blur: float = 0.9, edges: tuple[float, float] = (0.3, 0.6),
    aruco_id: int = 17, slopes: bool = True,
) -> tuple[Floats, int, int]:  # fmt: skip
    """Draw a plate in the middle of a box; return all planes and the first column and row."""
    x0, y0 = (int(v) - size // 2 for v in CAMERA[0] * place[:2] / place[2] + CAMERA[1:])
    image = np.empty((size, size, N_IMAGE))
    cells = Board(aruco_id=aruco_id).cells().astype(float)
    draw(rotation, place, CAMERA, x0, y0, 1, blur, cells, THICKNESS, np.array(edges), slopes, image)
    return image, x0, y0


def plainly_drawn(
    rotation: Floats, place: Floats, x0: int, y0: int, size: int, blur: float, edges: tuple[float, float], aruco_id: int
) -> Floats:
    """Draw a plate with its side faces by points, 8 x 8 on each pixel, and blur the picture: the oracle of `draw`."""
    finer = 8
    at = (np.arange(size * finer) + 0.5) / finer - 0.5
    x, y = np.meshgrid((x0 + at - CAMERA[1]) / CAMERA[0], (y0 + at - CAMERA[2]) / CAMERA[0])
    sight = np.stack([x, y, np.ones_like(x)], -1) @ rotation  # in plate axes
    eye = -rotation.T @ place
    cells = Board(aruco_id=aruco_id).cells().astype(float)
    half = cells.shape[0] / 2
    to_face = -eye[2] / sight[..., 2]
    u, v = eye[0] + to_face * sight[..., 0], eye[1] + to_face * sight[..., 1]
    on = (np.abs(u) < half) & (np.abs(v) < half)
    row, column = np.floor(half - v).astype(int), np.floor(u + half).astype(int)
    light = np.where(on, cells[np.clip(row, 0, 5), np.clip(column, 0, 5)], 0.0)
    for axis, other in ((0, 1), (1, 0)):
        for sign in (-1, 1):
            if sign * eye[axis] <= half:
                continue  # this side face is not seen
            to_side = (sign * half - eye[axis]) / sight[..., axis]
            across, depth = eye[other] + to_side * sight[..., other], eye[2] + to_side * sight[..., 2]
            light = np.where(~on & (np.abs(across) < half) & (depth < 0) & (depth > -THICKNESS), edges[axis], light)
    blurred = cv2.GaussianBlur(light, (0, 0), blur * finer, borderType=cv2.BORDER_CONSTANT)
    return (
        np.asarray(
            blurred[finer // 2 :: finer, finer // 2 :: finer]
            + blurred[finer // 2 - 1 :: finer, finer // 2 - 1 :: finer]
        )
        / 2
    )
