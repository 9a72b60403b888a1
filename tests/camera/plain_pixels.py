"""An oracle for the kernels: pixels followed one by one, crossing by crossing, in plain Python."""

import math


def follow(light, model, edges, noise, level, reference, free, on, off):
    """Follow one pixel through stretches of constant light.

    A pixel's level follows the log of its light, and noise, through a first-order low-pass whose time constant
    falls as one over the light. Where it is a threshold away from its reference, it fires and is in reset for
    the dead time; the level at the end of that is its new reference.

    Parameters
    ----------
    light, noise : one number for each stretch
        Signal, and what is added to its logarithm.
    model : PixelModel
    edges : one number more
        Where stretches begin and end [us].

    Returns
    -------
    events : list of (polarity, time [us])
    level, reference, free : float
        As they are at the end.
    """
    events = []
    for signal, drift, start, end in zip(light, noise, edges[:-1], edges[1:], strict=True):
        aim, tau, t = math.log(signal) + drift, model.time_constant_us / signal, start
        while True:
            if free > t:  # in reset
                if free >= end:
                    break
                level = aim + (level - aim) * math.exp((t - free) / tau)
                reference, t = level, free
            if aim - reference > on:
                wanted, polarity, delay = reference + on, 1, model.latency_on_us
            elif reference - aim > off:
                wanted, polarity, delay = reference - off, 0, model.latency_off_us
            else:
                break
            ratio = (level - aim) / (wanted - aim)
            crossing = t + tau * math.log(ratio) if ratio > 1 else t
            if crossing >= end:
                break
            events.append((polarity, crossing + delay))
            level, t, free = (wanted if ratio > 1 else level), crossing, crossing + model.refractory_us
            if free == t:  # no reset to wait for
                reference = level
        level = aim + (level - aim) * math.exp((t - end) / tau)
    return events, level, reference, free
