"""The synthetic event camera: it turns a scene into a stream of events, chunk by chunk."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext

import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box, overlapping_groups
from bicode_lab.camera.lamp import LampImage
from bicode_lab.camera.optics import ambient_signal
from bicode_lab.camera.patch import Patch
from bicode_lab.camera.pixel_steps import U4
from bicode_lab.camera.pixels import PixelState, fire_lit_pixels, sort_by_time, start_pixels
from bicode_lab.camera.plate_image import PlateImage
from bicode_lab.camera.readout import ReadoutQueue
from bicode_lab.camera.scene import Scene
from bicode_lab.camera.wall import Wall
from bicode_lab.camera.wall_pixels import fire_wall_pixels, look_up
from bicode_lab.events import EVENT_DTYPE, Events, join, words

CHUNK_US = 10_000
STEP_PX = 0.25  # what moves is drawn again after this distance in the image
STEPS_PER_SPAN = 20  # images held in memory at once; it also keeps paths short enough for the extremes of a wall
BUFFER_EVENTS = 1 << 20
MEMORY_TIME_CONSTANTS = 10.0  # after so many time constants the level of a pixel no longer depends on its past

Watch = Callable[[str], AbstractContextManager[object]]
"""Called with the name of a part of the work (see `PARTS`); the part runs inside the context that it returns."""

PARTS = ("start", "draw", "choose", "edges", "pixels", "background", "sort", "readout")
"""Parts of the work of a `Recorder`: set the initial pixel state (once), draw the plates, choose the pixels that can
fire, find the edges of the LEDs, run the pixels, add background events, sort by time, read out."""


class Recorder:
    """A camera that records a scene; iterate over it for chunks of events.

    Parameters
    ----------
    scene : Scene
    duration_s : float
        Length of the recording [s], above 0 and at most 1e6. The clock of the recording starts at 0.
    rng : numpy.random.Generator
        Source of all chance: thresholds, noise, background events.
    watch : callable, optional
        Measures parts of the work: each part in `PARTS` runs inside ``with watch(part):``. No two parts overlap.
    on_unsorted : callable, optional
        Called once per chunk with the events of the chunk before they are sorted by time: codes, ndarray of uint32,
        shape (n,), ``2 * (y * width + x) + p``, and moments, ndarray of int32, shape (n,), microseconds since the
        chunk began. Both are copies.

    Attributes
    ----------
    queue : ReadoutQueue
        The readout, with its counts of delayed and lost events so far.

    Raises
    ------
    ValueError
        If `duration_s` is out of range.
    """

    def __init__(
        self,
        scene: Scene,
        duration_s: float,
        rng: np.random.Generator,
        *,
        watch: Watch | None = None,
        on_unsorted: Callable[[U4, npt.NDArray[np.int32]], None] | None = None,
    ) -> None:
        if not 0 < duration_s <= 1e6:
            raise ValueError(f"duration_s={duration_s} is not in 0 .. 1e6 s")
        self.scene = scene
        self.duration_us = round(duration_s * 1e6)
        self.queue = ReadoutQueue(scene.readout)
        self._watch: Watch = watch or (lambda part: nullcontext())
        self._on_unsorted = on_unsorted
        self._rng = rng
        self._seed = np.uint64(rng.integers(2**63))
        self._images: list[PlateImage | LampImage] = [
            PlateImage(placed.marker, scene.optics, scene.light, scene.edge_glow) for placed in scene.markers
        ]
        self._images += [LampImage(lamp, scene.optics, scene.light) for lamp in scene.lamps]
        with self._watch("start"):
            self._state = self._settled_pixels()
        self._skipped = np.zeros(self._state.level.size, bool)
        self._before = (np.empty((0, 3, 3)), np.empty(0), np.empty(0, np.int64))
        self._hot = self._pick_hot_pixels()
        self._boxes: list[Box] = []
        self._patches: list[Patch] | None = None
        self._pixels = np.empty(BUFFER_EVENTS, np.uint32)
        self._times = np.empty(BUFFER_EVENTS)
        self._count = 0
        self._is_used = False

    def __iter__(self) -> Iterator[Events]:
        """Record the scene.

        Yields
        ------
        ndarray of EVENT_DTYPE
            The events of `CHUNK_US` of the scene, sorted by time. Events that have fired and are still delayed when
            the recording ends are left out.

        Raises
        ------
        ValueError
            If the recorder has recorded before: its pixels are no longer in their initial state.
        """
        if self._is_used:
            raise ValueError("this Recorder has recorded already; make another one for another recording")
        self._is_used = True
        for start in range(0, self.duration_us, CHUNK_US):
            end = min(start + CHUNK_US, self.duration_us)
            cuts = self._motion_steps(start, end)
            for first in range(0, cuts.size - 1, STEPS_PER_SPAN):
                self._expose(cuts[first : first + STEPS_PER_SPAN + 1])
            with self._watch("background"):
                self._add_background(start, end)
            if self._on_unsorted is not None:
                is_ready = self._times[: self._count] < end
                moments = self._times[: self._count][is_ready].astype(np.int64) - start
                self._on_unsorted(self._pixels[: self._count][is_ready], moments.astype(np.int32))
            with self._watch("sort"):
                events = self._take_until(start, end)
            with self._watch("readout"):
                events = self.queue.pass_on(events, in_place=True)
            yield events

    def _settled_pixels(self) -> PixelState:
        """Return the initial pixel state: every pixel is adapted to the scene at t = 0 with the LEDs off."""
        optics = self.scene.optics
        log = np.full((optics.height, optics.width), self._log_ambient(), np.float32)
        if self.scene.wall is not None:
            log += self.scene.wall.log_reflectance(self._wall_view(0.0), Box(0, 0, optics.width, optics.height))
        signal = np.exp(log)
        for number, image in enumerate(self._images):
            image.cover(signal, self.scene.marker_pose(number, 0.0))
        return start_pixels(signal.ravel(), self.scene.pixel_model, self._rng)

    def _log_ambient(self) -> float:
        """Return the log signal of a wall of mean reflectance."""
        light = self.scene.light
        return float(np.log(ambient_signal(light, self.scene.optics) * light.reflectance))

    def _wall_view(self, t_s: float) -> npt.NDArray[np.float64]:
        """Return the homography from pixels to points of the wall at a time, shape (3, 3)."""
        assert self.scene.wall is not None
        return self.scene.wall.from_pixels(self.scene.camera.pose_at(t_s), self.scene.optics)

    def _motion_steps(self, start: int, end: int) -> npt.NDArray[np.float64]:
        """Return the borders of a span and, where something moves, a moment for every `STEP_PX` of motion [us]."""
        if self.scene.is_still:
            return np.array([start, end], float)
        samples = np.linspace(start, end, 11)
        places = np.stack([self._landmarks(t * 1e-6) for t in samples])
        way = np.linalg.norm(np.diff(places, axis=0), axis=2)
        travelled = np.concatenate([[0.0], np.cumsum(np.nan_to_num(way).max(1))])
        steps = int(np.ceil(travelled[-1] / STEP_PX))
        if steps <= 1:
            return np.array([start, end], float)
        rising = travelled + np.arange(samples.size) * 1e-9  # np.interp needs strictly rising values
        cuts = np.interp(np.linspace(0, rising[-1], steps + 1), rising, samples)
        cuts[0], cuts[-1] = start, end
        return np.asarray(cuts)

    def _landmarks(self, t_s: float) -> npt.NDArray[np.float64]:
        """Return the fastest image points [px]: corners of plates and lamps and, before a wall, of the sensor."""
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
        """Run every pixel that can fire through a span of time that is cut where something has moved [us]."""
        if self._patches is None or not self.scene.is_still:
            with self._watch("draw"):
                self._patches = self._draw(cuts)
        for patch in self._patches:
            with self._watch("choose"):
                self._update_skipped_pixels(patch)
                chosen = patch.choose(self._state, self.scene.pixel_model)
            with self._watch("edges"):
                schedule = patch.schedule(cuts)
            with self._watch("pixels"):
                self._run(fire_lit_pixels, chosen.index.size, (chosen.index, chosen.ambient, chosen.glow, *schedule))
        if self.scene.wall is not None and not self.scene.camera.is_still:
            with self._watch("pixels"):
                self._expose_wall(self.scene.wall, cuts, self._patches)

    def _update_skipped_pixels(self, patch: Patch) -> None:
        """Bring skipped background pixels up to date before a plate lights them."""
        wall, index = self.scene.wall, patch.index[self._skipped[patch.index]]
        if wall is not None and index.size:
            x, y = (part.astype(float) for part in (index % self.scene.optics.width, index // self.scene.optics.width))
            self._state.level[index] = look_up(wall.repeated, self._before[0][-1], self._log_ambient(), x, y)

    def _expose_wall(self, wall: Wall, cuts: npt.NDArray[np.float64], patches: list[Patch]) -> None:
        """Run the pixels that no marker or lamp lights through a span of time."""
        optics = self.scene.optics
        taken = np.zeros(self._state.level.size, bool)
        for patch in patches:
            taken[patch.index] = True
        views = np.stack([self._wall_view(t * 1e-6) for t in (cuts[:-1] + cuts[1:]) / 2])
        moments = np.round(cuts[:-1] * 16).astype(np.int64)
        seen = (optics.width, taken, self._skipped, wall.repeated, *wall.extremes(views, optics), self._log_ambient(),
                self._before, views, cuts, moments)  # fmt: skip
        self._run(fire_wall_pixels, taken.size, seen)
        tau_us = self.scene.pixel_model.time_constant_us / np.exp(self._log_ambient())
        k = max(int(np.searchsorted(cuts, cuts[-1] - MEMORY_TIME_CONSTANTS * tau_us, side="right")) - 1, 0)
        self._before = (views[k:], cuts[k:], moments[k:])

    def _draw(self, cuts: npt.NDArray[np.float64]) -> list[Patch]:
        """Draw the markers and lamps at every step of a span, those that share pixels in one patch."""
        middles = (cuts[:-1] + cuts[1:]) * 0.5e-6
        poses = [[self.scene.marker_pose(i, t) for t in middles] for i in range(len(self._images))]
        boxes = [image.reach(p) for image, p in zip(self._images, poses, strict=True)]
        held, self._boxes = self._boxes or boxes, boxes
        # A pixel that a plate has just left is still settling, so the box of the last span is included.
        wide = [b if h.is_empty else h if b.is_empty else b.union(h) for b, h in zip(boxes, held, strict=True)]
        wall = self.scene.wall
        views = [self._wall_view(t) for t in middles] if wall is not None else []
        return [
            Patch.draw(box, [self._images[i] for i in m], [poses[i] for i in m], self._log_ambient(), wall, views)
            for box, m in overlapping_groups(wide)
        ]

    def _run(self, kernel: object, todo: int, arrays: tuple[object, ...]) -> None:
        """Call a kernel until all its pixels are done, with a larger buffer for events whenever it asks."""
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
            self._double_buffer()

    def _double_buffer(self) -> None:
        """Double the number of events that the buffer holds."""
        self._pixels = np.concatenate([self._pixels, np.empty_like(self._pixels)])
        self._times = np.concatenate([self._times, np.empty_like(self._times)])

    def _pick_hot_pixels(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
        """Draw the hot pixels, which fire without a cause: their places and rates [Hz]."""
        model = self.scene.pixel_model
        places = self._rng.integers(self._state.level.size, size=model.hot_pixels)
        fastest = max(model.hot_pixel_hz, 1e-9)
        return places, fastest * 10 ** (-2 * self._rng.random(model.hot_pixels))

    def _add_background(self, start: int, end: int) -> None:
        """Add background activity and the events of hot pixels for one chunk."""
        model, size = self.scene.pixel_model, self._state.level.size
        seconds = (end - start) * 1e-6
        everywhere = self._rng.integers(size, size=self._rng.poisson(model.background_hz * size * seconds))
        hot = np.repeat(self._hot[0], self._rng.poisson(self._hot[1] * seconds))
        where = np.concatenate([everywhere, hot])
        polarity = self._rng.random(where.size) >= model.background_off_share
        needed = self._count + where.size
        while needed > self._pixels.size:
            self._double_buffer()
        self._pixels[self._count : needed] = 2 * where + polarity
        self._times[self._count : needed] = start + self._rng.random(where.size) * (end - start)
        self._count = needed

    def _take_until(self, start: int, end: int) -> Events:
        """Take the events before `end` out of the buffer and sort them; later ones, delayed by latency, stay."""
        events = np.empty(self._count, EVENT_DTYPE)
        early = sort_by_time(
            self._pixels, self._times, self._count, start, end, self.scene.optics.width, words(events)
        )  # fmt: skip
        self._count -= early
        return events[:early]


def record(scene: Scene, duration_s: float, rng: np.random.Generator | int) -> Events:
    """Record a scene and return all its events in one array.

    Parameters
    ----------
    scene : Scene
    duration_s : float
        Length of the recording [s].
    rng : numpy.random.Generator or int
        Source of all chance, or a seed.

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (n,)
        Sorted by time; times count from 0 [us].

    Examples
    --------
    >>> events = record(Scene(), duration_s=0.1, rng=0)
    >>> int(events["t"].max()) // 10_000  # it ends a tenth of a second after its start
    9
    """
    generator = np.random.default_rng(rng)
    return join(Recorder(scene, duration_s, generator))
