"""The image of a glowing plate: the share of the face's luminance on each pixel.

The sharp image is drawn finer than the pixels, blurred by the lens (a Gaussian core and a wide halo) and then read at
the pixels. While a marker moves without changing the shape of its image, its blurred image is drawn once and shifted
or turned.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box
from bicode_lab.camera.motion import Floats, Pose
from bicode_lab.camera.optics import Light, Optics, ambient_signal, led_signal, plate_homography
from bicode_lab.camera.pixel_steps import F4
from bicode_lab.kernels import njit
from bicode_lab.marker import Board, Marker

Image = npt.NDArray[np.float32]

SHAPE_TOLERANCE = 0.02  # a template is drawn anew when a side of the plate has changed by this share
EDGE_LOBE = 5  # side faces shine as cos^5 off their normal: half at 30 deg, as bullet LEDs do; assumption
HALO_REACH = 3.0  # the halo is drawn out to this many of its standard deviations


@dataclass(frozen=True)
class Template:
    """The blurred image of one plate, finer than the pixels, and the shape that it was drawn for.

    Parameters
    ----------
    glow, mask : ndarray of float32, shape (rows, columns)
        Share of the face's luminance, and share of the pixel that the plate covers.
    to_template : ndarray, shape (3, 3)
        Homography from the plate [m] to the template's pixels.
    shape_px : ndarray, shape (6,)
        Sides and diagonals of the plate's image when it was drawn [px].
    """

    glow: Image
    mask: Image
    to_template: Floats
    shape_px: Floats


class PlateImage:
    """The image of one marker, pose after pose.

    Parameters
    ----------
    marker, optics, light : Marker, Optics, Light
    edge_glow : float
        Luminance of a side face of the plate, seen along its normal, relative to the front face.

    Attributes
    ----------
    waveform : LedWaveform
    dark_signal, full_signal : float
        Signal of the plate with its LED off, and signal that the LED at full level adds to a whole cell.
    """

    def __init__(self, marker: Marker, optics: Optics, light: Light, edge_glow: float) -> None:
        self.marker = marker
        self.waveform = marker.waveform
        self._optics = optics
        self._edge_glow = edge_glow
        self.full_signal = led_signal(marker.luminance_ratio, marker.band, light, optics)
        self.dark_signal = ambient_signal(light, optics) * light.plate_reflectance
        self.sensor_width = optics.width
        self._template: Template | None = None

    def reach(self, poses: list[Pose]) -> Box:
        """Return the box of the pixels that the light reaches in the first or the last of some poses.

        The poses are in camera axes. The box is clipped to the sensor, and empty where the plate is not in view.
        """
        reached = Box(0, 0, 0, 0)
        for pose in poses[:: max(1, len(poses) - 1)] if len(poses) > 1 else poses:
            box = plate_box(self.marker.board, pose, self._optics)
            reached = box if reached.is_empty else reached if box.is_empty else reached.union(box)
        return reached

    def image(self, pose: Pose, box: Box) -> tuple[Image, Image]:
        """Draw the plate on the pixels of a box.

        Parameters
        ----------
        pose, box : Pose, Box
            The pose is in camera axes.

        Returns
        -------
        glow, mask : ndarray of float32, shape (box.h, box.w)
            Share of the face's luminance on each pixel, and share of the pixel that the plate covers.
        """
        if plate_box(self.marker.board, pose, self._optics).is_empty:
            nothing = np.zeros((box.h, box.w), np.float32)
            return nothing, nothing
        if self._template is None or not still_fits(self._template, self.marker.board, pose, self._optics):
            self._template = make_template(self.marker.board, pose, self._optics, self._edge_glow)
        return read_template(self._template, pose, self._optics, box)

    def cover(self, signal: F4, pose: Pose) -> None:
        """Put the plate with its LED off in front of the background.

        Parameters
        ----------
        signal : ndarray of float32, shape (height, width)
            Signal of the whole sensor; it is changed.
        pose : Pose
            In camera axes.
        """
        box = plate_box(self.marker.board, pose, self._optics)
        if box.is_empty:
            return
        mask = self.image(pose, box)[1]
        part = signal[box.y : box.bottom, box.x : box.right]
        part += mask * (self.dark_signal - part)


def side_faces(board: Board) -> list[Floats]:
    """Return the corners of the four side faces of a plate.

    Parameters
    ----------
    board : Board

    Returns
    -------
    list of ndarray, shape (4, 3)
        The two corners on the front face first, then those on the back [m].
    """
    front = board.plate_corners_m()
    back = front - [0, 0, board.thickness_m]
    return [np.stack([front[i], front[(i + 1) % 4], back[(i + 1) % 4], back[i]]) for i in range(4)]


def image_corners(board: Board, pose: Pose, optics: Optics) -> Floats:
    """Return the eight corners of a plate in the image.

    Parameters
    ----------
    board, pose, optics : Board, Pose, Optics
        The pose is in camera axes.

    Returns
    -------
    ndarray, shape (8, 2)
        Front face first [px]; nan behind the camera.
    """
    front = board.plate_corners_m()
    return optics.project(pose.apply(np.concatenate([front, front - [0, 0, board.thickness_m]])))


def reach_px(optics: Optics) -> float:
    """Return how far the light of a point spreads in the image [px]."""
    wide = HALO_REACH * optics.halo_px if optics.halo_fraction else 0.0
    return max(wide, 4 * optics.blur_px)


def plate_box(board: Board, pose: Pose, optics: Optics) -> Box:
    """Return the box of the pixels that the light of a plate reaches.

    Parameters
    ----------
    board, pose, optics : Board, Pose, Optics
        The pose is in camera axes.

    Returns
    -------
    Box
        Clipped to the sensor; empty where the plate is not in view.
    """
    corners = image_corners(board, pose, optics)
    if np.isnan(corners).any():
        return Box(0, 0, 0, 0)
    reach = reach_px(optics)
    low, high = np.floor(corners.min(0) - reach), np.ceil(corners.max(0) + reach) + 1
    far = 1 << 20
    x, y, right, bottom = (int(v) for v in np.clip([*low, *high], -far, far))
    return Box.between(x, y, right, bottom).clipped(optics.width, optics.height)


def make_template(board: Board, pose: Pose, optics: Optics, edge_glow: float) -> Template:
    """Draw the blurred image of a plate in a pose.

    Parameters
    ----------
    board, pose, optics : Board, Pose, Optics
        The pose is in camera axes.
    edge_glow : float
        Luminance of a side face, seen along its normal, relative to the front face. Side faces are what the camera sees
        at grazing angles (IV-B). Off their normal they are darker, see `EDGE_LOBE`.

    Returns
    -------
    Template
    """
    shape = shape_px(board, pose, optics)
    corners = image_corners(board, pose, optics)
    finer = int(np.clip(np.ceil(64 / max(np.ptp(corners[:, 0]), np.ptp(corners[:, 1]))), 2, 8))
    reach = reach_px(optics)
    x0, y0 = np.floor(corners.min(0) - reach)
    columns, rows = (np.ceil(np.ptp(corners, axis=0) + 2 * reach).astype(int) + 2) * finer
    # Sub-pixel i of a pixel's n lies (i + 0.5) / n - 0.5 beside its centre.
    to_fine = np.array([[finer, 0, (0.5 - x0) * finer - 0.5], [0, finer, (0.5 - y0) * finer - 0.5], [0, 0, 1.0]])
    glow = np.zeros((rows, columns), np.float32)
    mask = np.zeros((rows, columns), np.float32)
    samples = 4
    for number, (cells, corners_m) in enumerate(_faces(board, edge_glow)):
        placed = pose.apply(corners_m)
        normal = np.cross(placed[1] - placed[0], placed[3] - placed[0])
        if normal @ placed[0] <= 0:  # seen from behind
            continue
        if number:  # a side face
            to_it = placed.mean(0)
            cells = cells * (normal @ to_it / (np.linalg.norm(normal) * np.linalg.norm(to_it))) ** EDGE_LOBE
        quad = optics.project(placed) @ to_fine[:2, :2].T + to_fine[:2, 2]
        unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
        to_cells = np.asarray(cv2.getPerspectiveTransform(quad.astype(np.float32), unit), np.float64)
        low = np.clip(np.floor(quad.min(0)).astype(int) - 1, 0, None)
        high = np.clip(np.ceil(quad.max(0)).astype(int) + 2, 0, [columns, rows])
        _draw_face(glow, mask, cells.astype(np.float32), to_cells, low[0], low[1], high[0], high[1], samples)
    scale = to_fine @ plate_homography(pose, optics)
    return Template(_blur(glow, optics, finer), _blur(mask, optics, finer), scale, shape)


def _faces(board: Board, edge_glow: float) -> list[tuple[npt.NDArray[np.float64], Floats]]:
    """Return cells and corners of the front face and the side faces, corners clockwise as seen from outside."""
    faces: list[tuple[npt.NDArray[np.float64], Floats]] = [(board.cells().astype(float), board.plate_corners_m())]
    for corners in side_faces(board):
        faces.append((np.array([[edge_glow]]), corners[::-1]))
    return faces


def shape_px(board: Board, pose: Pose, optics: Optics) -> Floats:
    """Return the sides and diagonals of the image of a plate, shape (6,) [px].

    Parameters
    ----------
    board, pose, optics : Board, Pose, Optics
        The pose is in camera axes.
    """
    corners = optics.project(pose.apply(board.plate_corners_m()))
    pairs = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3)]
    return np.array([np.hypot(*(corners[a] - corners[b])) for a, b in pairs])


def still_fits(template: Template, board: Board, pose: Pose, optics: Optics) -> bool:
    """Return whether a template still has the shape of the plate in a pose.

    Parameters
    ----------
    template, board, pose, optics : Template, Board, Pose, Optics
        The pose is in camera axes.

    Returns
    -------
    bool
    """
    now = shape_px(board, pose, optics)
    return bool(np.all(np.abs(now - template.shape_px) <= SHAPE_TOLERANCE * template.shape_px + 0.02))


def read_template(template: Template, pose: Pose, optics: Optics, box: Box) -> tuple[Image, Image]:
    """Read a template at the pixels of a box.

    Parameters
    ----------
    template, pose, optics, box : Template, Pose, Optics, Box
        The pose is in camera axes.

    Returns
    -------
    glow, mask : ndarray of float32, shape (box.h, box.w)
        See `PlateImage.image`.
    """
    to_pixels = plate_homography(pose, optics) @ np.linalg.inv(template.to_template)
    to_pixels = np.array([[1, 0, -box.x], [0, 1, -box.y], [0, 0, 1.0]]) @ to_pixels
    glow, mask = (cv2.warpPerspective(drawn, to_pixels, (box.w, box.h)) for drawn in (template.glow, template.mask))
    return np.asarray(glow, np.float32), np.asarray(mask, np.float32)


def _blur(image: Image, optics: Optics, finer: int) -> Image:
    """Return the lens's image of a sharp fine image, averaged over the square of a pixel."""
    core = finer * np.sqrt(optics.blur_px**2 + 1 / 12)  # the pixel's square has this variance
    blurred = cv2.GaussianBlur(image, (0, 0), core, borderType=cv2.BORDER_CONSTANT)
    if optics.halo_fraction:
        halo = cv2.GaussianBlur(image, (0, 0), finer * optics.halo_px, borderType=cv2.BORDER_CONSTANT)
        blurred = (1 - optics.halo_fraction) * blurred + optics.halo_fraction * halo
    return np.asarray(blurred, np.float32)


@njit(cache=True)
def _draw_face(
    glow: Image, mask: Image, cells: Image, to_cells: Floats, x0: int, y0: int, x1: int, y1: int, samples: int
) -> None:
    """Add a face to the fine image at `samples`^2 points per fine pixel; `to_cells` maps to the unit square."""
    n_rows, n_columns = cells.shape
    weight = np.float32(1.0 / (samples * samples))
    for row in range(y0, y1):
        for column in range(x0, x1):
            lit = 0.0
            hit = 0
            for i in range(samples):
                y = row + (i + 0.5) / samples - 0.5
                for j in range(samples):
                    x = column + (j + 0.5) / samples - 0.5
                    w = to_cells[2, 0] * x + to_cells[2, 1] * y + to_cells[2, 2]
                    u = (to_cells[0, 0] * x + to_cells[0, 1] * y + to_cells[0, 2]) / w
                    v = (to_cells[1, 0] * x + to_cells[1, 1] * y + to_cells[1, 2]) / w
                    if 0.0 <= u < 1.0 and 0.0 <= v < 1.0:
                        hit += 1
                        lit += cells[int(v * n_rows), int(u * n_columns)]
            glow[row, column] += np.float32(lit) * weight
            mask[row, column] += np.float32(hit) * weight
