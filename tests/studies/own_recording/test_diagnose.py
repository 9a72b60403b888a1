"""Tests of the diagnosis of a period: it agrees with the receiver, and names the check that failed."""

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.events import make_events, no_events
from bicode_lab.marker import LedWaveform, PacketFormat, encode_packet
from bicode_lab.recognition import ReceiverSettings, recognise
from bicode_studies.own_recording.diagnose import CHECKS, diagnose_period

SETTINGS = ReceiverSettings(width=64, height=48, detect_2d=False)
BOX = (20, 15, 6, 6)


def blinker(payload=0x25, seconds=0.033, *, phase_us=5000, packet_format=None, seed=0):
    """Return events of a light of 6 x 6 px; every pixel responds to every edge after 0.10 to 0.18 ms."""
    waveform = LedWaveform(payload=payload, phase_us=phase_us, packet_format=packet_format or PacketFormat())
    times, levels = waveform.steps(0, seconds * 1e6)
    turns = np.flatnonzero(np.diff(levels)) + 1
    rng = np.random.default_rng(seed)
    x, y, w, h = BOX
    columns, rows = np.meshgrid(np.arange(x, x + w), np.arange(y, y + h))
    t_us = times[turns][:, None] + 100 + rng.uniform(0, 80, (turns.size, w * h))
    p = np.repeat(levels[turns] > 0, w * h)
    order = np.argsort(t_us.ravel(), kind="stable")
    place = (np.tile(columns.ravel(), turns.size)[order], np.tile(rows.ravel(), turns.size)[order])
    return make_events(*place, p[order], t_us.ravel()[order].astype(np.int64))


@pytest.mark.parametrize("payload", [0, 0x25, 0x5A, 0xFF])
@pytest.mark.parametrize("phase_us", [0, 3300, 9100])
def test_a_good_period_passes_every_check_and_shows_its_bits(payload, phase_us):
    events = blinker(payload, phase_us=phase_us)
    diagnosis = diagnose_period(events, 0, SETTINGS)
    assert diagnosis.failed == ""
    assert [check.name for check in diagnosis.checks] == list(CHECKS)
    assert all(check.passed for check in diagnosis.checks)
    assert diagnosis.chips == tuple(encode_packet(payload, PacketFormat()))
    assert "".join(text for _, _, text in diagnosis.bits)[:8] == f"{payload:08b}"
    assert f"{payload:08b}" in diagnosis.checks[6].found


def test_it_agrees_with_the_receiver():
    events = blinker(seconds=0.2)
    for sighting in recognise(events, SETTINGS, t0_us=0):
        box = (sighting.x, sighting.y, sighting.w, sighting.h)
        diagnosis = diagnose_period(events, sighting.t_us, SETTINGS, box=box)
        assert (diagnosis.failed == "") == (sighting.id is not None)


def test_nothing_in_view_fails_at_the_events():
    diagnosis = diagnose_period(no_events(), 0, SETTINGS)
    assert diagnosis.failed == "events"
    assert [check.passed for check in diagnosis.checks[1:]] == [None] * 7


def test_stray_events_fail_at_the_region():
    rng = np.random.default_rng(0)
    t_us = np.sort(rng.integers(0, 33_000, 40))
    events = make_events(rng.integers(0, 64, 40), rng.integers(0, 48, 40), rng.integers(0, 2, 40), t_us)
    diagnosis = diagnose_period(events, 0, SETTINGS)
    assert diagnosis.failed == "region"
    assert diagnosis.packets == ()


def test_a_light_that_blinks_too_seldom_is_shown_all_the_same():
    events = blinker()
    events = events[events["t"] < 8000]
    diagnosis = diagnose_period(events, 0, replace(SETTINGS, min_blink_fraction=0.3))
    assert diagnosis.failed == "region"
    assert diagnosis.box is not None
    assert "% of the frames" in diagnosis.checks[1].found


def test_a_lamp_fails_at_the_start():
    t_us = np.arange(500, 33_000, 500)
    x, y = np.meshgrid(np.arange(20, 24), np.arange(15, 19))
    p = np.repeat(np.arange(t_us.size) % 2, 16)
    events = make_events(np.tile(x.ravel(), t_us.size), np.tile(y.ravel(), t_us.size), p, np.repeat(t_us, 16))
    assert diagnose_period(events, 0, SETTINGS, box=(20, 15, 4, 4)).failed == "start"


def test_a_short_period_cuts_the_packet():
    settings = replace(SETTINGS, delta_t_whole_us=15_000, delta_t_2d_us=6000)
    assert diagnose_period(blinker(phase_us=9000), 0, settings, box=BOX).failed == "whole"


def test_a_finger_over_an_edge_fails_at_the_manchester_code():
    events = blinker(phase_us=0)
    first_us = 14_000 + 6 * 500 + 8 * 500
    hidden = events[(events["t"] < first_us) | (events["t"] > first_us + 800)]
    diagnosis = diagnose_period(hidden, 0, SETTINGS, box=BOX)
    assert diagnosis.failed in ("manchester", "")  # the other packet of the period may be whole
    early = hidden[hidden["t"] > 11_000]
    diagnosis = diagnose_period(early, 0, SETTINGS, box=BOX)
    assert diagnosis.failed == "manchester"
    assert "x" in [text for _, _, text in diagnosis.bits]
    assert "not switch" in diagnosis.checks[5].found


def test_the_other_convention_fails_at_the_checksum():
    diagnosis = diagnose_period(blinker(), 0, replace(SETTINGS, manchester="thomas"), box=BOX)
    assert diagnosis.failed == "checksum"


def test_two_ids_in_one_period_fail_at_the_last_check():
    one, two = blinker(0x25, phase_us=0), blinker(0x07, phase_us=0)
    both = np.concatenate([one[one["t"] < 14_000], two[two["t"] >= 14_000]])
    assert diagnose_period(both, 0, SETTINGS, box=BOX).failed == "one ID"


def test_the_view_stays_on_the_sensor():
    diagnosis = diagnose_period(blinker(), 0, SETTINGS)
    x, y, w, h = diagnosis.view
    assert x >= 0
    assert y >= 0
    assert w == h
