"""Counting IDs where there is no marker: the bound, the clutter, and that a marker would be counted."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import poisson

from bicode_lab.camera import Optics, PlacedMarker, Pose, Scene, Still, record
from bicode_lab.events import no_events
from bicode_lab.marker import Marker, PacketFormat
from bicode_studies.cli.main import main
from bicode_studies.robustness import clutter as module
from bicode_studies.robustness.clutter import (
    CLUTTER_KINDS,
    TURNS,
    clutter_scene,
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


@pytest.mark.parametrize("kind", CLUTTER_KINDS)
def test_clutter_holds_no_marker_and_makes_events(kind: str) -> None:
    rng = np.random.default_rng(3)
    scene = clutter_scene(kind, rng)
    assert scene.markers == ()
    assert scene.lamps
    assert (scene.wall is not None) == (kind == "moving edges")
    assert record(scene, 0.2, rng).size > 100


def test_pieces_are_their_numbers_and_dimmers_are_looked_at() -> None:
    first = count_piece(1, scene_s=0.7, scenes=2)
    pd.testing.assert_frame_equal(first, count_piece(1, scene_s=0.7, scenes=2))
    assert first["events"].tolist() != count_piece(3, scene_s=0.7, scenes=2)["events"].tolist()
    assert set(first["clutter"]) == {"mains and dimmer"}
    assert (first["seconds"] == 1.4).all()
    assert first.loc[first["receiver"] == "paper", "looked_at"].min() >= 10
    assert {CLUTTER_KINDS[turn] for turn in TURNS} == set(CLUTTER_KINDS)


def test_rates_add_up_hours() -> None:
    row = {"receiver": "paper", "checksum": "sum", "seconds": 1800.0, "looked_at": 5, "structures": 2, "passed": 1}
    table = rates(pd.DataFrame([{**row, "ids": 1, "zeros": 0}, {**row, "ids": 2, "zeros": 1}]))
    assert table[["hours", "ids", "ids_per_hour", "zeros"]].to_numpy().tolist() == [[1.0, 3, 3.0, 1]]
    assert table["bound_per_hour"].item() == pytest.approx(7.754, abs=1e-3)  # Poisson's 95 % bound of 3


def test_a_stopped_count_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from bicode_studies.cli import false_ids as command_false_ids
    from bicode_studies.cli import kept_rows

    asked = []

    def counted(number: int, receivers: list[str]) -> pd.DataFrame:
        asked.append((number, *receivers))
        return count_piece(number, receivers, scene_s=0.1, scenes=1).assign(seconds=30.0)

    monkeypatch.setattr(command_false_ids, "count_piece", counted)
    monkeypatch.setattr(kept_rows, "digest_of", lambda function, files: digest)
    digest = "a"
    out = tmp_path / "counts.csv"
    both = ("paper", "soft")
    runs = [
        ("0.01", "both", [(0, *both), (1, *both)]),
        ("0.02", "paper", [(2, "paper")]),
        ("0.02", "both", [(2, "soft")]),
        ("0.02", "both", []),
    ]
    for hours, receiver, missing in runs:
        asked.clear()
        with pytest.raises(SystemExit) as ended:
            main(["false-ids", "--hours", hours, "--receiver", receiver, "--out", str(out)])
        assert ended.value.code == 0
        assert asked == missing
    table = pd.read_csv(out)
    assert len(table) == 3 * 2 * len(module.CHECKSUMS)
    assert not table.duplicated(["piece", "receiver", "checksum"]).any()
    asked.clear()
    digest = "b"  # other code, such as another constant of the camera
    with pytest.raises(SystemExit):
        main(["false-ids", "--hours", "0.01", "--receiver", "paper", "--out", str(out)])
    assert asked == [(0, "paper"), (1, "paper")]
    assert set(pd.read_csv(out)["digest"]) == {"b"}
    out.write_bytes(b"\x00\xff no table")
    with pytest.raises(SystemExit) as ended:
        main(["false-ids", "--hours", "0.01", "--out", str(out)])
    assert ended.value.code == 2
