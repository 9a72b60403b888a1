"""A scene: the markers, lamps and wall that the camera sees, and the camera itself."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bicode_lab.camera.lamp import Lamp
from bicode_lab.camera.motion import Floats, Pose, Still, Trajectory
from bicode_lab.camera.optics import Light, Optics
from bicode_lab.camera.pixels import PixelModel
from bicode_lab.camera.readout import Readout
from bicode_lab.camera.wall import Wall
from bicode_lab.constants import constant
from bicode_lab.marker import Marker

STEP_PX = 0.25  # what moves is drawn again after this distance in the image


@dataclass(frozen=True, kw_only=True)
class PlacedMarker:
    """A marker and its trajectory in the world.

    Parameters
    ----------
    marker : Marker
    path : Trajectory
        Pose of the marker in world axes over time.
    """

    marker: Marker = field(default_factory=Marker)
    path: Trajectory = field(default_factory=lambda: Still(Pose.facing(2.5)))


@dataclass(frozen=True, kw_only=True)
class Scene:
    """Everything that determines a recording, except chance; the defaults are the paper's prototype at 2.5 m (IV-A).

    Parameters
    ----------
    markers : tuple of PlacedMarker
    camera : Trajectory
        Pose of the camera in world axes over time.
    optics, light, pixel_model, readout : Optics, Light, PixelModel, Readout
        Settings of the lens, the illumination, the pixels and the link to the computer.
    wall : Wall, optional
        A textured wall behind the markers. None is an even grey wall, which makes no events.
    edge_glow : float
        Luminance of a side face of a plate, seen along its normal, relative to the front face; see `constants.csv`.
    lamps : tuple of Lamp
        Light sources that are not markers. The ground truth does not list them.

    Raises
    ------
    ValueError
        If `edge_glow` is negative.
    """

    markers: tuple[PlacedMarker, ...] = (PlacedMarker(),)
    camera: Trajectory = field(default_factory=Still)
    optics: Optics = field(default_factory=Optics)
    light: Light = field(default_factory=Light)
    pixel_model: PixelModel = field(default_factory=PixelModel)
    readout: Readout = field(default_factory=Readout)
    wall: Wall | None = None
    edge_glow: float = constant("edge_glow")
    lamps: tuple[Lamp, ...] = ()

    def __post_init__(self) -> None:
        if not self.edge_glow >= 0:
            raise ValueError(f"edge_glow={self.edge_glow} is negative; choose 0 or more")

    @property
    def paths(self) -> tuple[Trajectory, ...]:
        """Trajectories of everything that emits light: first the markers, then the lamps."""
        return tuple(placed.path for placed in self.markers) + tuple(lamp.path for lamp in self.lamps)

    @property
    def is_still(self) -> bool:
        """True where neither the camera nor a marker or lamp moves."""
        return self.camera.is_still and all(path.is_still for path in self.paths)

    def marker_pose(self, number: int, t_s: float) -> Pose:
        """Return the pose of a marker or lamp in camera axes.

        Parameters
        ----------
        number : int
            Index into `paths`: the markers come first, the lamps after the last marker.
        t_s : float
            Time since the start of the scene [s].

        Returns
        -------
        Pose
        """
        return self.paths[number].pose_at(t_s).after(self.camera.pose_at(t_s).inverse())

    def wall_view(self, t_s: float) -> Floats:
        """Return the homography from pixels to points of the wall at a time.

        Parameters
        ----------
        t_s : float
            Time since the start of the scene [s].

        Returns
        -------
        ndarray, shape (3, 3)
        """
        assert self.wall is not None
        return self.wall.from_pixels(self.camera.pose_at(t_s), self.optics)

    def motion_steps(self, start_us: int, end_us: int) -> Floats:
        """Return the borders of a span and, where something moves, a moment for every `STEP_PX` of motion.

        Parameters
        ----------
        start_us, end_us : int
            The span [us].

        Returns
        -------
        ndarray, shape (steps + 1,)
            Rising, from `start_us` to `end_us` [us].
        """
        ends = np.array([start_us, end_us], float)
        if self.is_still:
            return ends
        samples = np.linspace(start_us, end_us, 11)
        travelled = self._travelled_px(samples)
        steps = int(np.ceil(travelled[-1] / STEP_PX))
        if steps <= 1:
            return ends
        rising = travelled + np.arange(samples.size) * 1e-9  # np.interp needs strictly rising values
        cuts = np.interp(np.linspace(0, rising[-1], steps + 1), rising, samples)
        cuts[0], cuts[-1] = start_us, end_us
        return np.asarray(cuts)

    def speed_px_per_s(self) -> float:
        """Return the speed of the fastest point of the image at time 0 [px/s]."""
        return float(self._travelled_px(np.array([0.0, 1e3]))[-1] * 1e3)

    def _travelled_px(self, times_us: Floats) -> Floats:
        """Return how far the fastest point of the image has come since the first of some times [px]."""
        places = np.stack([self._landmarks(t * 1e-6) for t in times_us])
        way = np.linalg.norm(np.diff(places, axis=0), axis=2)
        return np.concatenate([[0.0], np.cumsum(np.nan_to_num(way).max(1))])

    def _landmarks(self, t_s: float) -> Floats:
        """Return the fastest image points [px]: corners of plates and lamps and, before a wall, of the sensor."""
        optics = self.optics
        corners = [placed.marker.board.plate_corners_m() for placed in self.markers]
        corners += [lamp.corners_m() for lamp in self.lamps]
        points = [optics.project(self.marker_pose(i, t_s).apply(c)) for i, c in enumerate(corners)]
        if self.wall is not None and not self.camera.is_still:
            view = self.wall_view(t_s)
            u = np.array([[x, y, 1.0] for x in (0, optics.width - 1) for y in (0, optics.height - 1)]) @ view.T
            texel_px = optics.focal_px * self.wall.texel_m / self.wall.distance_m
            points.append(u[:, :2] / u[:, 2:] * texel_px)
        return np.concatenate([np.zeros((1, 2)), *points])
