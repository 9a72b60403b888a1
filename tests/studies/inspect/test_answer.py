"""The answer in words names every marker, counts its periods, and says why there is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.events import make_events
from bicode_lab.marker import PacketFormat
from bicode_lab.recognition import REASONS, ReceiverSettings, Sighting, recognise, settings_for
from bicode_studies.inspect.answer import CAUSES, Answer, in_words, remark_on_long_packets
from tests.studies.inspect.lights import HEIGHT, WIDTH, blinking, noise, together

SETTINGS = ReceiverSettings(width=WIDTH, height=HEIGHT)
EVENTS = make_events([1, 2], [1, 2], [0, 1], [5_000, 5_000 + 329_000])  # ten periods


def answer_to(sightings: list[Sighting], settings: ReceiverSettings = SETTINGS) -> list[str]:
    """Return the lines after the given sightings in ten periods."""
    answer = Answer(settings)
    assert len(list(answer.events([EVENTS[:1], EVENTS[:0], EVENTS[1:]]))) == 3
    assert list(answer.sightings(sightings)) == sightings
    return answer.lines()


def at(period: int, **more: object) -> Sighting:
    """Return a sighting in a period."""
    given = {"track": 1, "x": 10, "y": 20, "w": 8, "h": 9, **more}
    return Sighting(t_us=5_000 + 33_000 * period, **given)  # type: ignore[arg-type]


def test_an_id_with_its_periods_place_and_pose() -> None:
    rows = [at(1, id=37), at(3, id=37, marker_2d_id=7, rvec=(3.1, 0, 0), tvec=(0.1, -0.2, 1.5)), at(4, reason="cut")]
    head, line = answer_to(rows)
    assert head == "2 events in 0.329 s: 10 x 33 ms"
    assert line == (
        "ID 37: in 2 of 10 periods, from 0.033 s to 0.132 s; track 1, at last 8 x 9 px at (10, 20); 2D marker 7 in 1, "
        "at last 1.50 m away (+0.10 m right, -0.20 m down)"
    )


def test_two_rows_of_one_period_are_one_period_in_two_tracks() -> None:
    lines = answer_to([at(0, id=3), at(0, id=3, track=2), at(1, id=3)])
    assert "in 2 of 10 periods, from 0.000 s to 0.066 s; 2 tracks" in lines[1]


def test_ids_are_listed_by_their_periods_and_one_period_is_doubted() -> None:
    lines = answer_to([at(0, id=3), *(at(k, id=9) for k in range(1, 10))])
    assert lines[1].startswith("ID 9: in 9 of 10 periods")
    assert lines[2].startswith("ID 3: in 1 of 10 periods")
    assert lines[2].endswith("one period only: it may be read by chance")
    assert "by chance" not in lines[1]


def test_many_ids_are_cut_short() -> None:
    lines = answer_to([at(0, id=k, track=k) for k in range(25)])
    assert len(lines) == 22
    assert lines[-1] == "and 5 more IDs, each in fewer periods"


def test_a_2d_marker_without_an_id_is_told_once() -> None:
    lines = answer_to([at(0, reason="cut", marker_2d_id=7), at(1, reason="cut", marker_2d_id=7)])
    assert lines[2].startswith("2D marker 7 without an ID: in 2 of 10 periods")
    assert len(answer_to([at(0, id=1, marker_2d_id=7), at(1, reason="cut", marker_2d_id=7)])) == 2


@pytest.mark.parametrize("reason", REASONS)
def test_each_reason_is_explained(reason: str) -> None:
    lines = answer_to([at(0, reason=reason), at(1, reason=reason), at(1, reason="cut", track=2)])
    assert lines[1].startswith(f"no marker: tried {in_words(SETTINGS)}; 3 regions blinked in 2 periods, ")
    most = 3 if reason == "cut" else 2
    assert f"{most} of them with reason {reason}: {CAUSES[reason]}" in lines[1]


def test_nothing_that_blinks_and_no_events() -> None:
    assert answer_to([])[1].endswith("nothing blinks anywhere, and no 2D marker is seen")
    assert Answer(SETTINGS).lines() == ["no marker: the recording holds no events"]


def test_odd_times_are_told_unless_they_were() -> None:
    events = together(blinking(seconds=0.1), noise(1000, 0.1)).copy()
    events["t"] *= 1000
    answer = Answer(SETTINGS)
    list(answer.events(np.array_split(events, 10)))
    assert "nanoseconds" in answer.lines()[-1]
    assert not any("nanoseconds" in line for line in answer.lines(times_are_told=True))


def test_what_is_kept_of_the_beginning_ends() -> None:
    answer = Answer(SETTINGS)
    parts = [make_events([1], [1], [1], [k * 500_000]) for k in range(100)]
    list(answer.events(parts))
    assert len(answer.begin) == 5


def test_the_words_of_the_settings() -> None:
    changed = settings_for(PacketFormat(f_id_hz=500, checksum="crc3", bit_order="lsb"), manchester="auto")
    assert in_words(changed) == "500 Hz, 3 start + 8 payload + 3 checksum bits (crc3), auto, lsb first"


@pytest.mark.parametrize(
    ("rate_hz", "share"), [(900.0, None), (840.0, "98%"), (800.0, "89%"), (500.0, "18%"), (425.0, "0%")]
)
def test_a_period_of_less_than_two_packets_is_told(rate_hz: float, share: str | None) -> None:
    packet = PacketFormat(f_id_hz=rate_hz)
    remark = remark_on_long_packets(replace(SETTINGS, packet_format=packet, delta_t_id_us=100))
    if share is None:
        assert remark is None
    else:
        assert remark is not None
        assert f"only {share} of the periods hold a whole one; choose --delta-t-whole-us" in remark
        chosen = int(remark.split("--delta-t-whole-us ")[1].split(",")[0])
        assert chosen >= 2 * packet.packet_us


def test_the_share_that_it_states_is_the_share_that_is_read() -> None:
    packet = PacketFormat(f_id_hz=500)
    events = blinking(packet, seconds=6.6)
    settings = settings_for(packet, width=WIDTH, height=HEIGHT, delta_t_whole_us=33_000, detect_2d=False)
    read = sum(one.id == 37 for one in recognise(events, settings))
    assert read / 200 == pytest.approx(33 / 28 - 1, abs=0.05)
