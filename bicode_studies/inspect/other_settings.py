"""Find the settings with which a recording can be read: rate, start, widths, checksum, convention and bit order.

Regions are searched for with frames of several lengths, since the bit rate is not known. In each region the edges of
the light tell the length of a bit: from one rise to the next there are two, three or four chips (half bits). The runs
without light tell the start and, by the time from one to the next, the length of a packet. What is left to try are the
shares of payload and checksum, the kind of the checksum, the convention and the bit order: the receiver's own decoder
reads the region with each.

One ID that repeats passes a checksum of three bits by chance with one wrong setting in eight. So several answers are
given; those that differ least from the settings that were tried, and those with a long checksum, come first.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from itertools import product

import numpy as np

from bicode_lab.boxes import Box
from bicode_lab.events import Events, join, no_events, slice_time
from bicode_lab.lights.name import name_region
from bicode_lab.marker import PacketFormat
from bicode_lab.marker.manchester import Convention
from bicode_lab.marker.packet import BitOrder, ChecksumKind
from bicode_lab.recognition import ReceiverSettings, count_on_off, decode_packets
from bicode_lab.recognition.chips import find_starts
from bicode_studies.inspect.light import (
    BINS_US,
    LEAST_PACKETS,
    RATES_HZ,
    bit_lengths_us,
    blinking_boxes,
    edges_of,
    events_inside,
)
from bicode_studies.inspect.lights import light_in_words

FIRST_S = 2.0
MOST_EVENTS = 6_000_000
READ_S = 0.6  # of a region, with each setting
MOST_ANSWERS = 4
COST_OF_CHANGE = 2.3  # bits: one setting in five is another than was given
AS_LIKELY = 4.0  # bits that another answer may be less likely than the first
KINDS: tuple[ChecksumKind, ...] = ("sum", "crc3")
CONVENTIONS: tuple[Convention, ...] = ("ieee", "thomas")
ORDERS: tuple[BitOrder, ...] = ("msb", "lsb")
BIN_SHARE = 0.25  # of a chip
LEAST_SHARE = 0.5  # of the packets that have to be read
ROUND_RATES = (1.0, 1.2, 1.25, 1.5, 1.6, 2.0, 2.4, 2.5, 3.0, 4.0, 4.8, 5.0, 6.0, 7.5, 8.0, 9.6)
NEAR = 0.012  # a rate that is so near to a round one is taken to be that one
LEAST_RUN_CHIPS = 3.0  # without light before a start; data are off for two chips at most


@dataclass(frozen=True, kw_only=True)
class Found:
    """Settings that read a region.

    Parameters
    ----------
    packet_format : PacketFormat
    payload : int
        The ID.
    n_read, n_packets : int
        How many of how many packets were read.
    box : Box
        The region [px].
    """

    packet_format: PacketFormat
    payload: int
    n_read: int
    n_packets: int
    box: Box


def find_settings(chunks: Iterable[Events], settings: ReceiverSettings) -> list[str]:
    """Try other settings on the first seconds of a recording, and say which read it.

    Parameters
    ----------
    chunks : iterable of ndarray of EVENT_DTYPE
        In the order of time; what comes after the first seconds is not asked for.
    settings : ReceiverSettings
        The settings from which the others differ as little as possible.

    Returns
    -------
    list of str
        Lines for the user.
    """
    events = _first_seconds(chunks)
    if not events.size:
        return ["nothing to try settings on: the recording holds no events"]
    seconds = (int(events["t"][-1]) - int(events["t"][0])) * 1e-6
    boxes = blinking_boxes(events, settings)
    head = f"looked at {events.size:,} events of the first {seconds:.2f} s"
    if not boxes:
        return [f"{head}: nothing blinks at any rate from {RATES_HZ[0]:g} to {RATES_HZ[-1]:g} Hz"]
    lines = [f"{head}: {len(boxes)} {'region blinks' if len(boxes) == 1 else 'regions blink'}"]
    for box in boxes:
        found = settings_that_read(events, box, settings)
        where = f"{box.w} x {box.h} px at ({box.x}, {box.y})"
        if not found:
            lines.append(f"{where}: {_why_not(events, box)}")
        for k, each in enumerate(found):
            options = as_options(each.packet_format, settings)
            given = options or "the settings that were given"
            read = f"ID {each.payload} in {each.n_read} of {each.n_packets} packets"
            lines.append(f"{where}: {'read' if k == 0 else 'or'} with {given} ({read})")
    return lines


def _first_seconds(chunks: Iterable[Events]) -> Events:
    """Return the events of the first seconds."""
    parts: list[Events] = []
    n = 0
    for chunk in chunks:
        parts.append(chunk)
        n += chunk.size
        if n > MOST_EVENTS or (chunk.size and chunk["t"][-1] - parts[0]["t"][0] > FIRST_S * 1e6):
            break
    return join(parts) if parts else no_events()


def settings_that_read(events: Events, box: Box, settings: ReceiverSettings) -> list[Found]:
    """Return the packet formats that read a region, the one that differs least from the settings first.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    box : Box
    settings : ReceiverSettings

    Returns
    -------
    list of Found
        Up to `MOST_ANSWERS`.
    """
    mine = events_inside(events, box)
    found: list[Found] = []
    for bit_us in (length for bin_us in BINS_US for length in bit_lengths_us(mine, bin_us)):
        for shape in _shapes(mine, bit_us):
            found += _readings(mine, box, shape, settings)
        if found:
            break
    given = replace(settings.packet_format, manchester=settings.conventions[0])
    found.sort(key=lambda each: (_doubt(each.packet_format, given), -each.n_read))
    best = _doubt(found[0].packet_format, given) if found else 0.0
    near = [each for each in found if _doubt(each.packet_format, given) <= best + AS_LIKELY]
    return near[:MOST_ANSWERS]


def _shapes(events: Events, bit_us: float) -> Iterator[PacketFormat]:
    """Yield packets with the rate, the start and the length that the runs without light tell."""
    bin_us = max(1, int(BIN_SHARE * bit_us / 2))
    chip_bins = bit_us / 2 / bin_us
    times, rises = edges_of(events, bin_us)
    starts = find_starts(times, rises, LEAST_RUN_CHIPS * chip_bins)
    starts = starts[starts > 0]
    if starts.size < 2:
        return
    # An off run has one or two chips more where its neighbours are off; a whole packet lies between two starts, and
    # many bits tell the length of one more exactly than a single bit does.
    run = float(np.median(times[starts] - times[starts - 1])) / chip_bins
    packet_us = float(np.median(np.diff(times[starts]))) * bin_us
    near = round(packet_us / bit_us)
    for bits in (near, near + 1, near - 1):
        for start_bits in sorted({int(run / 2 + 0.2), round(run / 2), int(run / 2 - 0.4)}):
            if 2 <= start_bits <= 64 and 2 <= bits - start_bits <= 40:
                yield PacketFormat(
                    f_id_hz=_rounded(bits / packet_us * 1e6),
                    start_bits=start_bits,
                    payload_bits=min(32, bits - start_bits - 1),
                    checksum_bits=max(1, bits - start_bits - 32),
                )


def _readings(events: Events, box: Box, shape: PacketFormat, settings: ReceiverSettings) -> list[Found]:
    """Read a region with all shares of payload and checksum, kinds, conventions and orders of one shape."""
    first, bin_us = int(events["t"][0]), max(1, int(shape.chip_us / 2))
    length_us = max(READ_S * 1e6, 8 * shape.packet_us)
    n_bins = int(min(length_us, int(events["t"][-1]) - first) / bin_us) + 1
    part = slice_time(events, first, first + n_bins * bin_us)
    n_on, n_off = count_on_off(part, box, first, n_bins, bin_us, settings.led_count)
    found = []
    for packet_format in _formats(shape):
        packets, _ = decode_packets(
            n_on, n_off, first, bin_us, packet_format, gate=settings.led_gate, latency_us=settings.latency_us
        )
        whole = [packet for packet in packets if packet.reason != "cut"]
        if not any(packet.payload is not None for packet in whole):
            break  # the bits of this shape are none, whatever they mean
        ids = [packet.payload for packet in whole if packet.checksum_ok and packet.payload is not None]
        if len(ids) < max(LEAST_PACKETS, LEAST_SHARE * len(whole)):
            continue
        values, counts = np.unique(ids, return_counts=True)
        most = int(np.argmax(counts))
        if counts[most] >= 0.9 * len(ids):
            found.append(
                Found(
                    packet_format=packet_format,
                    payload=int(values[most]),
                    n_read=int(counts[most]),
                    n_packets=len(whole),
                    box=box,
                )
            )
    return found


def _formats(shape: PacketFormat) -> Iterator[PacketFormat]:
    """Yield all packets of one shape, those with a checksum as the paper's first."""
    widths = sorted(range(1, 9), key=lambda width: abs(width - 3))
    for checksum_bits, kind, convention, order in product(widths, KINDS, CONVENTIONS, ORDERS):
        payload_bits = shape.data_bits - checksum_bits
        if 1 <= payload_bits <= 32 and (kind == "sum" or checksum_bits == 3):
            yield replace(
                shape,
                payload_bits=payload_bits,
                checksum_bits=checksum_bits,
                checksum=kind,
                manchester=convention,
                bit_order=order,
            )


def as_options(packet_format: PacketFormat, settings: ReceiverSettings) -> str:
    """Return the options of ``bicode decode`` that change the settings to a packet format.

    Parameters
    ----------
    packet_format : PacketFormat
    settings : ReceiverSettings

    Returns
    -------
    str
        Empty where nothing changes.

    Examples
    --------
    >>> as_options(PacketFormat(f_id_hz=500, manchester="thomas"), ReceiverSettings())
    '--f-id-hz 500 --manchester thomas --delta-t-whole-us 66000'
    """
    given = replace(settings.packet_format, manchester=settings.conventions[0])
    changed = [
        f"--{each.name.replace('_', '-')} {_shown(getattr(packet_format, each.name))}"
        for each in sorted(fields(PacketFormat), key=lambda field: field.name != "f_id_hz")
        if getattr(packet_format, each.name) != getattr(given, each.name)
    ]
    if settings.delta_t_whole_us < 2 * packet_format.packet_us:
        changed.append(f"--delta-t-whole-us {round(33 / 14 * packet_format.packet_us)}")
    return " ".join(changed)


def _why_not(events: Events, box: Box) -> str:
    """Say of a region that no settings read what light it is, and what would read it."""
    return f"no setting reads it; {light_in_words(name_region(events_inside(events, box)))}"


def _rounded(rate_hz: float) -> float:
    """Return the round rate that is near; the rate itself, with three digits, where there is none."""
    decade = 10.0 ** np.floor(np.log10(rate_hz))
    near = min(
        (each * scale for each in ROUND_RATES for scale in (decade, 10 * decade)), key=lambda r: abs(r - rate_hz)
    )
    return float(near if abs(near / rate_hz - 1) <= NEAR else float(f"{rate_hz:.3g}"))


def _doubt(packet_format: PacketFormat, given: PacketFormat) -> float:
    """Return how unlikely settings are [bit]: each that differs costs, and each bit of a checksum that fits pays."""
    differ = sum(getattr(packet_format, each.name) != getattr(given, each.name) for each in fields(PacketFormat))
    return COST_OF_CHANGE * differ - packet_format.checksum_bits if differ else -np.inf


def _shown(value: float | str) -> str:
    """Return a value as it is typed."""
    return f"{value:g}" if isinstance(value, float) else str(value)
