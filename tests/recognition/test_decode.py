"""Decoding of packets (Fig. 2, box g): what is encoded is decoded, at any phase, rate, width and convention."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bicode_lab.marker import LedWaveform, PacketFormat, encode_packet, manchester_decode
from bicode_lab.marker.packet import is_polarity_ambiguous
from bicode_lab.recognition import REASONS, Packet, decode_packets
from bicode_lab.recognition.chips import read_chips

PIXELS = 50


def counts(
    wave: LedWaveform, end_us: float, delta_t_us: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Count the ON and OFF pixels per bin from 0 to `end_us`.

    At each edge, PIXELS pixels fire after random latencies. These are those of a 1 kHz marker (from 20 us on with a
    tail to 150 us for ON, from 30 us on with a tail to 300 us for OFF). Faster markers get shorter ones, because how a
    sensor sees a fast marker is not tested here.
    """
    fast = min(1.0, wave.packet_format.chip_us / 500)
    n_on, n_off = np.zeros((2, int(end_us // delta_t_us)), int)
    times_us, levels = wave.steps(0, end_us)
    for t, level in zip(times_us[1:], levels[1:], strict=True):
        late = 20 + rng.gamma(2, 15, PIXELS) if level else 30 + rng.gamma(2, 40, PIXELS)
        bins = ((t + fast * late) // delta_t_us).astype(int)
        np.add.at(n_on if level else n_off, bins[bins < n_on.size], 1)
    return n_on, n_off


def read(wave: LedWaveform, delta_t_us: int, seed: int, **options: object) -> list[Packet]:
    n_on, n_off = counts(wave, 33 / 14 * wave.packet_format.packet_us, delta_t_us, np.random.default_rng(seed))
    packets, _ = decode_packets(n_on, n_off, 0, delta_t_us, wave.packet_format, **options)
    return packets


@pytest.mark.parametrize("both", [False, True], ids=["known", "auto"])
@pytest.mark.parametrize(("convention", "checksum"), list(itertools.product(["ieee", "thomas"], ["sum", "crc3"])))
def test_all_256_ids_at_random_phases(convention: str, checksum: str, both: bool) -> None:
    f = PacketFormat(manchester=convention, checksum=checksum)
    rng = np.random.default_rng(256)
    for payload in range(256):
        wave = LedWaveform(payload=payload, packet_format=f, phase_us=rng.uniform(0, f.packet_us))
        packets = read(wave, 250, payload, conventions=("ieee", "thomas") if both else None)
        assert {p.payload for p in packets if p.checksum_ok} == {payload}
        assert {p.reason for p in packets} <= {None, "cut"}


@given(payload=st.integers(0, 255), phase_us=st.floats(0, 14_000), seed=st.integers(0, 999))
def test_start_is_the_first_moment_of_the_off_time(payload: int, phase_us: float, seed: int) -> None:
    """The start is right to one bin and the latency of ON edges; the tails of OFF edges may move the fit by as much."""
    wave = LedWaveform(payload=payload, phase_us=phase_us)
    good = [p for p in read(wave, 250, seed) if p.checksum_ok]
    assert good
    for packet in good:
        late = (packet.start_us - phase_us + 7000) % 14_000 - 7000
        assert -125 <= late <= 250
        assert packet.end_us - packet.start_us == pytest.approx(14_000, rel=0.01)


@given(
    data=st.data(),
    width=st.integers(1, 32),
    start_bits=st.integers(2, 6),
    f_id_hz=st.floats(250, 10_000),
    checksum=st.sampled_from(["sum", "crc3"]),
    convention=st.sampled_from(["ieee", "thomas"]),
    order=st.sampled_from(["msb", "lsb"]),
)
@settings(max_examples=200)
def test_any_format(data: st.DataObject, width: int, start_bits: int, f_id_hz: float, checksum: str, convention: str, order: str) -> None:  # fmt: skip # noqa: E501
    f = PacketFormat(
        payload_bits=width, start_bits=start_bits, f_id_hz=f_id_hz, checksum=checksum, manchester=convention,
        bit_order=order,
    )  # fmt: skip
    payload = data.draw(st.integers(0, 2**width - 1))
    wave = LedWaveform(payload=payload, packet_format=f, phase_us=data.draw(st.floats(0, f.packet_us)))
    packets = read(wave, int(f.chip_us / 2), data.draw(st.integers(0, 99)))
    valid = {p.payload for p in packets if p.checksum_ok}
    bits, _ = manchester_decode(encode_packet(payload, f)[2 * start_bits :])
    if is_polarity_ambiguous(f) and len(set(bits.tolist())) == 1:
        assert valid == set()  # all bits alike: the same light, a chip later, is the other payload
        assert "conflict" in {p.reason for p in packets}
    else:
        assert valid == {payload}


@given(payload=st.integers(0, 255), phase_us=st.floats(0, 14_000), ppm=st.floats(-50_000, 50_000))
def test_clock_errors_up_to_five_percent(payload: int, phase_us: float, ppm: float) -> None:
    wave = LedWaveform(payload=payload, phase_us=phase_us, clock_error_ppm=ppm)
    assert {p.payload for p in read(wave, 250, 0) if p.checksum_ok} == {payload}


@given(payload=st.integers(0, 255), phase_us=st.floats(0, 14_000), delta_t=st.integers(20, 330))
def test_any_bin_up_to_two_thirds_of_a_chip(payload: int, phase_us: float, delta_t: int) -> None:
    wave = LedWaveform(payload=payload, phase_us=phase_us)
    assert {p.payload for p in read(wave, delta_t, 0) if p.checksum_ok} == {payload}


def test_a_bin_of_one_chip_loses_only_the_phases_where_two_edges_share_a_bin() -> None:
    """An OFF edge is seen 60 us later than an ON edge: in 12 % of phases it falls into the bin of the next ON edge."""
    rng = np.random.default_rng(0)
    n_right = 0
    for payload in range(256):
        good = {p.payload for p in read(LedWaveform(payload=payload, phase_us=rng.uniform(0, 14_000)), 500, payload) if p.checksum_ok}  # fmt: skip # noqa: E501
        assert good <= {payload}
        n_right += good == {payload}
    assert n_right > 0.8 * 256


@pytest.mark.parametrize(("delta_t_us", "most_ppm"), [(450, 0), (400, 30_000)])
def test_coarse_bins_are_read_with_and_without_a_clock_error(delta_t_us: int, most_ppm: float) -> None:
    """In bins of nearly a chip several grids of chips fit the edges.

    The nearest one is right most often, and so is the one with the smallest clock error. At 450 us 461 of 512 periods
    are read, 311 without the first preference and 380 without the second. Much more of either is worse, too.
    """
    n_right = 0
    for payload in range(256):
        rng = np.random.default_rng([payload, delta_t_us])
        ppm = rng.uniform(-most_ppm, most_ppm)
        wave = LedWaveform(payload=payload, phase_us=rng.uniform(0, 14_000), clock_error_ppm=ppm)
        for seed in range(2):
            good = {p.payload for p in read(wave, delta_t_us, 2 * payload + seed) if p.checksum_ok}
            assert good <= {payload}
            n_right += good == {payload}
    assert n_right > 0.8 * 512


def edges_of(payload: int, off_by_bins: float, chip_bins: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges of a packet's data [bins], all but the first moved by a part of a bin."""
    chips = encode_packet(payload, PacketFormat())
    at = np.flatnonzero(np.diff(chips.astype(int))) + 1
    times = 10 + at * chip_bins + off_by_bins * (np.arange(at.size) > 0)
    return times, chips[at] > 0


@pytest.mark.parametrize("payload", [0, 0x25, 255])
@pytest.mark.parametrize("off_by_chips", [-0.2, -0.1, 0.0, 0.1, 0.2])
def test_the_grid_lies_in_the_middle_of_its_edges(payload: int, off_by_chips: float) -> None:
    """The first edge is early or late by less than half a bin, so grids that lie farther off would be allowed, too."""
    nominal = 2.0
    times, rises = edges_of(payload, off_by_chips * nominal, nominal)
    _, chip, phase = read_chips(times, rises, 0, 25, nominal)
    mean = off_by_chips * nominal * (1 - 1 / rises.sum())  # over the ON edges, of which the first one is off
    assert chip == pytest.approx(nominal, rel=0.006)  # one step
    assert phase == pytest.approx(mean, abs=0.1 * nominal)


@pytest.mark.parametrize("off_at_chips", np.arange(1, 20) + 0.5)
def test_without_evidence_the_clock_is_nominal(off_at_chips: float) -> None:
    """One ON and one OFF edge fit every clock, since each polarity has a phase of its own."""
    times, rises = np.array([10.0, 10.0 + 2 * off_at_chips]), np.array([True, False])
    assert read_chips(times, rises, 0, 25, 2.0)[1] == 2.0


@pytest.mark.parametrize("payload", [0, 0x25, 255])
@pytest.mark.parametrize("delta_t_us", [125, 250, 500])
def test_a_packet_is_read_from_the_bin_in_which_its_data_end(payload: int, delta_t_us: int) -> None:
    """Edges come 10 us late. What follows the data must be dark as far as the counts show it, and no farther."""
    times_us, levels = LedWaveform(payload=payload, phase_us=0).steps(0, 30_000)
    n_on, n_off = (
        np.bincount(((times_us[1:][levels[1:] == level] + 10) // delta_t_us).astype(int), minlength=240)
        for level in (1, 0)
    )
    whole = 14_000 // delta_t_us
    for n_bins in (whole - 2, *range(whole, 17_000 // delta_t_us)):
        (packet, *_), _ = decode_packets(n_on[:n_bins], n_off[:n_bins], 0, delta_t_us, PacketFormat())
        if n_bins < whole:
            assert packet.reason == "cut"
        else:
            assert (packet.payload, packet.checksum_ok) == (payload, True)


def test_what_is_lit_after_its_data_is_no_packet() -> None:
    """The LED goes on again a chip after the data of a packet, where the start of the next one should be dark."""
    n_on, n_off = counts(LedWaveform(payload=0x25, phase_us=1000), 33_000, 250, np.random.default_rng(0))
    lit_us = 1000 + 14_000 + 600
    n_on[lit_us // 250] += PIXELS
    packets, _ = decode_packets(n_on[: 18_000 // 250], n_off[: 18_000 // 250], 0, 250, PacketFormat())
    assert packets[0].reason == "manchester"


@given(payload=st.integers(0, 255), phase_us=st.floats(0, 14_000))
def test_the_wrong_convention_never_passes(payload: int, phase_us: float) -> None:
    wave = LedWaveform(payload=payload, phase_us=phase_us)
    packets = read(wave, 250, 0, conventions=("thomas",))
    # All bits alike is the same light in both conventions, a chip apart, and then the same payload, too.
    assert {p.payload for p in packets if p.checksum_ok} <= ({0} if payload == 0 else set())


@given(shift=st.integers(0, 2**45), payload=st.integers(0, 255))
def test_a_shift_in_time_shifts_the_packets_and_nothing_else(shift: int, payload: int) -> None:
    n_on, n_off = counts(LedWaveform(payload=payload), 33_000, 250, np.random.default_rng(1))
    here, _ = decode_packets(n_on, n_off, 0, 250, PacketFormat())
    there, _ = decode_packets(n_on, n_off, shift, 250, PacketFormat())
    assert [p.start_us + shift for p in here] == [p.start_us for p in there]
    assert [p.payload for p in here] == [p.payload for p in there]


def test_reasons() -> None:
    f = PacketFormat()
    quiet = np.zeros(132, int)
    assert decode_packets(quiet, quiet, 0, 250, f) == ([], "no_events")
    flicker = np.tile([9, 0, 0, 0], 33)
    assert decode_packets(flicker, np.roll(flicker, 2), 0, 250, f) == ([], "no_start")
    n_on, n_off = counts(LedWaveform(payload=0x25, phase_us=1000), 33_000, 250, np.random.default_rng(0))
    whole, _ = decode_packets(n_on, n_off, 0, 250, f)
    assert [p.reason for p in whole] == [None, None, "cut"]
    missed = n_on.copy()
    missed[8_000 // 250 : 8_600 // 250] = 0
    assert decode_packets(missed, n_off, 0, 250, f)[0][0].reason == "manchester"
    other, _ = decode_packets(n_on, n_off, 0, 250, PacketFormat(checksum="crc3"))
    assert (other[0].reason, other[0].payload, other[0].checksum_ok) == ("checksum", 0x25, False)
    assert {p.reason for p in (*whole, *other)} - {None} <= set(REASONS)


def test_noise_gives_no_id() -> None:
    rng = np.random.default_rng(5)
    for _ in range(300):
        rate = rng.uniform(0.01, 3)
        packets, _ = decode_packets(rng.poisson(rate, 132), rng.poisson(rate, 132), 0, 250, PacketFormat())
        assert not any(p.checksum_ok for p in packets)
