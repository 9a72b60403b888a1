"""Tests of the file of constants: each value lies in its range and has a source, and the camera uses it."""

import dataclasses
import re
from pathlib import Path

import pytest

from bicode_lab import constants
from bicode_lab.camera import Light, Optics, PixelModel, Scene
from bicode_lab.constants import all_constants, constant

PACKAGE = Path(constants.__file__).parent
EVERY = all_constants()
HEAD = "name,value,low,high,unit,fitted_to,source\n"


@pytest.mark.parametrize("one", EVERY.values(), ids=lambda one: one.name)
def test_it_is_in_its_range_and_says_where_it_is_from(one: constants.Constant) -> None:
    assert one.low < one.high
    assert one.low <= one.value <= one.high
    assert len(one.source) > 10


def test_names_are_told_once() -> None:
    lines = (PACKAGE / "constants.csv").read_text(encoding="utf-8").splitlines()[1:]
    assert len(lines) == len(EVERY)


def test_few_are_fitted_and_beyond_fig_8_only_to_three_named_claims() -> None:
    fitted = {one.fitted_to for one in EVERY.values()} - {""}
    assert "Fig. 8" in fitted
    others = fitted - {"Fig. 8"}
    assert all(re.fullmatch(r"F\d+\.\d", claim) for claim in others)
    assert len(others) <= 3


@pytest.mark.parametrize("kind", [Optics, Light, PixelModel, Scene])
def test_defaults_of_the_camera_are_the_files(kind: type) -> None:
    defaults = {field.name: field.default for field in dataclasses.fields(kind)}
    shared = defaults.keys() & EVERY.keys()
    assert shared
    assert {name: defaults[name] for name in shared} == {name: constant(name) for name in shared}


def test_both_thresholds_and_both_leds_have_the_files_value() -> None:
    assert PixelModel().threshold_on == PixelModel().threshold_off == constant("threshold")
    assert Light().infrared_led_to_ambient == constant("led_to_ambient")


def test_every_constant_is_asked_for_somewhere() -> None:
    packages = (PACKAGE, PACKAGE.parent / "bicode_studies")
    code = "\n".join(path.read_text(encoding="utf-8") for package in packages for path in package.rglob("*.py"))
    code = code.replace("infrared_share_{place}", "infrared_share_office infrared_share_evening")
    assert [name for name in EVERY if name not in code] == []


@pytest.mark.parametrize(
    ("row", "complaint"),
    [("blur_px,2,0.4,1.6,px,,made up", "blur_px=2 is outside its range 0.4 .. 1.6"), ("blur_px,1,0.4,1.6,px,,ok", "")],
)
def test_a_value_outside_its_range_is_refused(
    row: str, complaint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "constants.csv").write_text(f"{HEAD}{row}\n", encoding="utf-8")
    monkeypatch.setattr(constants.resources, "files", lambda name: tmp_path)
    read = all_constants.__wrapped__
    if complaint:
        with pytest.raises(ValueError, match=complaint):
            read()
    else:
        assert list(read()) == ["blur_px"]
