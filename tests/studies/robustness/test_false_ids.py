"""IDs are counted where there is no marker; a marker would be counted, and the bound of the rate is the Poisson one."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import poisson

from bicode_lab.camera import Optics, PlacedMarker, Pose, Scene, Still, record
from bicode_lab.events import no_events
from bicode_lab.marker import Marker, PacketFormat
from bicode_studies.robustness.clutter import CLUTTER_KINDS
from bicode_studies.robustness.false_ids import (
    KIND_OF_PIECE,
    ClutterPiece,
    clutter_trials,
    count_ids,
    count_piece,
    rate_bound_hz,
    rates,
)

SMALL = Optics(width=64, height=48)


@pytest.mark.parametrize("count", [0, 1, 5, 40])
def test_at_the_bound_so_few_are_seen_once_in_twenty_times(count: int) -> None:
    assert poisson.cdf(count, rate_bound_hz(count, 7200) * 7200) == pytest.approx(0.05)


def test_none_in_three_hours_is_less_than_one_an_hour() -> None:
    assert 3600 * rate_bound_hz(0, 3 * 3600) == pytest.approx(-np.log(0.05) / 3)
    with pytest.raises(ValueError, match="seconds=0"):
        rate_bound_hz(0, 0)


@pytest.mark.parametrize("sent", ["sum", "crc3"])
def test_a_marker_is_counted_under_its_own_checksum_only(sent: str) -> None:
    marker = Marker(payload=0x25, packet_format=PacketFormat(checksum=sent))
    scene = Scene(markers=(PlacedMarker(marker=marker, path=Still(Pose.facing(10.0))),), optics=SMALL)
    counts = {(c.receiver, c.checksum): c for c in count_ids(record(scene, 0.5, 0), 0.5, SMALL.width, SMALL.height)}
    assert len(counts) == 4
    for (_, checksum), count in counts.items():
        assert count.structures >= 10  # each of 15 periods holds a packet
        assert (count.passed >= 10, count.ids >= 10) == (checksum == sent,) * 2
        assert count.ids <= count.looked_at
        assert count.zeros == 0


def test_an_even_dimmer_is_id_0_by_the_sum_and_nothing_by_the_crc() -> None:
    # Half a second of bits that are all 0, each behind the start: what a dimmer in a slow blink would send.
    scene = Scene(markers=(PlacedMarker(marker=Marker(payload=0), path=Still(Pose.facing(10.0))),), optics=SMALL)
    counts = {(c.receiver, c.checksum): c for c in count_ids(record(scene, 0.5, 0), 0.5, SMALL.width, SMALL.height)}
    assert counts["paper", "sum"].zeros == counts["paper", "sum"].ids > 0
    assert counts["paper", "crc3"].ids == 0 < counts["paper", "crc3"].structures


def test_no_events_are_no_ids() -> None:
    assert {(c.looked_at, c.structures, c.ids) for c in count_ids(no_events(), 60.0, 64, 48)} == {(0, 0, 0)}


def test_pieces_are_their_numbers_and_dimmers_are_looked_at() -> None:
    paper, soft = (ClutterPiece(receiver=receiver, scene_s=0.7, scenes=2) for receiver in ("paper", "soft"))
    first = pd.DataFrame(count_piece(paper, 1) + count_piece(soft, 1))
    pd.testing.assert_frame_equal(first, pd.DataFrame(count_piece(paper, 1) + count_piece(soft, 1)))
    assert first["events"].tolist() != [row["events"] for row in count_piece(paper, 3) + count_piece(soft, 3)]
    assert set(first["clutter"]) == {"mains and dimmer"}
    assert (first["seconds"] == 1.4).all()
    assert first.loc[first["receiver"] == "paper", "looked_at"].min() >= 10
    assert {CLUTTER_KINDS[turn] for turn in KIND_OF_PIECE} == set(CLUTTER_KINDS)


def test_hours_are_pieces_of_half_a_minute_for_each_receiver() -> None:
    trials = clutter_trials(0.02)
    assert [(piece.receiver, number) for piece, number in trials] == [
        (receiver, number) for number in range(3) for receiver in ("paper", "soft")
    ]
    assert len(clutter_trials(3.0, ["soft"])) == 360
    with pytest.raises(ValueError, match="--hours 0"):
        clutter_trials(0)


def test_rates_add_up_hours() -> None:
    row = {"receiver": "paper", "checksum": "sum", "seconds": 1800.0, "looked_at": 5, "structures": 2, "passed": 1}
    table = rates(pd.DataFrame([{**row, "ids": 1, "zeros": 0}, {**row, "ids": 2, "zeros": 1}]))
    assert table[["hours", "ids", "ids_per_hour", "zeros"]].to_numpy().tolist() == [[1.0, 3, 3.0, 1]]
    assert table["bound_per_hour"].item() == pytest.approx(7.754, abs=1e-3)  # Poisson's 95 % bound of 3
