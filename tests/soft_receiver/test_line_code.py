"""Line codes: what is encoded is decoded, and the trellis allows exactly what can be sent."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from bicode_lab.marker import PacketFormat
from bicode_lab.soft_receiver.line_code import BicodeLine, LineCode, Trellis, UartLine
from bicode_lab.soft_receiver.nodes import build_nodes
from bicode_lab.soft_receiver.viterbi import best_path

FORMATS = [
    PacketFormat(),
    PacketFormat(checksum="crc3", manchester="thomas"),
    PacketFormat(start_bits=2, payload_bits=5, checksum_bits=2, bit_order="lsb"),
]
CODES: list[LineCode] = [*(BicodeLine(packet_format=f) for f in FORMATS), UartLine(rate_hz=3125)]


def allowed(trellis: Trellis, chips: np.ndarray) -> bool:
    """Return whether some path from the first chip of a frame has these levels, by following all paths at once."""
    here = {i for i in range(trellis.level.size) if trellis.place[i] == 0}
    for k, level in enumerate(chips):
        if k:
            here = {i for i in range(trellis.level.size) if here & set(trellis.before[i][trellis.before[i] >= 0])}
        here = {i for i in here if trellis.level[i] == level}
    return bool(here)


@pytest.mark.parametrize("line", CODES, ids=str)
def test_every_value_comes_back_and_may_be_sent(line: LineCode) -> None:
    top = 128 if isinstance(line, UartLine) else 2**line.packet_format.payload_bits
    for value, checked in itertools.product(range(0, top, 5), (False, True)):
        chips = line.encode(value)
        assert line.decode(chips) == (value, True)
        assert chips.size == line.frame_chips
        assert tuple(chips[: len(line.start_chips)]) == line.start_chips
        assert allowed(line.trellis(checked), np.tile(chips, 2))


def test_a_checked_uart_path_forbids_odd_parity_and_only_that() -> None:
    line = UartLine(rate_hz=504)
    chips = line.encode(ord("S"))
    for k in range(1, 9):
        flipped = chips.copy()
        flipped[k] ^= 1
        assert not line.decode(flipped)[1]
        assert allowed(line.trellis(), flipped)
        assert not allowed(line.trellis(True), flipped)


@pytest.mark.parametrize("line", CODES[:3], ids=str)
def test_a_bit_that_does_not_switch_is_no_path(line: LineCode) -> None:
    chips = line.encode(0)
    chips[-1] ^= 1
    assert not allowed(line.trellis(), chips)


def test_either_convention_is_read_and_the_checksum_tells_which() -> None:
    both = BicodeLine(packet_format=PacketFormat(), conventions=("ieee", "thomas"))
    thomas = BicodeLine(packet_format=PacketFormat(manchester="thomas"))
    for value in range(256):
        assert both.decode(thomas.encode(value)) == (value, True)


@pytest.mark.parametrize("line", CODES, ids=str)
def test_best_path_is_the_best_of_all(line: LineCode) -> None:
    """The path is compared with every sequence of levels that the trellis allows, with random scores."""
    rng = np.random.default_rng(0)
    n, memory = 9, 3
    scores = rng.normal(size=(n, 1 << memory))
    nodes = build_nodes(line, memory)
    path, margins = best_path(scores, nodes)
    sums: dict[tuple[int, ...], float] = {}
    for start in range(nodes.context.size):
        paths = [([start], scores[0, nodes.context[start]])]
        for k in range(1, n):
            paths = [
                ([*old, j], total + scores[k, nodes.context[j]])
                for old, total in paths
                for j in range(nodes.context.size)
                if old[-1] in nodes.before[j]
            ]
        for nodes_of_path, total in paths:
            levels = tuple(int(c) & 1 for c in nodes.context[nodes_of_path])
            sums[levels] = max(total, sums.get(levels, -np.inf))
    best = max(sums, key=lambda levels: sums[levels])
    assert tuple(nodes.context[path] & 1) == best
    for k in range(n):
        other = [total for levels, total in sums.items() if levels[k] != best[k]]
        expected = sums[best] - max(other) if other else np.inf
        assert margins[k] == pytest.approx(expected)


@pytest.mark.parametrize("rate_hz", [0, -1, 1e7])
def test_impossible_rates_are_refused(rate_hz: float) -> None:
    with pytest.raises(ValueError, match="rate_hz"):
        UartLine(rate_hz=rate_hz)
