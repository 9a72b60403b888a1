"""The times of LED edges, against the transmitter's own waveform."""

import numpy as np
import pytest

from bicode_lab.marker import LedWaveform, PacketFormat
from bicode_lab.pose import fit_clock
from bicode_lab.recognition.decode import Packet


def read(payload: int, start_us: float, length_us: float = 14_000, **changes: object) -> Packet:
    values: dict[str, object] = {"payload": payload, "checksum_ok": True, "reason": None, "manchester": "ieee"}
    return Packet(
        start_us=round(start_us),
        end_us=round(start_us + length_us),
        edge_us=round(start_us) + 3000,
        **{**values, **changes},  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("payload", [0, 0x25, 255])
@pytest.mark.parametrize("convention", ["ieee", "thomas"])
def test_edges_are_those_of_the_waveform(payload: int, convention: str) -> None:
    packet_format = PacketFormat(manchester=convention)  # type: ignore[arg-type]
    wave = LedWaveform(payload=payload, packet_format=packet_format, phase_us=2000, clock_error_ppm=300)
    starts = wave.packet_starts(0, 100_000)[[0, 2, 5]]
    # The format of the settings may differ: the convention that the packets were read with counts.
    clock = fit_clock([read(payload, t, manchester=convention) for t in starts], payload, PacketFormat())
    assert clock is not None
    times, rises = clock.edges(1000, 80_000)
    true_times, levels = wave.steps(1000, 80_000)
    np.testing.assert_allclose(times, true_times[1:], atol=3)
    np.testing.assert_array_equal(rises, levels[1:] > 0)


def test_packets_of_others_are_left_out() -> None:
    packets = [read(37, 100), read(38, 9_000), read(37, 7_000, checksum_ok=False), read(37, 28_106)]
    clock = fit_clock(packets, 37, PacketFormat())
    assert clock is not None
    assert clock.start_us == pytest.approx(100)
    assert clock.packet_us == pytest.approx(14_003)
    assert fit_clock(packets, 39, PacketFormat()) is None


def test_one_packet_gives_its_own_length() -> None:
    clock = fit_clock([read(37, 100, 14_010)], 37, PacketFormat())
    assert clock is not None
    assert (clock.start_us, clock.packet_us) == (100, 14_010)


def test_the_span_of_edges_begins_at_its_start_and_ends_before_its_end() -> None:
    clock = fit_clock([read(37, 0)], 37, PacketFormat())
    assert clock is not None
    times, _ = clock.edges(0, 14_000)
    inner, _ = clock.edges(float(times[0]), float(times[-1]))
    np.testing.assert_array_equal(inner, times[:-1])
