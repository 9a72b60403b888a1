"""The lines of Fig. 5 and 6 hold the data they are given, and the texts say what was sent."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from bicode_lab.marker import LedWaveform, PacketFormat, encode_packet, manchester_decode
from bicode_studies.plots import (
    draw_decoding,
    draw_events,
    draw_led,
    draw_on_off,
    draw_packet,
    draw_pixel_events,
    packet_spans,
)


@pytest.fixture
def ax():
    return Figure().add_subplot()


def words(spans):
    return "".join(text for _, _, text in spans)


@pytest.mark.parametrize("convention", ["ieee", "thomas"])
@pytest.mark.parametrize("payload", [0x00, 0x25, 0xFF])
def test_spans_say_what_is_sent(payload, convention):
    packet_format = PacketFormat(manchester=convention, f_id_hz=2000)
    spans = packet_spans(payload, packet_format, start_us=100.0)
    chips = encode_packet(payload, packet_format)
    assert words(spans.chips) == "".join(map(str, chips))
    bits, _ = manchester_decode(chips[2 * packet_format.start_bits :], convention)
    assert words(spans.bits) == "".join(map(str, bits))
    assert spans.parts[0][0] == spans.chips[0][0] == 100
    assert spans.parts[-1][1] == spans.bits[-1][1] == spans.chips[-1][1] == 100 + packet_format.packet_us


def test_spans_follow_a_transmitter_whose_clock_is_off():
    wave = LedWaveform(payload=0x25, clock_error_ppm=-20_000)
    spans = packet_spans(0x25, wave.packet_format, chip_us=wave.chip_us)
    assert spans.parts[-1][1] == pytest.approx(wave.packet_us)


def test_the_led_keeps_its_steps(ax):
    times, levels = LedWaveform(payload=0xFF).steps(0, 5000)
    draw_led(times, levels, ax, end_us=5000)
    drawn = ax.lines[0].get_xydata()
    np.testing.assert_allclose(drawn[:, 0], [0, 3.5, 4, 4.5, 5])
    np.testing.assert_array_equal(drawn[:, 1], [0, 1, 0, 1, 1])
    assert ax.get_xlabel() == "time (ms)"


def test_the_events_of_a_pixel_are_strokes_up_and_down(ax):
    draw_pixel_events([1000, 2000, 2500], [1, 0, 1], ax)
    on, off = (collection.get_segments() for collection in ax.collections)
    np.testing.assert_allclose([s[:, 0] for s in on], [[1, 1], [2.5, 2.5]])
    np.testing.assert_allclose([s[:, 1] for s in on], [[0, 1], [0, 1]])
    np.testing.assert_allclose(off[0], [[2, -1], [2, 0]])


def test_events_are_dots_by_polarity(ax):
    draw_events([1000, 2000, 3000], [7, 8, 9], [0, 1, 0], ax)
    np.testing.assert_array_equal(ax.lines[0].get_xydata(), [[1, 7], [3, 9]])
    np.testing.assert_array_equal(ax.lines[1].get_xydata(), [[2, 8]])
    assert ax.get_ylabel() == "x (px)"


@pytest.mark.parametrize("draw", [draw_pixel_events, lambda t, p, ax: draw_events(t, [], p, ax)])
def test_no_events_are_legal(draw, ax):
    assert draw([], [], ax) is ax


def test_counts_stand_at_the_middles_of_their_bins(ax):
    draw_on_off([3, 0], [0, 5], ax, start_us=1000, delta_t_us=500, unit="events")
    np.testing.assert_allclose(ax.lines[0].get_xydata(), [[1.25, 3], [1.75, 0]])
    np.testing.assert_allclose(ax.lines[1].get_xydata(), [[1.25, 0], [1.75, 5]])
    assert ax.get_ylabel() == "total in the region (events)"


def test_decoding_has_the_look_of_fig_6(ax):
    n_on, n_off = np.arange(60) % 7, np.arange(60) % 5
    wave = LedWaveform(payload=0x25)
    times, levels = wave.steps(0, 15_000)
    spans = packet_spans(0x25, wave.packet_format)
    draw_decoding(n_on, n_off, ax, led_times_us=times, led_levels=levels, packets=[spans])
    on, off = ax.lines[:2]
    np.testing.assert_array_equal(on.get_ydata(), n_on)
    np.testing.assert_array_equal(off.get_ydata(), n_off)
    assert (on.get_linestyle(), on.get_color(), off.get_linestyle()) == ("-", "black", "--")
    light = ax.get_figure().axes[1].lines[0]
    np.testing.assert_allclose(light.get_xdata()[:-1], times / 1e3)
    np.testing.assert_array_equal(light.get_ydata()[:-1], levels)
    said = [text.get_text() for text in ax.texts]
    assert said[:11] == list("00100101011")
    assert said[11:] == ["start", "payload", "checksum"]
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "LED transmission bit", "event ON", "event OFF",
    ]  # fmt: skip


def test_decoding_without_the_light_and_without_events(ax):
    draw_decoding(np.zeros(8, int), np.zeros(8, int), ax, start_us=33_000)
    assert ax.get_xlim() == (33, 35)
    assert len(ax.get_figure().axes) == 1


def test_a_packet_shows_its_blocks_bits_and_light(ax):
    spans = packet_spans(0x25, PacketFormat())
    draw_packet(spans, ax)
    blocks = [(patch.get_x(), patch.get_width()) for patch in ax.patches if patch.get_y() == 2.6]
    assert blocks == [(0, 3), (3, 8), (11, 3)]
    drawn = ax.lines[0].get_ydata()[:-1] - 0.2
    np.testing.assert_allclose(drawn, encode_packet(0x25, PacketFormat()))
    assert "8 ms" in [text.get_text() for text in ax.texts]
