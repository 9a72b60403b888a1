"""A scene in front of the camera -> a time-ordered stream of events, chunk by chunk."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from bicode_lab.camera.lamp import Lamp, LampImage
from bicode_lab.camera.motion import Path, Pose, Still
from bicode_lab.camera.optics import Light, Optics, ambient_signal
from bicode_lab.camera.patch import Patch, PlateImage
from bicode_lab.camera.pixels import PixelModel, PixelState, fire_lit_pixels, sort_by_time, start_pixels
from bicode_lab.camera.plate_image import Box
from bicode_lab.camera.readout import Readout, ReadoutQueue
from bicode_lab.camera.wall import Wall
from bicode_lab.camera.wall_pixels import fire_wall_pixels, look_up
from bicode_lab.constants import constant
from bicode_lab.events import EVENT_DTYPE, Events, join, words
from bicode_lab.marker import Marker

CHUNK_US = 10_000
STEP_PX = 0.25  # what moves is drawn again after this way
STEPS_A_SPAN = 20  # memory, and a way short enough for the tiles of a wall: so many drawings are held at once
ROOM = 1 << 20
FORGET = 10.0  # time constants after which a pixel's level no longer tells of its past


@dataclass(frozen=True, kw_only=True)
class PlacedMarker:
    """A marker on its path through the world."""

    marker: Marker = field(default_factory=Marker)
    path: Path = field(default_factory=lambda: Still(Pose.facing(2.5)))


@dataclass(frozen=True, kw_only=True)
class Scene:
    """All there is to see, and what sees it. The defaults: the paper's prototype at 2.5 m in its office.

    Parameters
    ----------
    markers : tuple of PlacedMarker
    camera : Path
        Where the camera is in the world.
    optics, light, pixel_model, readout
        Settings of the light path and the sensor.
    wall : Wall or None
        A texture behind the markers; None is an even grey that makes no events.
    edge_glow : float
        Luminance of a plate's side faces, seen straight on, over its face's; see `constants.csv`.
    lamps : tuple of Lamp
        Lights that are no markers; they are none of the truth.
    """

    markers: tuple[PlacedMarker, ...] = (PlacedMarker(),)
    camera: Path = field(default_factory=Still)
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
    def _paths(self) -> tuple[Path, ...]:
        """Where all that lights is: markers, then lamps."""
        return tuple(thing.path for thing in self.markers) + tuple(lamp.path for lamp in self.lamps)

    @property
    def is_still(self) -> bool:
        """True where neither the camera nor a marker or lamp moves."""
        return self.camera.is_still and all(path.is_still for path in self._paths)

    def marker_pose(self, number: int, t_s: float) -> Pose:
        """A marker's number (lamps are counted on from the last marker) and a time in; its pose in camera axes out."""
        return self._paths[number].pose_at(t_s).after(self.camera.pose_at(t_s).inverse())


class Recorder:
    """The camera at work on a scene: iterate over it for chunks of events.

    Parameters
    ----------
    scene : Scene
    duration_s : float
        Length of the recording; its clock starts at 0.
    rng : numpy Generator
        All chance: thresholds, noise, background events.

    Attributes
    ----------
    queue : ReadoutQueue
        Its counts of delay and loss so far.
    """

    def __init__(self, scene: Scene, duration_s: float, rng: np.random.Generator) -> None:
        if not 0 < duration_s <= 1e6:
            raise ValueError(f"duration_s={duration_s} is not in 0 .. 1e6 s")
        self.scene = scene
        self.duration_us = round(duration_s * 1e6)
        self.queue = ReadoutQueue(scene.readout)
        self._rng = rng
        self._seed = np.uint64(rng.integers(2**63))
        self._plates: list[PlateImage | LampImage] = [PlateImage(placed.marker, scene) for placed in scene.markers]
        self._plates += [LampImage(lamp, scene) for lamp in scene.lamps]
        self._state = self._settled_pixels()
        self._asleep = np.zeros(self._state.level.size, bool)
        self._before = (np.empty((0, 3, 3)), np.empty(0), np.empty(0, np.int64))
        self._hot = self._pick_hot_pixels()
        self._boxes: list[Box] = []
        self._patches: list[Patch] | None = None
        self._pixels = np.empty(ROOM, np.uint32)
        self._times = np.empty(ROOM)
        self._count = 0
        self._is_used = False

    def __iter__(self) -> Iterator[Events]:
        """Chunks of events, sorted, each of `CHUNK_US` of the scene; what is still on its way at the end is left out.

        Raises
        ------
        ValueError
            The second time: its pixels are no longer at rest.
        """
        if self._is_used:
            raise ValueError("this Recorder has recorded already; make another one for another recording")
        self._is_used = True
        for start in range(0, self.duration_us, CHUNK_US):
            end = min(start + CHUNK_US, self.duration_us)
            cuts = self._motion_steps(start, end)
            for first in range(0, cuts.size - 1, STEPS_A_SPAN):
                self._expose(cuts[first : first + STEPS_A_SPAN + 1])
            self._add_background(start, end)
            yield self.queue.pass_on(self._take_until(start, end), in_place=True)

    def _settled_pixels(self) -> PixelState:
        """All pixels at rest on the scene as it is at the start, LEDs off."""
        optics = self.scene.optics
        log = np.full((optics.height, optics.width), self._log_ambient(), np.float32)
        if self.scene.wall is not None:
            log += self.scene.wall.log_reflectance(self._wall_view(0.0), 0, 0, optics.width, optics.height)
        signal = np.exp(log)
        for number, plate in enumerate(self._plates):
            plate.cover(signal, self.scene.marker_pose(number, 0.0))
        return start_pixels(signal.ravel(), self.scene.pixel_model, self._rng)

    def _log_ambient(self) -> float:
        """Log signal of the wall's mean."""
        light = self.scene.light
        return float(np.log(ambient_signal(light, self.scene.optics) * light.reflectance))

    def _wall_view(self, t_s: float) -> npt.NDArray[np.float64]:
        """The homography from pixels to the wall at a time."""
        assert self.scene.wall is not None
        return self.scene.wall.from_pixels(self.scene.camera.pose_at(t_s), self.scene.optics)

    def _motion_steps(self, start: int, end: int) -> npt.NDArray[np.float64]:
        """A span in; its borders and, where something moves, a moment for every quarter pixel of way, out [us]."""
        if self.scene.is_still:
            return np.array([start, end], float)
        samples = np.linspace(start, end, 11)
        places = np.stack([self._landmarks(t * 1e-6) for t in samples])
        way = np.linalg.norm(np.diff(places, axis=0), axis=2)
        travelled = np.concatenate([[0.0], np.cumsum(np.nan_to_num(way).max(1))])
        steps = int(np.ceil(travelled[-1] / STEP_PX))
        if steps <= 1:
            return np.array([start, end], float)
        rising = travelled + np.arange(samples.size) * 1e-9  # interp wants no level stretch
        cuts = np.interp(np.linspace(0, rising[-1], steps + 1), rising, samples)
        cuts[0], cuts[-1] = start, end
        return np.asarray(cuts)

    def _landmarks(self, t_s: float) -> npt.NDArray[np.float64]:
        """Image points whose way is the fastest: corners of plates and lamps and, before a wall, the image's own."""
        optics = self.scene.optics
        corners = [placed.marker.board.plate_corners_m() for placed in self.scene.markers]
        corners += [lamp.corners_m() for lamp in self.scene.lamps]
        points = [optics.project(self.scene.marker_pose(i, t_s).apply(c)) for i, c in enumerate(corners)]
        if self.scene.wall is not None and not self.scene.camera.is_still:
            view = self._wall_view(t_s)
            u = np.array([[x, y, 1.0] for x in (0, optics.width - 1) for y in (0, optics.height - 1)]) @ view.T
            texel_px = optics.focal_px * self.scene.wall.texel_m / self.scene.wall.distance_m
            points.append(u[:, :2] / u[:, 2:] * texel_px)
        return np.concatenate([np.zeros((1, 2)), *points])

    def _expose(self, cuts: npt.NDArray[np.float64]) -> None:
        """Run every pixel that can fire through a span of time, cut where something has moved."""
        if self._patches is None or not self.scene.is_still:
            self._patches = self._draw(cuts)
        for patch in self._patches:
            self._settle(patch)
            chosen = patch.awake(self._state, self.scene.pixel_model)
            lit = (chosen.index, chosen.ambient, chosen.glow, *patch.schedule(cuts))
            self._run(fire_lit_pixels, chosen.index.size, lit)
        if self.scene.wall is not None and not self.scene.camera.is_still:
            self._expose_wall(self.scene.wall, cuts, self._patches)

    def _settle(self, patch: Patch) -> None:
        """Pixels that were asleep before the wall are to be lit: they get the level they have."""
        wall, index = self.scene.wall, patch.index[self._asleep[patch.index]]
        if wall is not None and index.size:
            x, y = (part.astype(float) for part in (index % self.scene.optics.width, index // self.scene.optics.width))
            self._state.level[index] = look_up(wall.repeated, self._before[0][-1], self._log_ambient(), x, y)

    def _expose_wall(self, wall: Wall, cuts: npt.NDArray[np.float64], patches: list[Patch]) -> None:
        """Run the pixels that nothing lights through the span."""
        optics = self.scene.optics
        taken = np.zeros(self._state.level.size, bool)
        for patch in patches:
            taken[patch.index] = True
        views = np.stack([self._wall_view(t * 1e-6) for t in (cuts[:-1] + cuts[1:]) / 2])
        moments = np.round(cuts[:-1] * 16).astype(np.int64)
        seen = (optics.width, taken, self._asleep, wall.repeated, *wall.extremes(views, optics), self._log_ambient(),
                self._before, views, cuts, moments)  # fmt: skip
        self._run(fire_wall_pixels, taken.size, seen)
        tau_us = self.scene.pixel_model.time_constant_us / np.exp(self._log_ambient())
        k = max(int(np.searchsorted(cuts, cuts[-1] - FORGET * tau_us, side="right")) - 1, 0)
        self._before = (views[k:], cuts[k:], moments[k:])

    def _draw(self, cuts: npt.NDArray[np.float64]) -> list[Patch]:
        """The plates' images at every step of a span, those that share pixels together."""
        middles = (cuts[:-1] + cuts[1:]) * 0.5e-6
        poses = [[self.scene.marker_pose(i, t) for t in middles] for i in range(len(self._plates))]
        boxes = [plate.reach(p) for plate, p in zip(self._plates, poses, strict=True)]
        held, self._boxes = self._boxes or boxes, boxes
        # A pixel that a plate has just left is still settling, so the last span's box comes along.
        wide = [b if h.is_empty else h if b.is_empty else b.joined(h) for b, h in zip(boxes, held, strict=True)]
        groups: list[tuple[Box, list[int]]] = []
        for i, box in enumerate(wide):
            if box.is_empty:
                continue
            members = [i]
            while touching := [g for g in groups if g[0].overlaps(box)]:
                for group in touching:
                    box, members = box.joined(group[0]), group[1] + members
                    groups.remove(group)
            groups.append((box, sorted(members)))
        wall = self.scene.wall
        views = [self._wall_view(t) for t in middles] if wall is not None else []
        return [
            Patch.draw(box, [self._plates[i] for i in m], [poses[i] for i in m], self._log_ambient(), wall, views)
            for box, m in groups
        ]

    def _run(self, kernel: object, todo: int, arrays: tuple[object, ...]) -> None:
        """Call a kernel until all its pixels are done, with more room for events whenever it asks."""
        model, state = self.scene.pixel_model, self._state
        settings = (self._seed, model.noise, model.time_constant_us, model.refractory_us,
                    model.latency_on_us, model.latency_off_us)  # fmt: skip
        memory = (state.level, state.reference, state.free_us, state.threshold_on, state.threshold_off)
        done = 0
        while True:
            done, self._count = kernel(  # type: ignore[operator]
                done, *arrays, *memory, *settings, self._pixels, self._times, self._count
            )
            if done >= todo:
                return
            self._pixels = np.concatenate([self._pixels, np.empty_like(self._pixels)])
            self._times = np.concatenate([self._times, np.empty_like(self._times)])

    def _pick_hot_pixels(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
        """Places and rates of the pixels that fire by themselves."""
        model = self.scene.pixel_model
        places = self._rng.integers(self._state.level.size, size=model.hot_pixels)
        fastest = max(model.hot_pixel_hz, 1e-9)
        return places, fastest * 10 ** (-2 * self._rng.random(model.hot_pixels))

    def _add_background(self, start: int, end: int) -> None:
        """Events that nothing in the scene made, for one chunk."""
        model, size = self.scene.pixel_model, self._state.level.size
        seconds = (end - start) * 1e-6
        everywhere = self._rng.integers(size, size=self._rng.poisson(model.background_hz * size * seconds))
        hot = np.repeat(self._hot[0], self._rng.poisson(self._hot[1] * seconds))
        where = np.concatenate([everywhere, hot])
        polarity = self._rng.random(where.size) >= model.background_off_share
        needed = self._count + where.size
        while needed > self._pixels.size:
            self._pixels = np.concatenate([self._pixels, np.empty_like(self._pixels)])
            self._times = np.concatenate([self._times, np.empty_like(self._times)])
        self._pixels[self._count : needed] = 2 * where + polarity
        self._times[self._count : needed] = start + self._rng.random(where.size) * (end - start)
        self._count = needed

    def _take_until(self, start: int, end: int) -> Events:
        """The events before `end`, sorted; later ones stay, they were delayed by their latency."""
        events = np.empty(self._count, EVENT_DTYPE)
        early = sort_by_time(
            self._pixels, self._times, self._count, start, end, self.scene.optics.width, words(events)
        )  # fmt: skip
        self._count -= early
        return events[:early]


def record(scene: Scene, duration_s: float, rng: np.random.Generator | int) -> Events:
    """A scene, a length and a seed in; all its events out, in one array, times from 0 [us].

    Examples
    --------
    >>> events = record(Scene(), duration_s=0.1, rng=0)
    >>> int(events["t"].max()) // 10_000  # it ends a tenth of a second after its start
    9
    """
    generator = np.random.default_rng(rng)
    return join(Recorder(scene, duration_s, generator))
