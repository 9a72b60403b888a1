"""The synthetic event camera: it turns a scene into a stream of events, chunk by chunk."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box, overlapping_groups
from bicode_lab.camera.lamp import LampImage
from bicode_lab.camera.optics import ambient_signal
from bicode_lab.camera.patch import Patch
from bicode_lab.camera.pixel_steps import U4, noise_cells
from bicode_lab.camera.pixels import PixelState, fire_lit_pixels, start_pixels
from bicode_lab.camera.plate_image import PlateImage
from bicode_lab.camera.readout import EventBuffer, ReadoutQueue
from bicode_lab.camera.scene import Scene
from bicode_lab.camera.strays import Strays, copy_references, spread_references
from bicode_lab.camera.wall import Wall
from bicode_lab.camera.wall_pixels import fire_wall_pixels, look_up
from bicode_lab.events import Events, join

CHUNK_US = 10_000
STEPS_PER_SPAN = 20  # images held in memory at once; it also keeps paths short enough for the extremes of a wall
BUFFER_EVENTS = 1 << 20
FORGET_PACKETS = 8  # after so many packets a pixel that always fires has forgotten how it started
MOVING_SETTLE_US = 100_000
SPARSE_PIXELS = 14_400  # about so many pixels, spread over the image, are run for long before a moving wall ...
WALL_SETTLE_PX = 800.0  # ... so long a way
MEMORY_TIME_CONSTANTS = 10.0  # after so many time constants the level of a pixel no longer depends on its past

Steps = Callable[[int, int], npt.NDArray[np.float64]]
"""Moments at which what moves is drawn again in a span of time [us]; see `Scene.motion_steps`."""

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
    settle_s : float
        How long the sensor has seen the scene when the recording starts, 0 or more [s].
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
        If `duration_s` or `settle_s` is out of range.
    """

    def __init__(
        self,
        scene: Scene,
        duration_s: float,
        rng: np.random.Generator,
        *,
        settle_s: float = 0.0,
        watch: Watch | None = None,
        on_unsorted: Callable[[U4, npt.NDArray[np.int32]], None] | None = None,
    ) -> None:
        if not 0 < duration_s <= 1e6:
            raise ValueError(f"duration_s={duration_s} is not in 0 .. 1e6 s")
        if not 0 <= settle_s <= 1e3:
            raise ValueError(f"settle_s={settle_s} is not in 0 .. 1000 s")
        self.scene = scene
        self._settle_us = round(settle_s * 1e6)
        self._wall_moves = scene.wall is not None and not scene.camera.is_still
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
        self._before = (np.empty((0, 3, 3)), np.empty(0, np.int64), np.empty(0), np.empty(0, np.int64))
        self._strays = Strays(scene.pixel_model, self._state, rng)
        self._boxes: list[Box] = []
        self._patches: list[Patch] | None = None
        self._buffer = EventBuffer(BUFFER_EVENTS)
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
        with self._watch("start"):
            self._settle()
        for start in range(0, self.duration_us, CHUNK_US):
            end = min(start + CHUNK_US, self.duration_us)
            self._expose_chunk(start, end, self.scene.motion_steps)
            with self._watch("background"):
                self._buffer.add(*self._strays.chunk(start, end, self._followed))
            if self._on_unsorted is not None:
                codes, times = self._buffer.before(end)
                self._on_unsorted(codes, (times.astype(np.int64) - start).astype(np.int32))
            with self._watch("sort"):
                events = self._buffer.take(start, end, self.scene.optics.width)
            with self._watch("readout"):
                events = self.queue.pass_on(events, in_place=True)
            yield events

    def _settle(self) -> None:
        """Run the pixels before time 0 until they have forgotten how they started; their events are discarded.

        In a scene at rest, the pixels whose contrast is large (see `Patch.faint`) run through the last `FORGET_PACKETS`
        only. In a scene that moves, all run for `MOVING_SETTLE_US`, and the references of the pixels that see a wall
        are drawn before from those of a sensor that has passed such a wall for long.
        """
        start = -self._settle_us
        if self.scene.is_still:
            whole = self._draw(np.array([start, 0.0]))
            packet_us = max([image.waveform.packet_us for image in self._images], default=0.0)
            late = max(start, -int(np.ceil(FORGET_PACKETS * packet_us)))
            self._patches = [patch.faint(self._state, self.scene.pixel_model) for patch in whole]
            self._run_unseen(start, late)
            self._patches = whole
        else:
            late = max(start, -MOVING_SETTLE_US)
            if self._wall_moves and start < 0:
                self._copy_long_run(late)
        self._run_unseen(late, 0)

    def _run_unseen(self, start: int, end: int, steps: Steps | None = None) -> None:
        """Run all pixels of the present patches from one time to another, and discard the events before the end."""
        for first in range(start, end, CHUNK_US):
            self._expose_chunk(first, min(first + CHUNK_US, end), steps or self.scene.motion_steps)
            self._buffer.discard_before(end)

    def _copy_long_run(self, end: int) -> None:
        """Take the references from a sparse sensor that has passed the wall for long, without markers and lamps."""
        optics, wall_alone = self.scene.optics, replace(self.scene, markers=(), lamps=())
        shape = optics.height, optics.width
        pitch = max(round((shape[0] * shape[1] / SPARSE_PIXELS) ** 0.5), 1)
        small = -(-shape[0] // pitch), -(-shape[1] // pitch)
        coarse = replace(optics, height=small[0], width=small[1], pitch_um=pitch * optics.pitch_um)
        sample = Recorder(replace(wall_alone, optics=coarse), 1.0, self._rng)
        way_us = WALL_SETTLE_PX / max(wall_alone.speed_px_per_s(), WALL_SETTLE_PX / 10) * 1e6
        sample._run_unseen(end - round(way_us), end, wall_alone.motion_steps)
        copy_references(sample._state, small, self._state, shape, self._log_ambient(), self._rng)

    def _expose_chunk(self, start: int, end: int, steps: Steps) -> None:
        """Run every pixel that can fire through a chunk of time [us]."""
        cuts = steps(start, end)
        for first in range(0, cuts.size - 1, STEPS_PER_SPAN):
            self._expose(cuts[first : first + STEPS_PER_SPAN + 1])

    def _settled_pixels(self) -> PixelState:
        """Return pixels adapted to the scene at t = 0 with the LEDs off, with references that leak has spread."""
        optics = self.scene.optics
        log = np.full((optics.height, optics.width), self._log_ambient(), np.float32)
        if self.scene.wall is not None:
            log += self.scene.wall.log_reflectance(self.scene.wall_view(0.0), Box(0, 0, optics.width, optics.height))
        signal = np.exp(log)
        for number, image in enumerate(self._images):
            image.cover(signal, self.scene.marker_pose(number, 0.0))
        state = start_pixels(signal.ravel(), self.scene.pixel_model, self._rng)
        spread_references(state, self.scene.pixel_model, self._rng)
        return state

    def _log_ambient(self) -> float:
        """Return the log signal of a wall of mean reflectance."""
        light = self.scene.light
        return float(np.log(ambient_signal(light, self.scene.optics) * light.reflectance))

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
                schedule = patch.schedule(cuts, self.scene.pixel_model.time_constant_us)
            with self._watch("pixels"):
                self._run(fire_lit_pixels, chosen.index.size, (chosen.index, chosen.ambient, chosen.glow, *schedule))
        if self._wall_moves and self.scene.wall is not None:
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
        views = np.stack([self.scene.wall_view(t * 1e-6) for t in (cuts[:-1] + cuts[1:]) / 2])
        cells, numbers = noise_cells(cuts[0], cuts[-1], self.scene.pixel_model.time_constant_us)
        edges = np.unique(np.concatenate([cuts, cells[1:]]))
        step = np.searchsorted(cuts, edges[:-1], side="right") - 1
        moments = numbers[np.searchsorted(cells, edges[:-1], side="right") - 1]
        seen = (optics.width, taken, self._skipped, wall.repeated, *wall.extremes(views, optics), self._log_ambient(),
                self._before, views, step, edges, moments)  # fmt: skip
        self._run(fire_wall_pixels, taken.size, seen)
        tau_us = self.scene.pixel_model.time_constant_us / np.exp(self._log_ambient())
        k = max(int(np.searchsorted(edges, edges[-1] - MEMORY_TIME_CONSTANTS * tau_us, side="right")) - 1, 0)
        self._before = (views, step[k:], edges[k:], moments[k:])

    def _draw(self, cuts: npt.NDArray[np.float64]) -> list[Patch]:
        """Draw the markers and lamps at every step of a span, those that share pixels in one patch."""
        middles = (cuts[:-1] + cuts[1:]) * 0.5e-6
        poses = [[self.scene.marker_pose(i, t) for t in middles] for i in range(len(self._images))]
        boxes = [image.reach(p) for image, p in zip(self._images, poses, strict=True)]
        held, self._boxes = self._boxes or boxes, boxes
        # A pixel that a plate has just left is still settling, so the box of the last span is included.
        wide = [b if h.is_empty else h if b.is_empty else b.union(h) for b, h in zip(boxes, held, strict=True)]
        wall = self.scene.wall
        views = [self.scene.wall_view(t) for t in middles] if wall is not None else []
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
        done, buffer = 0, self._buffer
        while True:
            done, buffer.count = kernel(  # type: ignore[operator]
                done, *arrays, *memory, *settings, buffer.pixels, buffer.times, buffer.count
            )
            if done >= todo:
                return
            buffer.double()

    def _followed(self) -> npt.NDArray[np.bool_]:
        """Return which pixels see light that changes."""
        followed = np.full(self._state.level.size, self._wall_moves)
        for patch in self._patches or []:
            followed[patch.index] = True
        return followed


def record(scene: Scene, duration_s: float, rng: np.random.Generator | int, *, settle_s: float = 0.0) -> Events:
    """Record a scene and return all its events in one array.

    Parameters
    ----------
    scene : Scene
    duration_s : float
        Length of the recording [s].
    rng : numpy.random.Generator or int
        Source of all chance, or a seed.
    settle_s : float
        How long the sensor has seen the scene when the recording starts [s].

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
    return join(Recorder(scene, duration_s, generator, settle_s=settle_s))
