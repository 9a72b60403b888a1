"""A stand-in for MicroPython's `machine` on an RP2040: a clock, and pins that remember what was set by hand."""

CLOCK_HZ = 125_000_000
set_by_hand = []  # (pin, value)


def freq():
    return CLOCK_HZ


class Pin:
    OUT = 1

    def __init__(self, number, mode=None, value=None):
        if not 0 <= number <= 29:
            raise ValueError("invalid pin")
        self.number = number
        if value is not None:
            set_by_hand.append((number, value))
