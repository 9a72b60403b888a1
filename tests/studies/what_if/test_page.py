"""Tests of the page without a browser: what a slider changes in words, pictures and numbers."""

import io

import matplotlib.image
import pytest

from bicode_lab.recognition.decode import REASONS as DECODER_REASONS
from bicode_studies.what_if.choice import Choice, list_remarks
from bicode_studies.what_if.page import REASONS, SLIDERS, WhatIfPage, what_if_page


@pytest.fixture(scope="module")
def page():
    return WhatIfPage()


@pytest.fixture(autouse=True)
def at_the_paper_choice(page):
    page.reset.click()


def stale(page):
    return ["bicode-stale" in part._dom_classes for part in (page.packet, page.frame, page.budget)]


def test_it_begins_with_the_papers_choice_and_its_result(page):
    assert page.choice == Choice()
    assert "ID right" in page.verdict.value
    assert "events per ON edge" in page.budget.value
    for picture in (page.packet, page.frame):
        assert matplotlib.image.imread(io.BytesIO(picture.value)).std() > 0.05
    assert not any(stale(page))


def test_a_moved_slider_changes_all_that_it_should(page):
    before = page.verdict.value, page.packet.value, page.frame.value, page.budget.value
    page.sliders["distance_m"].value = 10
    after = page.verdict.value, page.packet.value, page.frame.value, page.budget.value
    assert all(a != b for a, b in zip(before, after, strict=True))
    assert page.choice == Choice(distance_m=10)


def test_another_recording_changes_the_recording_and_not_the_choice(page):
    before = page.packet.value
    page.again.click()
    assert page.packet.value != before
    assert page.choice == Choice()


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("delta_t_id_us", 600, "longer than one chip"),
        ("f_id_hz", 10_000, "longer than one chip"),
        ("delta_t_2d_us", 50_000, "longer than the period"),
        ("delta_t_whole_us", 5_000, "longer than the period"),
    ],
)
def test_an_impossible_choice_is_explained_at_its_setting(page, name, value, words):
    page.sliders[name].value = value
    obstacles = [remark for remark in list_remarks(page.choice) if remark.impossible]
    assert obstacles
    assert "impossible" in page.verdict.value
    for remark in obstacles:
        assert words in page.words[remark.setting].value
    assert all(stale(page))
    page.sliders[name].value = getattr(Choice(), name)
    assert not any(stale(page))
    assert not page.words["delta_t_id_us"].value


def test_a_packet_longer_than_the_period_is_explained_and_simulated(page):
    page.sliders["f_id_hz"].value = 400
    assert "no period ever holds a whole packet" in page.words["f_id_hz"].value
    assert "0%" in page.verdict.value
    assert not any(stale(page))


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for group in SLIDERS.values() for name in group])
def test_both_ends_of_every_slider_are_answered(page, name):
    for _, value in (SLIDERS_BY_NAME[name][0], SLIDERS_BY_NAME[name][-1]):
        page.sliders[name].value = value
        impossible = any(remark.impossible for remark in list_remarks(page.choice))
        assert ("impossible" in page.verdict.value) == impossible


SLIDERS_BY_NAME = {name: options for group in SLIDERS.values() for name, (_, options) in group.items()}


def test_the_paper_choice_is_on_every_slider():
    for name, options in SLIDERS_BY_NAME.items():
        assert getattr(Choice(), name) in [value for _, value in options]


def test_every_reason_of_the_decoder_has_words():
    assert set(DECODER_REASONS) <= set(REASONS)


def test_it_can_begin_elsewhere():
    page = WhatIfPage(Choice(distance_m=21, f_id_hz=1990))
    assert (page.choice.distance_m, page.choice.f_id_hz) == (20, 2000)
    assert what_if_page(Choice(delta_t_id_us=1000)) is not None
