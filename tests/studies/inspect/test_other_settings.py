"""The settings with which a light can be read are found, and a light that is none is said to be none."""

from __future__ import annotations

import dataclasses
import shlex
from typing import Any

import numpy as np
import pytest

from bicode_lab.events import no_events
from bicode_lab.marker import PacketFormat
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.inspect.light import bit_lengths_us, blinking_boxes
from bicode_studies.inspect.other_settings import as_options, find_settings, settings_that_read
from tests.studies.inspect.lights import HEIGHT, WIDTH, blinking, noise, ordered, together

GIVEN = ReceiverSettings(width=WIDTH, height=HEIGHT)
CHANGES: list[dict[str, Any]] = [
    {},
    {"f_id_hz": 250.0},
    {"f_id_hz": 500.0},
    {"f_id_hz": 800.0},
    {"f_id_hz": 1300.0},
    {"f_id_hz": 2000.0},
    {"payload_bits": 5},
    {"payload_bits": 12},
    {"payload_bits": 16, "checksum": "crc3"},
    {"manchester": "thomas"},
    {"checksum": "crc3"},
    {"bit_order": "lsb"},
    {"start_bits": 5},
    {"checksum_bits": 5},
    {"f_id_hz": 500.0, "payload_bits": 10, "manchester": "thomas"},
]


@pytest.mark.parametrize("change", CHANGES, ids=str)
@pytest.mark.parametrize("payload", [21, 13])
def test_the_settings_of_a_light_are_among_the_answers(change: dict[str, Any], payload: int) -> None:
    packet = PacketFormat(**change)
    events = together(blinking(packet, payload, seconds=max(0.3, 8 * packet.packet_us * 1e-6)), noise())
    (box, *_) = blinking_boxes(events, GIVEN)
    found = settings_that_read(events, box, GIVEN)
    right = [one for one in found if one.packet_format == packet]
    assert [one.payload for one in right] == [payload], [one.packet_format for one in found]
    assert right[0].n_read >= 0.8 * right[0].n_packets >= 3
    if not change:
        assert len(found) == 1  # nothing has to change, so nothing else is named


def test_what_it_says_is_what_has_to_be_typed() -> None:
    packet = PacketFormat(f_id_hz=500, manchester="thomas")
    lines = find_settings([blinking(packet, seconds=0.6)], GIVEN)
    assert "1 region blinks" in lines[0]
    assert "read with --f-id-hz 500 --manchester thomas --delta-t-whole-us 66000 (ID 37 in " in lines[1]
    assert "at (100, 60)" in lines[1]
    assert "read with the settings that were given (ID 37" in find_settings([blinking()], GIVEN)[1]


@pytest.mark.parametrize("field", [each.name for each in dataclasses.fields(PacketFormat)])
def test_each_setting_has_an_option(field: str) -> None:
    other: dict[str, Any] = {
        "start_bits": 4, "payload_bits": 9, "checksum": "crc3", "checksum_bits": 2, "f_id_hz": 2000.0,
        "manchester": "thomas", "bit_order": "lsb",
    }  # fmt: skip
    words = shlex.split(as_options(PacketFormat(**{field: other[field]}), GIVEN))
    assert words[:2] == [
        f"--{field.replace('_', '-')}",
        f"{other[field]:g}" if field == "f_id_hz" else str(other[field]),
    ]
    assert len(words) == 2


def test_only_the_first_seconds_are_asked_for() -> None:
    def chunks() -> Any:
        for k in range(100):
            part = blinking(seconds=0.1).copy()
            part["t"] += k * 100_000
            yield part
            assert k < 25, "2 s are enough"

    assert "events of the first 2.10 s: 1 region blinks" in find_settings(chunks(), GIVEN)[0]


def test_what_is_no_marker_is_said() -> None:
    assert "holds no events" in find_settings([no_events()], GIVEN)[0]
    assert "nothing blinks at any rate" in find_settings([noise()], GIVEN)[0]
    t = np.arange(0, 600_000, 5_000)
    pixels = np.arange(64)
    lamp = ordered(
        np.tile(50 + pixels % 8, t.size),
        np.tile(50 + pixels // 8, t.size),
        np.repeat(np.arange(t.size) % 2, 64),
        (t[:, None] + np.random.default_rng(0).normal(0, 300, (t.size, 64)) + 2000).ravel(),
    )
    lines = find_settings([lamp], GIVEN)
    assert any("a lamp on the mains that flickers at 100 Hz" in line for line in lines), lines


def test_the_length_of_a_bit_is_found_among_a_few() -> None:
    for rate_hz in (300.0, 1000.0, 2500.0):
        lengths = bit_lengths_us(blinking(PacketFormat(f_id_hz=rate_hz)))
        assert min(abs(each * rate_hz / 1e6 - 1) for each in lengths) < 0.05
        assert len(lengths) <= 6
    assert bit_lengths_us(no_events()) == []
