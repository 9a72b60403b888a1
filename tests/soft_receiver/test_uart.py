"""Reading text from a light: made here, and from public beacons."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bicode_lab.events import no_events
from bicode_lab.soft_receiver.line_code import UartLine
from bicode_lab.soft_receiver.uart import read_uart
from bicode_studies.cli.main import main

from .light import light_events

TEXT = "One word, one meaning; ~~~ and @@@ hold one level for long.\n"
# The poem the beacons send, over and over; only tests know it.
SONNET_18 = """Shall I compare thee to a summer's day?
Thou art more lovely and more temperate:
Rough winds do shake the darling buds of May,
And summer's lease hath all too short a date:
Sometime too hot the eye of heaven shines,
And often is his gold complexion dimm'd;
And every fair from fair sometime declines,
By chance or nature's changing course untrimm'd;
But thy eternal summer shall not fade
Nor lose possession of that fair thou owest;
Nor shall Death brag thou wander'st in his shade,
When in eternal lines to time thou growest:
So long as men can breathe or eyes can see,
So long lives this and this gives life to thee."""


@pytest.mark.parametrize(("rate_hz", "error_ppm"), [(504, 337), (3125, -1000), (3125, 1000)])
def test_text_with_pauses_is_read(rate_hz: float, error_ppm: float) -> None:
    rng = np.random.default_rng(0)
    line = UartLine(rate_hz=rate_hz)
    parts = [np.ones(15, np.uint8)]
    for letter in TEXT * 4:
        parts += [line.encode(ord(letter)), np.ones(rng.choice([0, 0, 0, 1, 7, 40]), np.uint8)]
    chips = np.concatenate([*parts, np.ones(5, np.uint8)])
    events = light_events(
        chips, line.chip_us, rng, phase_us=50, error_ppm=error_ppm, before=1, on_per_edge=20, off_per_edge=9,
        on_delay=0.2, off_delay=0.4, noise_hz=200,
    )  # fmt: skip
    letters = read_uart(events, line)
    assert "".join(letter.letter for letter in letters) == TEXT * 4
    assert all(letter.parity_ok for letter in letters)
    # Times are those of the start chips, up to a latency.
    at = np.cumsum([part.size for part in parts])[:-1:2]
    late = np.array([letter.t_us for letter in letters]) - 50 - at * line.chip_us * (1 + error_ppm * 1e-6)
    assert np.ptp(late) < 0.2 * line.chip_us
    assert np.abs(late).max() < line.chip_us


def test_nothing_is_read_in_nothing() -> None:
    assert read_uart(no_events(), UartLine(rate_hz=504)) == []
    one = light_events([1], 100.0, np.random.default_rng(0), on_per_edge=50)[:1]
    assert read_uart(one, UartLine(rate_hz=504)) == []


@pytest.mark.parametrize(
    ("name", "rate_hz", "n_letters", "least"), [("504hz_30m", 504, 264, 1.0), ("3125hz_30m", 3125, 618, 0.99)]
)
def test_public_beacons_are_read(
    real_recordings: Path,
    capsys: pytest.CaptureFixture[str],
    name: str,
    rate_hz: int,
    n_letters: int,
    least: float,
) -> None:
    """The poem is read from its beginning; the 504 baud file ends within letter 265, which is not returned."""
    file = real_recordings / "event_beacon" / f"{name}.mat"
    with pytest.raises(SystemExit) as ended:
        main(["decode", str(file), "--line-code", "uart", "--rate-hz", str(rate_hz), "--format", "jsonl"])
    assert ended.value.code == 0
    rows = [json.loads(row) for row in capsys.readouterr().out.splitlines()]
    assert all(set(row) == {"t_us", "letter", "parity_ok"} for row in rows)
    text = "".join(row["letter"] for row in rows)
    first = text.index("Shall I compare")
    read = text[first : first + len(SONNET_18)]
    assert len(read) == n_letters
    assert np.mean([a == b for a, b in zip(read, SONNET_18, strict=False)]) >= least
    # The part before it is the end of the same poem.
    ahead = text[: first - 1]
    assert np.mean([a == b for a, b in zip(ahead[::-1], SONNET_18[::-1], strict=False)]) >= least - 0.005
    assert np.mean([row["parity_ok"] for row in rows]) >= 0.95
