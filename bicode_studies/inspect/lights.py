"""Say in words what light a region holds, and which option of ``bicode decode`` would read it."""

from __future__ import annotations

from bicode_lab.lights.name import Kind, LightName

ROUND_NEAR = 0.003  # a rate so near to a round number is told as that
BAUDS = (300, 600, 1200, 2400, 4800, 9600, 19_200)
ODDS = 4.6  # natural logarithm of 99 to 1
WORDS: dict[Kind, str] = {
    "none": "too few events to tell what light it is",
    "noise": "its events come by chance; no light is seen to blink",
    "moving_edge": "an edge that moves over the pixels, and no light that blinks",
    "unknown": "a light of no kind that is known here",
}


def light_in_words(name: LightName) -> str:
    """Return what a light is, how sure that is, and what reads it.

    Parameters
    ----------
    name : LightName

    Returns
    -------
    str

    Examples
    --------
    >>> light_in_words(LightName(kind="uart", likely="uart", margin=12.0, rate_hz=3124.0))
    'UART at 3124 baud; --line-code uart --rate-hz 3124 reads it, if it is alone in the recording'
    >>> light_in_words(LightName(kind="unknown", likely="mains", margin=2.0, rate_hz=100.2))
    'not sure what light it is; most likely a lamp on the mains that flickers at 100.2 Hz (odds of 7 to 1)'
    """
    if name.kind == "unknown" and name.likely not in ("unknown", "none", "noise"):
        odds = f"odds of {round(2.718281828 ** max(name.margin, 0.0))} to 1"
        return f"not sure what light it is; most likely {_what(name)} ({odds})"
    if name.kind == "unknown" and name.rate_hz is not None and name.likely == "unknown":
        return f"a light that switches on a clock of {shown_hz(name.rate_hz)} Hz, in no code that is known here"
    if name.kind in WORDS:
        return WORDS[name.kind]
    option = _option(name)
    return _what(name) + (f"; {option}" if option else "")


def shown_hz(rate_hz: float) -> str:
    """Return a rate with four digits.

    Parameters
    ----------
    rate_hz : float
        [Hz]

    Returns
    -------
    str

    Examples
    --------
    >>> shown_hz(3124.4), shown_hz(100.04), shown_hz(9998.0)
    ('3124', '100', '9998')
    """
    return f"{float(f'{rate_hz:.4g}'):g}"


def _what(name: LightName) -> str:
    """Return the likeliest kind in words, with its rate."""
    rate = shown_hz(name.rate_hz or 0.0)
    duty = ""
    if name.duty is not None and name.duty_error is not None:
        duty = f", on for {name.duty:.0%} of the time (+- {name.duty_error:.0%})"
    return {
        "mains": f"a lamp on the mains that flickers at {rate} Hz",
        "pwm": f"a dimmer (PWM) at {rate} Hz{duty}",
        "constant_frequency": f"a light of constant frequency, {rate} Hz{duty}",
        "interval": f"the interval code with {rate} base periods a second",
        "bicode": f"Bicode at {rate} Hz",
        "uart": f"UART at {rate} baud",
    }.get(name.likely, WORDS.get(name.likely, name.likely))


def _option(name: LightName) -> str:
    """Return which option reads a light; empty if none does."""
    rate = shown_hz(name.rate_hz or 0.0)
    return {
        "bicode": f"try --f-id-hz {rate}, and --find for start, widths and checksum",
        "uart": f"--line-code uart --rate-hz {rate} reads it, if it is alone in the recording",
        "interval": f"--line-code interval --rate-hz {rate} reads it",
        "constant_frequency": "--line-code frequency reads it",
        "pwm": "--line-code frequency reads its rate",
    }.get(name.kind, "")
