"""Tests of the measurement of a camera: the constants that its events were made with are found again."""

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.camera.pixels import PixelModel, fire_lit_pixels, start_pixels
from bicode_lab.events import make_events
from bicode_lab.marker import PacketFormat, encode_packet
from bicode_lab.recognition import Packet
from bicode_studies.own_recording.led_response import measure_edge_response, split_pixels
from bicode_studies.own_recording.pixel_fit import PixelFit, fit_pixel, model_response

SIDE = 20
PACKETS = 6
RATIO = 1.9
FORMAT = PacketFormat()


CAMERA = PixelModel(time_constant_us=150.0)  # its constants are to be found


def led_events(model, *, chip_us=500.0, payload=0x25, seed=1, clock_start_us=0):
    """Return events of 20 x 20 px that see an LED, and its packets with starts that are up to 30 us wrong."""
    n = SIDE * SIDE
    levels = encode_packet(payload, FORMAT)
    light = np.tile(levels, PACKETS)
    turns = np.concatenate([[0], np.flatnonzero(np.diff(light.astype(int))) + 1])
    state = start_pixels(np.ones(n, np.float32), model, np.random.default_rng(seed))
    pixels, times = np.empty(1 << 22, np.uint32), np.empty(1 << 22)
    _, count = fire_lit_pixels(
        0, np.arange(n, dtype=np.int32), np.ones((1, n), np.float32), np.full((1, 1, n), RATIO - 1, np.float32),
        np.append(turns, light.size) * chip_us, turns.astype(np.int64), light[turns].astype(np.float32)[:, None],
        np.zeros(turns.size, np.int32), state.level, state.reference, state.free_us, state.threshold_on,
        state.threshold_off, np.uint64(seed), model.noise, model.time_constant_us, model.refractory_us,
        model.latency_on_us, model.latency_off_us, pixels, times, 0,
    )  # fmt: skip
    order = np.argsort(times[:count], kind="stable")
    place, p = pixels[:count][order] >> 1, pixels[:count][order] & 1
    events = make_events(place % SIDE, place // SIDE, p, (times[:count][order] + clock_start_us).astype(np.int64))
    rng = np.random.default_rng(seed)
    starts = clock_start_us + np.arange(PACKETS) * chip_us * levels.size + rng.uniform(-30, 30, PACKETS)
    packets = [Packet(int(s), int(s + 14_000), payload, True, None, "ieee", int(s)) for s in starts]
    return events, packets


def response_of(model, **changes):
    events, packets = led_events(model, **changes)
    return measure_edge_response(events, (0, 0, SIDE, SIDE), packets, FORMAT)


@pytest.mark.parametrize("clock_start_us", [0, 11_200_224])
@pytest.mark.parametrize("ppm", [-400, 0, 400])
def test_the_transmitters_clock_is_found(ppm, clock_start_us):
    chip_us = 500 * (1 + ppm * 1e-6)
    response = response_of(CAMERA, chip_us=chip_us, clock_start_us=clock_start_us)
    assert response.chip_us == pytest.approx(chip_us, rel=3e-5)
    assert response.start_us == pytest.approx(clock_start_us, abs=60)  # up to the answer's own shift


def test_every_event_of_an_edge_is_counted_once():
    events, packets = led_events(PixelModel(noise=0.0, threshold_spread=0.0))
    response = measure_edge_response(events, (0, 0, SIDE, SIDE), packets, FORMAT)
    inside = response.on.sum() + response.off.sum()
    assert response.n_pixels == SIDE * SIDE
    assert 0.97 * events.size <= inside <= events.size
    assert response.n_packets == PACKETS
    assert response.n_rises == 8
    assert response.delays_us.size == response.on.shape[1] == 50


def test_groups_hold_every_pixel_once():
    response = response_of(CAMERA)
    parts = split_pixels(response)
    assert sum(part.n_pixels for part in parts) == response.n_pixels
    assert (sum(part.on.sum(axis=0) for part in parts) == response.on.sum(axis=0)).all()


@pytest.mark.slow
@pytest.mark.parametrize("changes", [{}, {"time_constant_us": 250.0}, {"threshold_on": 0.2, "threshold_off": 0.2}])
def test_constants_typed_in_come_out_again(changes):
    model = replace(CAMERA, **changes)
    fit = fit_pixel(response_of(model), float(np.log(RATIO)))
    assert fit.threshold == pytest.approx(model.threshold_on, rel=0.1)
    assert fit.time_constant_us == pytest.approx(model.time_constant_us, rel=0.15)
    assert fit.misfit < 3


@pytest.mark.slow
@pytest.mark.parametrize("off_us", [30.0, 60.0])
def test_the_difference_of_the_delays_lies_within_what_the_groups_scatter(off_us):
    response = response_of(replace(CAMERA, latency_off_us=off_us))
    later = [
        fit_pixel(part, float(np.log(RATIO)), n_steps=150, seed=k).delay_difference_us
        for k, part in enumerate(split_pixels(response), 1)
    ]
    assert abs(np.mean(later) - (off_us - 20)) < 3.18 * np.std(later, ddof=1)  # Student, 3 degrees of freedom, 95 %


def test_a_delay_common_to_on_and_off_cannot_be_seen_their_difference_can():
    early = response_of(CAMERA)
    late = response_of(replace(CAMERA, latency_on_us=220.0, latency_off_us=230.0))
    assert np.abs(early.per_edge("off") - late.per_edge("off")).max() < 0.02
    later = response_of(replace(CAMERA, latency_off_us=80.0))
    centre = [part.per_edge("off") @ part.delays_us / part.per_edge("off").sum() for part in (early, later)]
    assert centre[1] - centre[0] == pytest.approx(50, abs=8)


def test_contrast_and_threshold_scale_together():
    fit = PixelFit(
        log_contrast=0.6, threshold=0.25, time_constant_us=200, noise=0.05, refractory_us=50,
        on_delay_us=0, off_delay_us=0,
    )  # fmt: skip
    twice = replace(fit, log_contrast=0.66, threshold=0.275, noise=0.055)
    levels = encode_packet(0x25, FORMAT)
    one, two = (model_response(f, levels, 500.0, 50) for f in (fit, twice))
    assert one[1].sum() == pytest.approx(two[1].sum(), rel=0.02)
    assert np.abs(one[1] - two[1]).max() < 0.1 * one[1].max()


def test_what_cannot_be_measured_is_refused():
    events, packets = led_events(CAMERA)
    with pytest.raises(ValueError, match="two or more packets"):
        measure_edge_response(events, (0, 0, SIDE, SIDE), packets[:1], FORMAT)
    with pytest.raises(ValueError, match="go nearer"):
        measure_edge_response(events, (0, 0, 2, 2), packets, FORMAT)
    with pytest.raises(ValueError, match="log_contrast"):
        fit_pixel(measure_edge_response(events, (0, 0, SIDE, SIDE), packets, FORMAT), 0.0)
