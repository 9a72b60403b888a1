"""A scene: the markers, lamps and wall that the camera sees, and the camera itself."""

from __future__ import annotations

from dataclasses import dataclass, field

from bicode_lab.camera.lamp import Lamp
from bicode_lab.camera.motion import Pose, Still, Trajectory
from bicode_lab.camera.optics import Light, Optics
from bicode_lab.camera.pixels import PixelModel
from bicode_lab.camera.readout import Readout
from bicode_lab.camera.wall import Wall
from bicode_lab.constants import constant
from bicode_lab.marker import Marker


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
