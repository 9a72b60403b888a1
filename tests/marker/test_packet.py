"""Tests of the packet: laws over all settings, and the paper's arithmetic by enumeration."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.marker import LedWaveform, PacketFormat, encode_packet, manchester_decode, manchester_encode
from bicode_lab.marker.packet import checksum, decode_data_bits, is_polarity_ambiguous, payload_to_bits

PAPER = PacketFormat()
BOTH_CHECKSUMS = [PAPER, PacketFormat(checksum="crc3")]


@st.composite
def formats(draw):
    kind = draw(st.sampled_from(["sum", "crc3"]))
    return PacketFormat(
        start_bits=draw(st.integers(2, 64)),
        payload_bits=draw(st.integers(1, 32)),
        checksum=kind,
        checksum_bits=3 if kind == "crc3" else draw(st.integers(1, 8)),
        f_id_hz=draw(st.floats(1, 100_000)),
        manchester=draw(st.sampled_from(["ieee", "thomas"])),
        bit_order=draw(st.sampled_from(["msb", "lsb"])),
    )


@st.composite
def formats_and_payloads(draw):
    packet_format = draw(formats())
    return packet_format, draw(st.integers(0, 2**packet_format.payload_bits - 1))


def longest_off_run(chips) -> int:
    """Return the length of the longest run of zeros in chips."""
    return max(len(run) for run in "".join(map(str, np.asarray(chips))).split("1"))


# -- laws over all settings


@given(formats_and_payloads())
def test_decode_undoes_encode(case):
    packet_format, payload = case
    chips = encode_packet(payload, packet_format)
    assert chips.shape == (2 * packet_format.packet_bits,)
    assert not chips[: 2 * packet_format.start_bits].any()
    bits, valid = manchester_decode(chips[2 * packet_format.start_bits :], packet_format.manchester)
    assert valid.all()
    assert decode_data_bits(bits, packet_format) == (payload, True)


@given(st.lists(st.integers(0, 1), max_size=60), st.sampled_from(["ieee", "thomas"]))
def test_manchester_switches_in_every_bit_and_comes_back(bits, convention):
    chips = manchester_encode(bits, convention)
    other = "thomas" if convention == "ieee" else "ieee"
    assert (chips[0::2] + chips[1::2] == 1).all()
    assert longest_off_run(chips) <= 2  # two chips, one bit
    np.testing.assert_array_equal(manchester_encode(bits, other), 1 - chips)
    found, valid = manchester_decode(chips, convention)
    assert found.tolist() == bits
    assert valid.all()
    inverted, _ = manchester_decode(chips, other)
    assert inverted.tolist() == [1 - bit for bit in bits]


@given(st.lists(st.integers(0, 1), max_size=40).filter(lambda chips: len(chips) % 2 == 0))
def test_a_bit_is_valid_exactly_where_it_switches(chips):
    _, valid = manchester_decode(chips)
    assert valid.tolist() == [a != b for a, b in zip(chips[0::2], chips[1::2], strict=True)]


@given(formats_and_payloads())
def test_the_other_bit_order_is_payload_and_checksum_reversed(case):
    packet_format, payload = case
    width = packet_format.payload_bits
    chips = {o: encode_packet(payload, replace(packet_format, bit_order=o)) for o in ("msb", "lsb")}
    bits = {
        o: manchester_decode(c[2 * packet_format.start_bits :], packet_format.manchester)[0] for o, c in chips.items()
    }
    np.testing.assert_array_equal(bits["lsb"][:width], bits["msb"][:width][::-1])
    np.testing.assert_array_equal(bits["lsb"][width:], bits["msb"][width:][::-1])


@given(formats_and_payloads())
def test_lengths_add_up(case):
    packet_format, _ = case
    # packet_bits bit times of 1/f_ID each; the rate is payload over that time.
    assert packet_format.packet_us == pytest.approx(1e6 * packet_format.packet_bits / packet_format.f_id_hz)
    assert packet_format.payload_rate_bps * packet_format.packet_us * 1e-6 == pytest.approx(packet_format.payload_bits)


# -- the paper's arithmetic (III-A)


def test_eight_bits_in_14_ms_are_571_bits_a_second():
    assert (PAPER.start_bits, PAPER.payload_bits, PAPER.checksum_bits) == (3, 8, 3)
    assert PAPER.packet_us == 14_000
    assert PAPER.chip_us == 500
    assert round(PAPER.payload_rate_bps) == 571


def test_the_payload_of_fig_6_is_sent_as_printed():
    assert "".join(map(str, payload_to_bits(0x25, PAPER))) == "00100101"


def test_any_period_holds_one_or_two_whole_packets():
    # Every whole microsecond of phase u: packets begin at u, u + 14 ms, ..; two are whole where u + 28 <= 33.
    counts = []
    for phase_us in range(14_000):
        starts = LedWaveform(payload=0x25, phase_us=phase_us).packet_starts(0, 33_000)
        counts.append(np.count_nonzero(starts + 14_000 <= 33_000))
    assert set(counts) == {1, 2}
    two = np.mean(np.array(counts) == 2)
    assert two == 5001 / 14_000
    assert (round(two, 2), round(1 - two, 2)) == (0.36, 0.64)


@pytest.mark.parametrize("manchester", ["ieee", "thomas"])
@pytest.mark.parametrize("packet_format", BOTH_CHECKSUMS, ids=lambda f: f.checksum)
def test_the_start_stands_out_in_all_256_ids(packet_format, manchester):
    packet_format = replace(packet_format, manchester=manchester)
    gaps = set()
    for payload in range(256):
        chips = encode_packet(payload, packet_format)
        assert longest_off_run(chips[6:]) <= 2
        wire = np.roll(np.tile(chips, 2), -20)  # packet after packet, the gap whole inside
        gaps.add(longest_off_run(wire))
    assert min(gaps) == 6  # 3.0 ms
    assert max(gaps) == 8  # 4.0 ms


# -- the checksums


def crc3_by_polynomials(payload: int, width: int) -> int:
    """Compute the CRC-3 by numpy's polynomial division over the integers, modulo 2, with final xor 7."""
    bits = [(payload >> i) & 1 for i in range(width - 1, -1, -1)]
    rest = np.polydiv(np.array([*bits, 0, 0, 0], float), np.array([1.0, 0.0, 1.0, 1.0]))[1]
    low = [0, 0, 0, *(round(c) % 2 for c in rest)][-3:]
    return (low[0] << 2 | low[1] << 1 | low[2]) ^ 7


@pytest.mark.parametrize("width", [1, 2, 3, 4, 8, 11])
def test_crc3_equals_polynomial_division(width):
    packet_format = PacketFormat(payload_bits=width, checksum="crc3")
    for payload in range(2**width):
        assert checksum(payload, packet_format) == crc3_by_polynomials(payload, width)


@given(st.integers(1, 32).flatmap(lambda w: st.tuples(st.just(w), st.integers(0, 2**w - 1))), st.integers(1, 8))
def test_sum_counts_ones(case, bits):
    width, payload = case
    packet_format = PacketFormat(payload_bits=width, checksum_bits=bits)
    assert checksum(payload, packet_format) == bin(payload).count("1") % 2**bits


@pytest.mark.parametrize("dtype", [np.int64, np.int32, np.uint8])
@pytest.mark.parametrize("kind", ["sum", "crc3"])
def test_a_numpy_payload_has_the_checksum_of_the_same_int(kind, dtype):
    packet_format = PacketFormat(checksum=kind)
    assert [checksum(n, packet_format) for n in np.arange(256).astype(dtype)] == [
        checksum(n, packet_format) for n in range(256)
    ]


def passing_share(packet_format: PacketFormat, flips: int) -> float:
    """Return the share of all patterns of so many flipped bits, over all payloads, that pass the checksum."""
    n = packet_format.data_bits
    masks = np.array([sum(1 << i for i in chosen) for chosen in combinations(range(n), flips)])
    checks = np.array([checksum(p, packet_format) for p in range(2**packet_format.payload_bits)])
    words = (np.arange(checks.size) << packet_format.checksum_bits) | checks
    received = words[:, None] ^ masks
    low = (1 << packet_format.checksum_bits) - 1
    return float(np.mean(checks[received >> packet_format.checksum_bits] == received & low))


@pytest.mark.parametrize(
    ("kind", "two", "three"),
    [("sum", 0.33, 0.05), ("crc3", 0.07, 0.16)],
)
def test_what_the_checksums_let_through(kind, two, three):
    packet_format = PacketFormat(checksum=kind)
    assert passing_share(packet_format, 1) == 0
    assert round(passing_share(packet_format, 2), 2) == two
    assert round(passing_share(packet_format, 3), 2) == three


# -- the convention found from the data


@pytest.mark.parametrize("packet_format", BOTH_CHECKSUMS, ids=lambda f: f.checksum)
@pytest.mark.parametrize("sent", ["ieee", "thomas"])
def test_the_wrong_convention_never_passes_for_8_bits(packet_format, sent):
    read = "thomas" if sent == "ieee" else "ieee"
    for payload in range(256):
        chips = encode_packet(payload, replace(packet_format, manchester=sent))
        bits, valid = manchester_decode(chips[6:], read)
        assert valid.all()
        found, passes = decode_data_bits(bits, packet_format)
        assert found == 255 - payload
        assert not passes


@pytest.mark.parametrize("order", ["msb", "lsb"])
@pytest.mark.parametrize(("kind", "bits"), [("sum", 1), ("sum", 2), ("sum", 3), ("sum", 4), ("crc3", 3)])
def test_ambiguity_by_brute_force(kind, bits, order):
    for width in range(1, 13):
        packet_format = PacketFormat(payload_bits=width, checksum=kind, checksum_bits=bits, bit_order=order)
        passes = set()
        for payload in range(2**width):
            data = manchester_decode(encode_packet(payload, packet_format)[6:])[0]
            passes.add(decode_data_bits(1 - data, packet_format)[1])
            if len(passes) > 1:
                break
        assert passes == {is_polarity_ambiguous(packet_format)}, (width, kind, bits)


# -- misuse: the value, the rule, the way out


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"start_bits": 1}, ["start_bits=1", "2 .. 64"]),
        ({"start_bits": 65}, ["start_bits=65", "2 .. 64"]),
        ({"payload_bits": 0}, ["payload_bits=0", "1 .. 32"]),
        ({"payload_bits": 33}, ["payload_bits=33", "1 .. 32"]),
        ({"checksum": "md5"}, ["'md5'", "'sum' or 'crc3'"]),
        ({"checksum_bits": 9}, ["checksum_bits=9", "1 .. 8"]),
        ({"checksum": "crc3", "checksum_bits": 4}, ["checksum_bits=4", "CRC-3", "choose 3"]),
        ({"f_id_hz": 0.0}, ["f_id_hz=0.0", "0 .. 100000"]),
        ({"f_id_hz": float("nan")}, ["f_id_hz=nan"]),
        ({"manchester": "miller"}, ["'miller'", "'ieee' or 'thomas'"]),
        ({"bit_order": "big"}, ["'big'", "'msb' or 'lsb'"]),
    ],
)
def test_settings_that_cannot_be_are_refused(settings, words):
    with pytest.raises(ValueError) as refused:
        PacketFormat(**settings)
    assert all(word in str(refused.value) for word in words), refused.value


def test_wrong_input_is_refused():
    with pytest.raises(ValueError, match=r"payload=256 does not fit payload_bits=8; choose 0 \.\. 255"):
        encode_packet(256, PAPER)
    with pytest.raises(ValueError, match="payload=-1"):
        encode_packet(-1, PAPER)
    with pytest.raises(ValueError, match=r"3 chips .* even"):
        manchester_decode([0, 1, 0])
    with pytest.raises(ValueError, match="payload and checksum are 11"):
        decode_data_bits(np.zeros(8, int), PAPER)
