"""Tests of the page of `bicode what-if` in a browser: it loads, and a moved slider changes words and pictures."""

from __future__ import annotations

import hashlib
import os
import time
from pathlib import Path

import pytest

READY_S = 60
ANSWER_S = 15  # less than a second on an idle machine
NUMBERS = "events per ON edge"  # a row of the link budget, which is computed last


@pytest.fixture(scope="module")
def page(browser, serve):
    """Open the page in a window of a desktop's width and wait until it is ready."""
    address = serve(
        "-c", "from bicode_studies.cli.main import main; main(['what-if', '--no-browser', '--port', '{port}'])"
    )
    _resize(browser, 1280, 960)
    browser.get(address)
    _wait(lambda: NUMBERS in _text(browser, "budget"), READY_S)
    return browser


def _find(page, name):
    return page.find_element("css selector", f".bicode-{name}")


def _text(page, name):
    found = page.find_elements("css selector", f".bicode-{name}")
    return found[0].get_attribute("innerText") if found else ""


def _picture(page, name):
    """Return a hash of the bytes of a picture as the browser has it now."""
    script = """
    const done = arguments[1], image = document.querySelector(arguments[0]);
    fetch(image.src).then(answer => answer.arrayBuffer()).then(bytes => done(Array.from(new Uint8Array(bytes))));"""
    return hashlib.sha256(bytes(page.execute_async_script(script, f"img.bicode-{name}"))).hexdigest()


def _move(page, name, steps):
    """Move a slider with the arrow keys."""
    from selenium.webdriver.common.keys import Keys

    handle = page.find_element("css selector", f".bicode-{name} .noUi-handle")
    for _ in range(abs(steps)):
        handle.send_keys(Keys.ARROW_RIGHT if steps > 0 else Keys.ARROW_LEFT)


def _to_paper(page):
    """Press the button for the paper's choice, and wait for its result."""
    page.find_element("css selector", ".bicode-controls button").click()
    _wait(lambda: "14 ms" in _text(page, "verdict") and not _is_stale(page), ANSWER_S)


def _is_stale(page):
    return bool(page.find_elements("css selector", ".bicode-stale"))


def _resize(page, width, height):
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 800}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)


def _wait(condition, seconds):
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, f"the condition does not hold after {seconds} s"
        time.sleep(0.1)


def _box(page, name):
    return page.execute_script("return document.querySelector(arguments[0]).getBoundingClientRect()", f".bicode-{name}")


def _keep_picture(page, name):
    """Save a screenshot to the folder that `make page-pictures` names; without a folder do nothing."""
    if folder := os.environ.get("BICODE_PAGE_PICTURES"):
        time.sleep(1)
        page.save_screenshot(str(Path(folder) / name))


def test_the_first_view_shows_a_result_without_any_action(page):
    verdict = _text(page, "verdict")
    assert "ID right" in verdict
    assert "as sent" in verdict
    assert "571 bit/s" in verdict
    for name in ("packet", "frame"):
        size = page.execute_script("return document.querySelector(arguments[0]).naturalWidth", f"img.bicode-{name}")
        assert size > 300
    assert not _is_stale(page)
    assert _box(page, "packet")["left"] >= _box(page, "controls")["right"]
    _keep_picture(page, "what_if_page.png")


def test_a_moved_slider_changes_pictures_and_numbers(page):
    _to_paper(page)
    before = {name: _picture(page, name) for name in ("packet", "frame")}
    texts = {name: _text(page, name) for name in ("verdict", "budget")}
    _move(page, "distance-m", 3)
    _wait(lambda: _text(page, "budget") != texts["budget"] and not _is_stale(page), ANSWER_S)
    assert _text(page, "verdict") != texts["verdict"]
    for name, old in before.items():
        assert _picture(page, name) != old


def test_an_impossible_choice_is_explained_at_its_slider_and_taken_back(page):
    _to_paper(page)
    _move(page, "delta-t-id-us", 6)
    _wait(lambda: "impossible" in _text(page, "verdict"), ANSWER_S)
    words = page.find_element("css selector", ".bicode-delta-t-id-us + .bicode-words").get_attribute("innerText")
    assert "longer than one chip" in words
    assert "choose" in words
    assert _is_stale(page)
    _to_paper(page)
    assert "impossible" not in _text(page, "verdict")


def test_a_packet_longer_than_the_period_is_explained_and_simulated(page):
    _to_paper(page)
    _move(page, "f-id-hz", -9)
    _wait(lambda: "56 ms" in _text(page, "verdict"), ANSWER_S)
    words = page.find_element("css selector", ".bicode-f-id-hz + .bicode-words").get_attribute("innerText")
    assert "no period ever holds a whole packet" in words
    assert "0%" in _text(page, "verdict")


def test_nobody_sees_a_traceback(page):
    text = page.execute_script("return document.body.innerText")
    assert "Traceback" not in text
    assert "Error" not in text


def test_on_a_phone_it_is_one_column_and_nothing_sticks_out(page):
    _resize(page, 390, 844)
    _to_paper(page)
    boxes = {name: _box(page, name) for name in ("verdict", "packet", "controls", "budget")}
    assert all(box["left"] >= 0 and box["right"] <= 390 for box in boxes.values())
    tops = [box["top"] for box in boxes.values()]
    assert tops == sorted(tops)
    assert boxes["packet"]["bottom"] <= 844
    _keep_picture(page, "what_if_page_phone.png")
    page.execute_script("document.querySelector('.bicode-delta-t-whole-us').scrollIntoView({block: 'center'})")
    assert 0 <= _box(page, "verdict")["top"] <= 10, "the numbers do not stay in sight"
    _resize(page, 1280, 960)
