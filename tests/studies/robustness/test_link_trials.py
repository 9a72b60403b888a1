"""Rows of a link count what a receiver says, against a receiver whose sightings are known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import pytest

from bicode_lab.camera import truth_at
from bicode_lab.events import Events
from bicode_lab.recognition import Sighting
from bicode_lab.recognition.decode import Packet
from bicode_studies.robustness.earlier_receivers import read_distance_by_earlier, read_link_by_earlier
from bicode_studies.robustness.link_conditions import HOME
from bicode_studies.robustness.link_scenes import link_scene
from bicode_studies.robustness.link_trials import Timed, link_rows, range_rows
from bicode_studies.robustness.sequential_trials import (
    Piece,
    count_piece_by_sequential,
    pieces,
    read_distance_by_sequential,
    read_link_by_sequential,
)
from bicode_studies.robustness.stressors import StressCondition, stress

PERIOD_US = 33_000
SCENE = link_scene(HOME, 0)
MARKER = SCENE.markers[0].marker
LEFT, TOP, WIDTH, HEIGHT = (round(value) for value in truth_at(SCENE, 0)[0].box_px)


def sighting(period: int, value: int | None, x: int = LEFT, packets: tuple[Packet, ...] = ()) -> Sighting:
    return Sighting(t_us=period * PERIOD_US, track=1, x=x, y=TOP, w=WIDTH, h=HEIGHT, id=value, packets=packets)


@dataclass(frozen=True)
class Says:
    """Settings of a receiver that says what a function returns for the number of a period."""

    what: Callable[[int], list[Sighting]]
    delta_t_whole_us: int = PERIOD_US

    def start(self, t0_us: int) -> Callable[[int, Events], list[Sighting]]:
        return lambda start_us, events: self.what(start_us // PERIOD_US)


def row(what: Callable[[int], list[Sighting]]) -> dict[str, object]:
    return link_rows(HOME, 0, {"says": Says(what)})[0]


def test_periods_that_are_right_are_counted_from_the_first_on() -> None:
    found = row(lambda k: [sighting(k, MARKER.payload)] if k in (2, 4, 9) else [])
    assert (found["periods"], found["right"], found["right_first"], found["right_fifth"]) == (10, 3, 0, 1)
    assert found["first_right_ms"] == 99
    assert (found["rows"], found["false_rows"], found["wrong_ids"], found["packets_right"]) == (3, 0, 0, 0)
    found = row(lambda k: [sighting(k, MARKER.payload)] if k in (0, 3, 5) else [])
    assert (found["right"], found["right_first"], found["right_fifth"], found["first_right_ms"]) == (3, 1, 0, 33)
    assert row(lambda k: [])["first_right_ms"] is None


def test_rows_that_lie_on_no_marker_are_false() -> None:
    found = row(
        lambda k: [sighting(k, None), sighting(k, None, x=LEFT + WIDTH + 5), sighting(k, 1 ^ MARKER.payload, 0)]
    )
    assert (found["rows"], found["false_rows"], found["wrong_ids"], found["right"]) == (10, 20, 10, 0)
    near = row(lambda k: [sighting(k, None, x=LEFT + 3), sighting(k, None, x=LEFT - 3)])
    assert (near["rows"], near["false_rows"]) == (20, 0)


def test_a_packet_counts_once_where_it_was_sent() -> None:
    starts = [round(at) for at in MARKER.waveform.packet_starts(0, 10 * PERIOD_US - 14_000)]

    def packet(start_us: int, payload: int = MARKER.payload, ok: bool = True) -> Packet:
        return Packet(start_us, start_us + 14_000, payload, ok, None, None, start_us + 3500)

    found = row(lambda k: [sighting(k, None, packets=(packet(starts[3] + 2000), packet(starts[3]), packet(starts[5])))])
    assert (found["packets"], found["packets_right"]) == (len(starts), 2)
    elsewhere = row(lambda k: [sighting(k, None, packets=(packet(starts[3] + 7000),))])
    wrong = row(
        lambda k: [sighting(k, None, packets=(packet(starts[3], 1 ^ MARKER.payload), packet(starts[4], ok=False)))]
    )
    assert elsewhere["packets_right"] == wrong["packets_right"] == 0
    border = row(lambda k: [replace(sighting(k, None), border_packets=(packet(starts[1]),))])
    assert border["packets_right"] == 1


def test_each_period_is_timed() -> None:
    timed = Timed(Says(lambda k: []))
    reader = timed.start(0)
    for k in range(3):
        reader(k * PERIOD_US, None)  # type: ignore[arg-type]
    assert len(timed.ms) == 3
    assert min(timed.ms) >= 0
    assert timed.delta_t_whole_us == PERIOD_US


def test_all_receivers_read_the_same_recording_and_trials_repeat() -> None:
    both = read_link_by_earlier(HOME, 1) + read_link_by_sequential(HOME, 1)
    assert [each["receiver"] for each in both] == ["paper", "soft", "sequential"]
    assert len({each["events"] for each in both}) == 1
    assert [each["right"] for each in both] == [10, 10, 10]
    again = read_link_by_earlier(HOME, 1)
    assert [{**each, "ms_per_period": 0} for each in again] == [{**each, "ms_per_period": 0} for each in both[:2]]


def test_tiles_are_laid_over_the_marker() -> None:
    busy = replace(HOME, clutter="tiles", amount=2.0, periods=3)
    (plain,), (tiled,) = (read_link_by_sequential(each, 0) for each in (replace(HOME, periods=3), busy))
    assert tiled["events"] > plain["events"] + 5000
    assert tiled["periods"] == 3


def test_distances_are_those_of_the_stress_test() -> None:
    near = StressCondition(stressor="distance", level=30.0)
    (own,) = read_distance_by_earlier(near, 0)
    paper = next(each for each in stress(near, 0) if each["receiver"] == "paper")
    assert own == {name: paper[name] for name in own}
    one, many = read_distance_by_sequential(replace(near, level=20.0), 0)
    assert (one["receiver"], many["receiver"]) == ("sequential, 1 period", "sequential, 30 periods")
    assert (one["right"], many["right"]) == (15, 15)
    with pytest.raises(ValueError, match="stressor 'loss' has no range"):
        range_rows(StressCondition(stressor="loss", level=0.1), 0, {})


def test_pieces_of_clutter_are_those_of_the_other_receivers() -> None:
    assert [number for _, number in pieces(0.02)] == [0, 1, 2]
    rows = count_piece_by_sequential(Piece(scene_s=0.7, scenes=2), 1)
    assert [each["checksum"] for each in rows] == ["sum", "crc3"]
    assert {(each["clutter"], each["seconds"], each["receiver"]) for each in rows} == {
        ("mains and dimmer", 1.4, "sequential")
    }
    assert all(each["ids"] == each["passed"] <= each["structures"] <= each["looked_at"] for each in rows)
