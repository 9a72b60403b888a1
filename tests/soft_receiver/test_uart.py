"""Reading text from a light: made here, and from public beacons."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from bicode_lab.events import Events, make_events, no_events
from bicode_lab.soft_receiver.line_code import UartLine
from bicode_lab.soft_receiver.uart import MOST_CHIPS, read_text, read_uart
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


def text_events(rng: np.random.Generator, rate_hz: float = 1000, *, n: int = 150, **light: float) -> tuple[str, Events]:
    """Return a random text that is sent without a pause, and its events."""
    line = UartLine(rate_hz=rate_hz)
    text = "".join(map(chr, rng.integers(32, 127, n)))
    chips = np.concatenate([np.ones(9, np.uint8), *(line.encode(ord(letter)) for letter in text), np.ones(9, np.uint8)])
    return text, light_events(chips, line.chip_us, rng, before=1, **light)


@pytest.mark.parametrize("seed", range(3))
def test_strong_edges_and_a_few_stray_events_are_read_without_an_error(seed: int) -> None:
    """Edges of 40 and 30 events within a fiftieth of a chip, 50 stray events per second."""
    text, events = text_events(
        np.random.default_rng(seed), 500, on_per_edge=40, off_per_edge=30, on_delay=0.02, off_delay=0.02, noise_hz=50
    )
    reading = read_text(events, UartLine(rate_hz=500))
    assert "".join(character.letter for character in reading.characters) == text
    assert reading.warning is None
    assert min(character.sure for character in reading.characters) > 0.99
    assert reading.check.explained > 0.95


def no_text(kind: str, rng: np.random.Generator) -> Events:
    """Return events of something that sends no text."""
    if kind.startswith("text"):
        return text_events(rng, float(kind[5:]))[1]
    if kind == "noise":
        t, p = rng.uniform(0, 3e6, 3000), rng.integers(0, 2, 3000)
    elif kind == "lamp":
        t = np.repeat(np.arange(600) * 5000.0, 10) + rng.normal(900, 300, 6000)
        p = np.repeat(np.arange(600) % 2, 10)
    else:  # a light that switches at random
        levels = rng.integers(0, 2, 3000)
        at = np.flatnonzero(np.diff(levels)) + 1
        t, p = np.repeat(at * 1000.0, 8) + rng.gamma(4, 60, 8 * at.size), np.repeat(levels[at], 8)
    order, zeros = np.argsort(t), np.zeros(t.size, int)
    return make_events(zeros, zeros, p[order], np.maximum(t[order], 0).astype(np.int64))


@pytest.mark.parametrize("kind", ["noise", "lamp", "random", "text 500", "text 1300", "text 2000"])
def test_what_sends_no_text_of_this_rate_is_no_reading(kind: str) -> None:
    reading = read_text(no_text(kind, np.random.default_rng(4)), UartLine(rate_hz=1000))
    assert reading.characters == ()
    assert reading.warning == f"no reading: {reading.check.reason}"
    assert reading.check.held < 0.7
    assert "are needed" in (reading.check.reason or "")


def test_a_stretch_that_cannot_be_read_is_left_out() -> None:
    rng = np.random.default_rng(5)
    text, events = text_events(rng, n=300, on_per_edge=20, off_per_edge=15)
    middle = (events["t"] > 1_300_000) & (events["t"] < 2_000_000)
    t = np.where(middle, rng.uniform(1_300_000, 2_000_000, events.size), events["t"])
    p = np.where(middle, rng.integers(0, 2, events.size), events["p"])
    order, zeros = np.argsort(t), np.zeros(events.size, int)
    reading = read_text(make_events(zeros, zeros, p[order], t[order].astype(np.int64)), UartLine(rate_hz=1000))
    given = "".join(character.letter for character in reading.characters)
    assert given[:100] == text[:100]
    assert given[-90:] == text[-90:]
    assert reading.left_out > 20
    assert "left out" in (reading.warning or "")
    inside = [c for c in reading.characters if 1_400_000 < c.t_us < 1_900_000]
    assert not inside


def test_the_sure_letters_of_a_faint_light_are_the_right_ones() -> None:
    """The mean of `sure` is near the share of letters that are right."""
    text, events = text_events(np.random.default_rng(6), n=1500, on_per_edge=3, off_per_edge=3, noise_hz=20)
    characters = read_uart(events, UartLine(rate_hz=1000))
    sent = (9 + 11 * np.arange(len(text))) * 1000.0
    at = np.array([int(np.argmin(np.abs(sent - c.t_us))) for c in characters])
    right = np.array([c.letter == text[k] for c, k in zip(characters, at, strict=True)])
    sure = np.array([c.sure for c in characters])
    assert 0.8 < right.mean() < 0.99
    assert sure.mean() == pytest.approx(right.mean(), abs=0.06)
    assert right[sure > 0.99].mean() > right[sure < 0.9].mean() + 0.15


def test_times_of_another_unit_are_refused() -> None:
    zeros = np.zeros(50, int)
    events = make_events(zeros, zeros, zeros, np.arange(50) * 10**12)
    with pytest.raises(ValueError, match=f"give up to {MOST_CHIPS:,} chips"):
        read_uart(events, UartLine(rate_hz=500))


def test_the_command_says_why_there_is_no_reading(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    events = no_text("noise", np.random.default_rng(7))
    savemat(tmp_path / "noise.mat", {"event": 2.0 * events["p"] - 1, "event_t": events["t"] * 1e-6})
    with pytest.raises(SystemExit):
        main(["decode", str(tmp_path / "noise.mat"), "--line-code", "uart", "--rate-hz", "1000", "--format", "jsonl"])
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("no reading: start, stop and parity hold in") == 1


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
    assert all(set(row) == {"t_us", "letter", "parity_ok", "sure"} for row in rows)
    text = "".join(row["letter"] for row in rows)
    first = text.index("Shall I compare")
    read = text[first : first + len(SONNET_18)]
    assert len(read) == n_letters
    assert np.mean([a == b for a, b in zip(read, SONNET_18, strict=False)]) >= least
    # The part before it is the end of the same poem.
    ahead = text[: first - 1]
    assert np.mean([a == b for a, b in zip(ahead[::-1], SONNET_18[::-1], strict=False)]) >= least - 0.005
    assert np.mean([row["parity_ok"] for row in rows]) >= 0.95
