"""What a light is, in words, and the option that reads it."""

from __future__ import annotations

import pytest

from bicode_lab.lights.name import LightName
from bicode_studies.inspect.lights import light_in_words


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("none", "too few events"),
        ("noise", "come by chance"),
        ("moving_edge", "moves over the pixels"),
        ("mains", "a lamp on the mains that flickers at 1234 Hz"),
        ("pwm", "a dimmer (PWM) at 1234 Hz, on for 25% of the time (+- 2%)"),
        ("constant_frequency", "--line-code frequency"),
        ("interval", "--line-code interval --rate-hz 1234"),
        ("bicode", "--f-id-hz 1234"),
        ("uart", "--line-code uart --rate-hz 1234"),
    ],
)
def test_every_kind_has_words(kind, words: str) -> None:  # type: ignore[no-untyped-def]
    name = LightName(kind=kind, likely=kind, margin=9, rate_hz=1234.4, duty=0.25, duty_error=0.02)
    assert words in light_in_words(name)


def test_what_is_not_sure_is_said_so() -> None:
    name = LightName(kind="unknown", likely="bicode", margin=1.1, rate_hz=500)
    assert light_in_words(name) == "not sure what light it is; most likely Bicode at 500 Hz (odds of 3 to 1)"
    unknown = LightName(kind="unknown", likely="unknown", margin=9, rate_hz=500)
    assert "clock of 500 Hz, in no code that is known here" in light_in_words(unknown)
