"""Tests of the pixel kernel against a simulation in small time steps, and of its laws."""

import numpy as np
import pytest
from plain_pixels import follow
from scipy import stats

from bicode_lab.camera import PixelModel
from bicode_lab.camera.pixel_steps import fast_exp, fast_log, max_events
from bicode_lab.camera.pixels import (
    NOISE_REACH,
    SIDE_BY_SIDE,
    SMALLEST_THRESHOLD,
    fire_lit_pixels,
    sort_by_time,
    start_pixels,
)
from bicode_lab.events import EVENT_DTYPE, words

MASK = 2**64 - 1


def noise_of(seed: int, pixel: int, moment: int) -> float:
    """Return the noise of a pixel at a moment, computed with Python's integers."""
    z = seed ^ (pixel * 0x9E3779B97F4A7C15 & MASK) ^ (moment * 0xD1B54A32D192ED03 & MASK)
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 & MASK
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB & MASK
    z ^= z >> 31
    total = sum((z >> shift) & 0xFFFF for shift in (0, 16, 32, 48))
    return (total - 131070) * 2.6429e-5  # 1 / sqrt(4 (65536^2 - 1) / 12) to the kernel's digits


class Drive:
    """Random light on a row of pixels: two LEDs, three images of what moves, and the settings of the model."""

    def __init__(self, seed, n=40, stretches=30, *, noise=0.0, dead=50.0, tau=150.0, delays=(0.0, 0.0), shortest=3.0):
        rng = np.random.default_rng(seed)
        self.n, self.noise, self.dead, self.tau, self.delays, self.seed = n, noise, dead, tau, delays, seed + 12345
        self.index = np.sort(rng.choice(100_000, n, replace=False)).astype(np.int32)
        self.ambient = rng.uniform(0.4, 1.5, (3, n)).astype(np.float32)
        self.glow = rng.uniform(0.0, 4.0, (3, 2, n)).astype(np.float32)
        lengths = np.exp(rng.uniform(np.log(shortest), np.log(1500), stretches))
        self.edges = np.concatenate([[0.0], np.cumsum(lengths)])
        self.moments = np.round(self.edges[:-1] * 16).astype(np.int64)
        self.levels = rng.choice([0.0, 0.5, 1.0], (stretches, 2)).astype(np.float32)
        self.maps = np.sort(rng.integers(0, 3, stretches)).astype(np.int32)
        on, off = (np.maximum(rng.normal(0.25, 0.05, 100_000), 0.1).astype(np.float32) for _ in range(2))
        level = np.zeros(100_000, np.float32)
        level[self.index] = np.log(self.ambient[0])
        self.state = (level, level.copy(), np.full(100_000, -1e18), on, off)

    def signal(self):
        """Return the light on every pixel in every stretch, shape (stretches, n)."""
        lit = np.einsum("km,kmn->kn", self.levels.astype(float), self.glow[self.maps].astype(float))
        return self.ambient[self.maps].astype(float) + lit

    def fire(self, first=0, last=None, room=1 << 23):
        """Run the kernel on stretches first .. last - 1; return (pixel, polarity, time), sorted by pixel, then time."""
        last = self.edges.size - 1 if last is None else last
        pixels, times = np.empty(room, np.uint32), np.empty(room)
        done, count = fire_lit_pixels(
            0, self.index, self.ambient, self.glow, self.edges[first : last + 1], self.moments[first:last],
            self.levels[first:last], self.maps[first:last], *self.state,
            np.uint64(self.seed), self.noise, self.tau, self.dead, *self.delays, pixels, times, 0,
        )  # fmt: skip
        assert done == self.n
        return in_order(pixels[:count] >> 1, pixels[:count] & 1, times[:count])

    def by_small_steps(self, step_us=0.05):
        """Simulate the same pixels in small time steps, without a closed form between crossings."""
        level, reference, _, on, off = (a[self.index].astype(float) for a in self.state)
        signal = self.signal()
        noise = np.array([[noise_of(self.seed, int(i), int(m)) for i in self.index] for m in self.moments])
        target = np.log(signal) + self.noise * noise
        held_for = np.full(self.n, -1.0)  # of the dead time, what is left; negative: free
        found = []
        for k in range(self.edges.size - 1):
            start, end = self.edges[k : k + 2]
            steps = int(np.ceil((end - start) / step_us))
            dt = (end - start) / steps
            decay = np.exp(-dt * signal[k] / self.tau)
            for s in range(steps):
                now = target[k] + (level - target[k]) * decay
                # Released within this step: the reference is the level then, between the two ends.
                released = (held_for >= 0) & (held_for < dt)
                share = np.where(released, held_for / dt, 0)
                reference = np.where(released, level + (now - level) * share, reference)
                free = (held_for < 0) | released
                held_for = np.where(released, -1.0, np.where(held_for >= 0, held_for - dt, held_for))
                up, down = free & (now - reference > on), free & (reference - now > off)
                for i in np.flatnonzero(up | down):
                    wanted = reference[i] + (on[i] if up[i] else -off[i])
                    part = np.clip((wanted - level[i]) / (now[i] - level[i]), 0, 1)
                    found.append((self.index[i], int(up[i]), start + (s + part) * dt + self.delays[0 if up[i] else 1]))
                    held_for[i] = self.dead - (1 - part) * dt
                level = now
        return in_order(*np.array(found).T)


def in_order(pixel, polarity, time):
    """Return columns as one structured array, sorted by pixel, then time."""
    events = np.rec.fromarrays([np.asarray(pixel, int), np.asarray(polarity, int), time], names="pixel,p,t")
    return events[np.lexsort((events.t, events.pixel))]


@pytest.mark.parametrize(
    ("seed", "settings"),
    [
        (1, {}),
        (2, {"noise": 0.05, "delays": (20.0, 30.0)}),
        (3, {"dead": 300.0, "noise": 0.05}),  # longer than many stretches: release falls stretches later
        (4, {"dead": 1.0, "tau": 40.0}),
        (5, {"dead": 700.0, "tau": 600.0, "noise": 0.15, "shortest": 1.0}),
    ],
    ids=["plain", "noisy, delayed", "long dead time", "fast", "slow, dead for long"],
)
def test_events_are_those_of_a_simulation_in_small_steps(seed, settings):
    drive = Drive(seed, **settings)
    expected = drive.by_small_steps()
    found = drive.fire()
    assert expected.size > 3 * drive.n
    assert found.size == expected.size
    np.testing.assert_array_equal(found.pixel, expected.pixel)
    np.testing.assert_array_equal(found.p, expected.p)
    # Steps of 0.05 us, the crossing interpolated in its step; close to the end of an approach a
    # level error of 1e-7 (float32 state) is worth more time, hence a few steps.
    error = np.abs(found.t - expected.t)
    assert np.median(error) < 0.001
    assert error.max() < 0.25


@pytest.mark.parametrize(
    "settings",
    [{}, {"noise": 0.05, "delays": (20.0, 30.0)}, {"dead": 0.0}, {"dead": 700.0, "noise": 0.15, "shortest": 1.0}],
    ids=["plain", "noisy, delayed", "never dead", "dead for long"],
)
def test_events_are_those_of_a_plain_loop(settings):
    drive = Drive(21, n=700, stretches=40, **settings)  # more than are taken side by side, and a rest
    model = PixelModel(
        time_constant_us=drive.tau, refractory_us=drive.dead, latency_on_us=drive.delays[0],
        latency_off_us=drive.delays[1],
    )  # fmt: skip
    level, reference, free, on, off = (column[drive.index].astype(float) for column in drive.state)
    signal = drive.signal()
    expected = []
    for i, pixel in enumerate(drive.index):
        noise = [drive.noise * noise_of(drive.seed, int(pixel), int(m)) for m in drive.moments]
        events, *state = follow(
            signal[:, i], model, drive.edges, noise, level[i], reference[i], free[i], on[i], off[i]
        )  # fmt: skip
        expected += [(pixel, polarity, t) for polarity, t in events]
        level[i], reference[i], _ = state
    found = drive.fire()
    expected = in_order(*np.array(expected).T)
    assert found.size == expected.size > 3 * drive.n
    np.testing.assert_array_equal(found.pixel, expected.pixel)
    np.testing.assert_array_equal(found.p, expected.p)
    # Exponential and logarithm are good to 1e-11; near the end of an approach time is a thousand times worse.
    assert np.abs(found.t - expected.t).max() < 1e-4
    np.testing.assert_array_equal(found.t.astype(int), expected.t.astype(int))  # as the recording has them
    np.testing.assert_allclose(drive.state[0][drive.index], level, atol=1e-6)
    np.testing.assert_allclose(drive.state[1][drive.index], reference, atol=1e-6)


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("cut", [1, 7, 15, 29])
def test_a_span_cut_in_two_gives_the_same_events(noise, cut):
    whole = Drive(11, noise=noise).fire()
    drive = Drive(11, noise=noise)
    a, b = drive.fire(0, cut), drive.fire(cut)
    joined = in_order(*(np.concatenate([a[c], b[c]]) for c in ("pixel", "p", "t")))
    assert joined.size == whole.size
    np.testing.assert_array_equal(joined.pixel, whole.pixel)
    np.testing.assert_array_equal(joined.p, whole.p)
    # Between calls the state is kept in float32: 1e-7 of the level.
    assert np.abs(joined.t - whole.t).max() < 0.05


def test_a_stretch_cut_in_two_gives_the_same_events():
    whole = Drive(12, noise=0.05).fire()
    drive = Drive(12, noise=0.05)
    middle = (drive.edges[:-1] + drive.edges[1:]) / 2
    drive.edges = np.sort(np.concatenate([drive.edges, middle]))
    for name in ("moments", "levels", "maps"):  # a cut stretch keeps the moment it began
        setattr(drive, name, np.repeat(getattr(drive, name), 2, axis=0))
    cut = drive.fire()
    np.testing.assert_array_equal(cut.pixel, whole.pixel)
    np.testing.assert_array_equal(cut.p, whole.p)
    assert np.abs(cut.t - whole.t).max() < 1e-6


def test_a_later_clock_only_shifts_the_times():
    drive, later = Drive(13), Drive(13)
    later.edges = later.edges + 1e6
    a, b = drive.fire(), later.fire()
    np.testing.assert_array_equal(a.pixel, b.pixel)
    np.testing.assert_array_equal(a.p, b.p)
    assert np.abs(b.t - a.t - 1e6).max() < 1e-6


def test_latency_is_added_to_each_polarity():
    plain, late = Drive(14).fire(), Drive(14, delays=(20.0, 30.0)).fire()
    for polarity, delay in ((1, 20.0), (0, 30.0)):
        a, b = (np.sort(e.t[e.p == polarity]) for e in (plain, late))
        np.testing.assert_allclose(b, a + delay)


def test_no_two_events_of_a_pixel_within_the_dead_time():
    for dead in (0.0, 50.0, 400.0):
        events = Drive(15, dead=dead, noise=0.05).fire()
        same = np.diff(events.pixel) == 0
        assert np.diff(events.t)[same].min() >= dead - 1e-6


def test_running_out_of_room_ends_early_and_loses_nothing():
    drive, small = Drive(16, n=1000), Drive(16, n=1000)
    expected = drive.fire()
    worst = SIDE_BY_SIDE * max_events(small.edges, small.dead)
    columns = []
    done, rounds = 0, 0
    while done < small.n:
        pixels, times = np.empty(worst, np.uint32), np.empty(worst)  # so many pixels at a time, never more
        done, count = fire_lit_pixels(
            done, small.index, small.ambient, small.glow, small.edges, small.moments, small.levels, small.maps,
            *small.state, np.uint64(small.seed), 0.0, small.tau, small.dead, 0.0, 0.0, pixels, times, 0,
        )  # fmt: skip
        columns.append((pixels[:count] >> 1, pixels[:count] & 1, times[:count]))
        rounds += 1
    assert rounds > 1
    found = in_order(*(np.concatenate(c) for c in zip(*columns, strict=True)))
    np.testing.assert_array_equal(found.t, expected.t)


def blink(ratio, *, dead=0.0, blinks=6, chip_us=5000.0, threshold=0.25):
    """Return the ON and OFF events of one pixel at every edge of a blinking LED, shape (2 * blinks,)."""
    one = np.ones((1, 1), np.float32)
    stretches = 2 * blinks
    edges = np.arange(stretches + 1) * chip_us
    levels = (np.arange(stretches) % 2 == 0).astype(np.float32)[:, None]
    state = (np.zeros(1, np.float32), np.zeros(1, np.float32), np.full(1, -1e18), *np.full((2, 1), threshold, "f4"))
    pixels, times = np.empty(1 << 16, np.uint32), np.empty(1 << 16)
    _, count = fire_lit_pixels(
        0, np.zeros(1, np.int32), one, one[None] * np.float32(ratio - 1), edges, np.zeros(stretches, np.int64), levels,
        np.zeros(stretches, np.int32), *state, np.uint64(0), 0.0, 150.0, dead, 0.0, 0.0, pixels, times, 0,
    )  # fmt: skip
    edge = (times[:count] // chip_us).astype(int)
    polarity = (pixels[:count] & 1).astype(int)
    return np.bincount(edge[polarity == 1], minlength=stretches), np.bincount(edge[polarity == 0], minlength=stretches)


def test_trap_g_six_events_an_edge_at_ratio_six():
    # ln 6 / 0.25 = 7.17. From rest the first edge makes 7, and leaves the reference at 1.75. Falling,
    # the seventh crossing lies on 0, the level that is only approached: 6; so the reference stays at
    # 0.25 and the next rise has 6 as well.
    on, off = blink(6.0)
    assert on.tolist() == [7, 0, 6, 0, 6, 0, 6, 0, 6, 0, 6, 0]
    assert off.tolist() == [0, 6] * 6


@pytest.mark.parametrize(("ratio", "rises"), [(1.27, 0), (1.4, 1), (2.4, 3), (3.5, 5), (5.5, 6), (8.0, 8)])
def test_equal_thresholds_make_one_event_fewer_an_edge_than_fit(ratio, rises):
    # The first rise makes floor(ln ratio / 0.25); the last of as many falls would lie on level 0.
    on, off = blink(ratio, chip_us=20_000.0)
    assert on[0] == rises == int(np.log(ratio) / 0.25)
    assert set(on[2::2]) == set(off[1::2]) == {max(rises - 1, 0)}
    assert not on[1::2].any()
    assert not off[0::2].any()


def test_a_dead_time_costs_events_because_the_reset_swallows_light():
    counts = [sum(map(np.sum, blink(6.0, dead=dead))) for dead in (0.0, 10.0, 50.0, 200.0)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[-1] > 0


# -- noise


def test_the_noise_is_normal_enough_and_bounded():
    n = 20_000
    z = np.array([noise_of(987654321, pixel, 16 * 500) for pixel in range(n)])
    # Standard errors: mean 1/sqrt(n), variance sqrt((k - 1)/n) with k = 3 - 6/(5*4) = 2.7 for four uniforms.
    assert abs(z.mean()) < 4 / np.sqrt(n)
    assert abs(z.var() - 1) < 4 * np.sqrt(1.7 / n)
    assert np.abs(z).max() < NOISE_REACH
    # Neighbours in space and in time know nothing of each other.
    later = np.array([noise_of(987654321, pixel, 16 * 1000) for pixel in range(n)])
    for other in (later, np.roll(z, 1), np.roll(z, 1280)):
        assert abs(np.corrcoef(z, other)[0, 1]) < 4 / np.sqrt(n)
    assert 131070 / np.sqrt(4 * (65536**2 - 1) / 12) <= NOISE_REACH  # all four at their most


# -- arithmetic


def test_the_exponential_and_the_logarithm_are_those():
    x = np.concatenate([np.linspace(-600, 600, 2001), np.linspace(-1e-3, 1e-3, 101)])
    np.testing.assert_allclose([fast_exp(v) for v in x], np.exp(x), rtol=2e-11)
    y = np.concatenate([np.exp(np.linspace(-300, 300, 2001)), 1 + np.linspace(-1e-3, 1e-3, 101), [0.5, 1, 2]])
    np.testing.assert_allclose([fast_log(v) for v in y], np.log(y), rtol=1e-11, atol=1e-12)


# -- thresholds


def test_thresholds_are_spread_as_asked_and_apart():
    n = 200_000
    model = PixelModel(threshold_on=0.3, threshold_off=0.2, threshold_spread=0.03)
    state = start_pixels(np.full(n, 2.0, np.float32), model, np.random.default_rng(5))
    for found, mean in ((state.threshold_on, 0.3), (state.threshold_off, 0.2)):
        assert abs(found.mean() - mean) < 4 * 0.03 / np.sqrt(n)
        assert abs(found.std() / 0.03 - 1) < 4 / np.sqrt(2 * n)
        assert stats.kstest((found[:5000] - mean) / 0.03, "norm").pvalue > 1e-4
    assert abs(np.corrcoef(state.threshold_on, state.threshold_off)[0, 1]) < 4 / np.sqrt(n)
    np.testing.assert_allclose(state.level, np.log(2.0), rtol=1e-6)
    np.testing.assert_array_equal(state.level, state.reference)


def test_no_threshold_is_too_small():
    wide = start_pixels(np.ones(10_000, np.float32), PixelModel(threshold_spread=0.2), np.random.default_rng(0))
    assert wide.threshold_on.min() == np.float32(SMALLEST_THRESHOLD)


# -- sorting


def test_sorting_by_counting_is_a_stable_sort():
    rng = np.random.default_rng(0)
    n, width = 5000, 37
    places = rng.integers(0, 37 * 20, n)
    polarity = rng.integers(0, 2, n)
    times = 1000 + rng.random(n) * 300
    pixels = (2 * places + polarity).astype(np.uint32)
    late = times >= 1250
    events, rest, rest_times = np.empty(n, EVENT_DTYPE), pixels.copy(), times.copy()
    early = sort_by_time(rest, rest_times, n, 1000, 1250, width, words(events))
    assert early == np.count_nonzero(~late) < n
    order = np.flatnonzero(~late)[np.argsort(times[~late].astype(int), kind="stable")]
    np.testing.assert_array_equal(events["t"][:early], times.astype(int)[order])
    np.testing.assert_array_equal(events["x"][:early], (places % width)[order])
    np.testing.assert_array_equal(events["y"][:early], (places // width)[order])
    np.testing.assert_array_equal(events["p"][:early], polarity[order])
    np.testing.assert_array_equal(rest[: n - early], pixels[late])
    np.testing.assert_array_equal(rest_times[: n - early], times[late])


@pytest.mark.parametrize("width", [1, 3, 346, 1280, 49_999, 65_536])
def test_places_are_found_on_any_sensor(width):
    rng = np.random.default_rng(width)
    rows = 65_536 if width < 30_000 else 2**31 // width
    y = np.concatenate([rng.integers(rows, size=1000), [0, 0, rows - 1, rows - 1]])
    x = np.concatenate([rng.integers(width, size=1000), [0, width - 1, 0, width - 1]])
    events = np.empty(y.size, EVENT_DTYPE)
    sort_by_time((2 * (y * width + x)).astype(np.uint32), np.zeros(y.size), y.size, 0, 1, width, words(events))
    np.testing.assert_array_equal(events["x"], x)
    np.testing.assert_array_equal(events["y"], y)


# -- misuse


@pytest.mark.parametrize(
    ("name", "value", "rule"),
    [
        ("threshold_on", 0.01, "0.05"),
        ("threshold_off", 0.0, "0.05"),
        ("time_constant_us", 0.0, "more than 0"),
        ("threshold_spread", -0.1, "0 or more"),
        ("noise", -0.1, "0 or more"),
        ("latency_on_us", -1.0, "0 or more"),
        ("refractory_us", -1.0, "0 or more"),
        ("background_hz", -1.0, "0 or more"),
        ("hot_pixels", -1, "0 or more"),
        ("background_off_share", 1.5, "0 .. 1"),
        ("noise", float("nan"), "0 or more"),
    ],
)
def test_settings_that_cannot_be_are_refused(name, value, rule):
    with pytest.raises(ValueError) as refused:
        PixelModel(**{name: value})
    assert f"{name}={value}" in str(refused.value)
    assert rule in str(refused.value)
