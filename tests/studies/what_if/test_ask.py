"""Tests of choices: an impossible one is refused in words, a possible one is simulated."""

import itertools
from dataclasses import fields, replace

import numpy as np
import pytest

from bicode_lab.recognition import ReceiverSettings
from bicode_studies.statistics import interval_over_seeds, wilson
from bicode_studies.what_if.ask import ask, ask_many, frames_showing, share_with_interval
from bicode_studies.what_if.choice import LIMITS, MOST_PIXEL_SECONDS, Choice, list_remarks
from bicode_studies.what_if.packet_timing import whole_packet_probability
from bicode_studies.what_if.packet_view import view_packet


def test_the_default_choice_is_the_papers():
    choice, receiver = Choice(), ReceiverSettings()
    for name in ("packet_format", "delta_t_whole_us", "delta_t_2d_us", "delta_t_blinker_us", "delta_t_id_us"):
        assert getattr(choice.receiver(), name) == getattr(receiver, name)
    assert not [remark for remark in list_remarks(replace(choice, distance_m=2.5)) if remark.impossible]


@pytest.mark.parametrize("seed", range(3))
def test_a_near_marker_is_read(seed):
    result = ask(Choice(distance_m=2.5), seed)
    assert (result.right, result.found, result.wrong_ids) == (result.periods, result.periods, 0)
    assert result.goodput_bps == pytest.approx(Choice().packet_format.payload_rate_bps, rel=0.05)


@pytest.mark.parametrize(
    "choice",
    [
        Choice(),
        Choice(f_id_hz=2000),
        Choice(payload_bits=16, checksum="crc3"),
        Choice(distance_m=22),
        Choice(f_id_hz=600),
    ],
    ids=str,
)
def test_what_is_read_is_no_more_than_what_is_sent(choice):
    result = ask(choice, 1)
    assert 0 <= result.goodput_bps <= choice.packet_format.payload_rate_bps
    assert 0 <= result.right <= result.found <= result.periods
    low, high = result.accuracy[1:]
    assert 0 <= low <= result.accuracy[0] <= high <= 1


@pytest.mark.parametrize("f_id_hz", [410, 500, 600, 700, 850])
def test_periods_are_right_where_a_whole_packet_lies_in_them(f_id_hz):
    choice = Choice(f_id_hz=f_id_hz, distance_m=2.5)
    result = ask(choice, 0)
    wave = result.scene.markers[0].marker.waveform
    starts = wave.packet_starts(0, 1e6)
    ends = starts + wave.packet_us
    borders = np.arange(result.periods) * choice.delta_t_whole_us
    slack_us = 500  # events come later than the light, and a packet may just fit or just not
    room = [((starts >= b) & (ends <= b + choice.delta_t_whole_us - slack_us)).any() for b in borders]
    maybe = [((starts >= b - slack_us) & (ends <= b + choice.delta_t_whole_us)).any() for b in borders]
    assert sum(room) <= result.right <= sum(maybe)
    assert (sum(maybe) > 0) == (whole_packet_probability(33_000, choice.packet_format.packet_us) > 0)


@pytest.mark.parametrize(
    ("wrong", "setting", "words"),
    [
        ({"delta_t_id_us": 600}, "delta_t_id_us", "longer than one chip, 500 us"),
        ({"f_id_hz": 10_000}, "delta_t_id_us", "choose 50 us or less, or f_ID of 2000 Hz or less"),
        ({"delta_t_blinker_us": 40_000}, "delta_t_blinker_us", "longer than the period"),
        ({"delta_t_2d_us": 40_000}, "delta_t_2d_us", "longer than the period"),
        ({"f_id_hz": 0}, "f_id_hz", "choose from"),
        ({"payload_bits": 40}, "payload_bits", "whole number from 1 to 32"),
        ({"checksum": "parity"}, "checksum", "choose 'sum' or 'crc3'"),
        ({"distance_m": 0}, "distance_m", "choose from"),
        ({"delta_t_id_us": 0}, "delta_t_id_us", "choose a whole number from 1"),
    ],
)
def test_an_impossible_choice_is_refused_in_words_at_its_setting(wrong, setting, words):
    (remark,) = [remark for remark in list_remarks(Choice(**wrong)) if remark.impossible]
    assert remark.setting == setting
    assert words in remark.words
    with pytest.raises(ValueError, match=setting):
        ask(Choice(**wrong))


@pytest.mark.parametrize(
    ("doubtful", "setting", "words"),
    [
        ({"f_id_hz": 400}, "f_id_hz", "no period ever holds"),
        ({"payload_bits": 20}, "f_id_hz", "only 27% of periods"),
        ({"delta_t_blinker_us": 1000}, "delta_t_blinker_us", "shorter than two bits"),
        ({"delta_t_blinker_us": 33_000}, "delta_t_blinker_us", "no region is found"),
        ({"distance_m": 20}, "distance_m", "ID only, no pose"),
    ],
)
def test_a_doubtful_choice_is_simulated_and_remarked_on(doubtful, setting, words):
    found = {remark.setting: remark for remark in list_remarks(Choice(**doubtful))}
    assert not found[setting].impossible
    assert words in found[setting].words
    ask(Choice(**doubtful))


def test_every_corner_of_the_ranges_has_a_remark_or_can_be_built():
    names = list(LIMITS)
    possible = 0
    for corner in itertools.product(*LIMITS.values()):
        values = {n: int(v) if n.endswith(("_us", "_bits")) else v for n, v in zip(names, corner, strict=True)}
        choice = Choice(**values)
        if not any(remark.impossible for remark in list_remarks(choice)):
            possible += 1
            choice.receiver()
            scene = choice.scene(0)
            assert scene.optics.width % 2 == scene.optics.height % 2 == 0
            assert choice.periods() == 1 or choice.side_px**2 * choice.seconds() <= MOST_PIXEL_SECONDS
    assert possible > 0


def test_many_choices_give_what_each_gives_alone():
    choices = [Choice(delta_t_id_us=us, f_id_hz=f) for us in (100, 250, 500) for f in (800, 1500)]
    table = ask_many(choices, seeds=(0, 1))
    assert list(table["possible"]) == [True] * 5 + [False]
    assert "longer than one chip" in table["words"].iloc[-1]
    assert np.isnan(table["accuracy"].iloc[-1])
    for choice, row in zip(choices[:-1], table.itertuples(), strict=False):
        alone = [ask(choice, seed) for seed in (0, 1)]
        assert row.accuracy == pytest.approx(np.mean([a.right / a.periods for a in alone]))
        assert row.goodput_bps == pytest.approx(np.mean([a.goodput_bps for a in alone]))
        assert row.low <= row.accuracy <= row.high
        assert row.periods == sum(a.periods for a in alone)
        assert all(getattr(row, f.name) == getattr(choice, f.name) for f in fields(choice))


@pytest.mark.slow
def test_workers_do_not_change_the_answer():
    choices = [Choice(f_id_hz=f) for f in (700, 1000)]
    one, two = (ask_many(choices, seeds=(0, 1), n_jobs=n) for n in (1, 2))
    assert one.equals(two)


def test_the_pattern_is_looked_for_on_the_whole_sensor():
    """ArUco's smallest marker is a share of the image: in the small window it would find smaller ones than a camera."""
    near, far = (ask(Choice(distance_m=d), detect_2d=True) for d in (1.0, 12.0))
    assert near.right_2d == near.periods
    assert far.right_2d == 0
    assert ask(Choice(distance_m=1.0)).right_2d is None


def test_a_frame_longer_than_the_quiet_of_a_packet_always_shows_the_marker():
    result = ask(Choice(distance_m=2.5))
    shares = [shown / n for shown, n in (frames_showing(result, us) for us in (100, 1000, 4100))]
    assert shares[0] < shares[1] < shares[2] == 1.0  # quiet for 4 ms at most


@pytest.mark.parametrize("changes", [{}, {"f_id_hz": 400}, {"distance_m": 60}, {"payload_bits": 16, "f_id_hz": 2000}])
def test_a_view_shows_one_packet_of_it(changes):
    choice = replace(Choice(), **changes)
    shown = view_packet(ask(choice))
    n_bins = round((shown.end_us - shown.start_us) / choice.delta_t_id_us)
    assert shown.n_on.shape == shown.n_off.shape == (n_bins,)
    assert shown.end_us - shown.start_us >= choice.packet_format.packet_us
    assert set(np.unique(shown.frame)) <= {-1, 0, 1}
    if changes == {}:
        assert shown.packet is not None
        assert shown.packet.payload == ask(choice).scene.markers[0].marker.payload
        assert shown.frame.any()
    if "distance_m" in changes:
        assert shown.packet is None
        assert shown.reason


def test_two_seeds_that_nearly_agree_have_a_wide_interval():
    """They may do so by chance: the interval is wider than Wilson's of all their periods."""
    share, low, high = share_with_interval(np.array([4.0, 5.0]), np.array([10, 10]))
    assert share == pytest.approx(0.45)
    assert (low, high) == interval_over_seeds([4, 5], [10, 10])
    assert low < wilson(9, 20)[0]
    assert high > wilson(9, 20)[1]
