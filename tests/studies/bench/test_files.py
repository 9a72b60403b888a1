"""The rows about files measure what they say, on a short stream."""

from __future__ import annotations

import pytest

from bicode_studies.bench import files
from bicode_studies.bench.timing import Timing


def test_each_format_is_read_and_written_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each piece of work that is timed reads as many events as were written, faery's as well as ours."""
    monkeypatch.setattr(files, "FILE_S", 0.05)
    counts: list[int] = []

    def run_once(repeats: int, *work: object) -> list[Timing]:
        counts.extend(piece() for piece in work)  # type: ignore[operator]
        return [Timing(cpu_s=0.5, wall_s=0.5, others=0.0, load=0.0) for _ in work]

    monkeypatch.setattr(files, "time_in_turn", run_once)
    monkeypatch.setattr(
        files.fresh_process, "time_fresh", lambda *arguments: Timing(cpu_s=1.0, wall_s=1.0, others=0.0, load=0.0)
    )
    monkeypatch.setattr(files, "_decode_row", lambda path, events: counts.append(events.size))
    rows = list(files.file_rows())
    *read, wrote, n_events = counts
    assert set(read) == {n_events}
    assert len(read) == len(files.READ_REACH) + len(files.FAERY_READS)
    assert wrote == 0  # no time was subtracted
    assert [row.name for row in rows[:-1]] == [f"read-{suffix[1:]}" for suffix in files.READ_REACH] + ["write-raw"]
    assert rows[0].measured == pytest.approx(n_events / 0.5 / 1e6)
