"""Tests of the comparison of a text that was read with the text that was sent."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bicode_studies.real_light.text_score import SONNET_18, score_table, score_text


def test_the_text_is_618_letters_of_7_bits():
    assert len(SONNET_18) == 618
    assert SONNET_18.count("\n") == 13
    assert max(map(ord, SONNET_18)) < 128


@given(st.integers(0, 500), st.integers(30, 100), st.text("~}|", max_size=4), st.text("~}|", max_size=4))
@settings(max_examples=30, deadline=None)
def test_a_text_read_well_is_right_whatever_stands_around_it(first, n, ahead, behind):
    sent = SONNET_18[first : first + n]
    score = score_text(ahead + sent + behind, sent)
    assert score.letters_right.all()
    assert score.bits_right.all()
    assert (score.n_lost, score.n_extra) == (0, 0)
    assert score.read == tuple(range(len(ahead), len(ahead) + len(sent)))


@given(st.integers(1, 60))
def test_a_wrong_letter_is_one_error_and_its_unlike_bits_are_wrong(k):
    sent = SONNET_18[:80]
    wrong = chr(ord(sent[k]) ^ 0b1010000)
    score = score_text(sent[:k] + wrong + sent[k + 1 :], sent)
    assert np.flatnonzero(~score.letters_right).tolist() == [k]
    assert (~score.bits_right).sum() == 2


@given(st.integers(2, 60))
def test_a_lost_letter_costs_all_its_bits_and_one_too_many_none(k):
    sent = SONNET_18[:80]
    score = score_text(sent[:k] + sent[k + 1 :], sent)
    assert (score.n_lost, score.n_extra) == (1, 0)
    assert (~score.letters_right).sum() == 1
    assert (~score.bits_right).sum() == 7
    score = score_text(sent[:k] + "~" + sent[k:], sent)
    assert score.letters_right.all()
    assert (score.n_lost, score.n_extra) == (0, 1)


def test_nothing_read_is_nothing_right():
    score = score_text("", "abc")
    assert score.letters == (0.0, 0.0, pytest.approx(0.56, abs=0.01))
    assert score.n_lost == 3
    assert score.read == (-1, -1, -1)


def test_what_cannot_be_scored_is_refused():
    with pytest.raises(ValueError, match="nothing was sent"):
        score_text("abc", "")
    with pytest.raises(ValueError, match="no letter of 7 bits"):
        score_text("abc", "ä")


def test_the_table_has_a_row_a_score():
    table = score_table({(504, "rule"): score_text("abd", "abc"), (504, "soft"): score_text("abc", "abc")})
    assert table.letters.round(2).tolist() == [0.67, 1.0]
    assert (table.letters_low < table.letters).all()
    assert score_table({}).empty
