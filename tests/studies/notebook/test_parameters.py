"""Parameters are read from their cell; wrong names, types and lines are refused in clear words."""

import pytest

from bicode_studies.notebook.parameters import check_parameters, parameters_of

CELL = """distance_m = 2.5  # to the marker [m], 1.0 in the paper's Fig. 7
n_periods = 3  # how many periods to draw
seed = 0
quick = True  # short settings
scene = "indoor"  # "indoor" or "evening"
ids = [1, 2]
"""


@pytest.fixture
def path(make_notebook):
    return make_notebook(CELL, "pass")


def test_names_defaults_and_meanings_are_read_in_order(path):
    found = parameters_of(path)
    assert list(found) == ["distance_m", "n_periods", "seed", "quick", "scene", "ids"]
    assert found["distance_m"].default == 2.5
    assert found["distance_m"].meaning == "to the marker [m], 1.0 in the paper's Fig. 7"
    assert found["scene"].meaning == '"indoor" or "evening"'
    assert found["seed"].meaning == ""


@pytest.mark.parametrize(
    ("name", "typed", "value"),
    [
        ("distance_m", "4", 4.0),
        ("distance_m", 4, 4.0),
        ("distance_m", "-1e-3", -0.001),
        ("n_periods", "0x25", 37),
        ("quick", "no", False),
        ("quick", False, False),
        ("scene", "7", "7"),
        ("ids", "[3]", [3]),
    ],
)
def test_typed_text_becomes_a_value_of_the_defaults_type(path, name, typed, value):
    checked = check_parameters(path, {name: typed})[name]
    assert checked == value
    assert type(checked) is type(value)


@pytest.mark.parametrize(
    ("name", "typed", "kind"),
    [
        ("distance_m", "abc", "a number"),
        ("distance_m", "nan", "a number"),
        ("distance_m", True, "a number"),
        ("n_periods", "2.5", "a whole number"),
        ("n_periods", True, "a whole number"),
        ("quick", "maybe", "true or false"),
        ("scene", 7, "text"),
        ("ids", "3", "a list"),
        ("ids", "[3", "a list"),
    ],
)
def test_another_type_is_refused_in_words(path, name, typed, kind):
    with pytest.raises(ValueError, match=rf"parameter '{name}' of 02_try_things.ipynb is {kind} \(its default is"):
        check_parameters(path, {name: typed})


def test_an_unknown_name_is_refused_with_the_nearest(path):
    words = r"unknown parameter 'distnce_m' of 02_try_things\.ipynb; did you mean 'distance_m'\? It has: distance_m, n_"
    with pytest.raises(ValueError, match=words):
        check_parameters(path, {"distnce_m": "3"})


@pytest.mark.parametrize("line", ["import os", "a = b", "a, b = 1, 2", "a = 1 + x", "f()"])
def test_a_line_that_is_no_literal_is_shown(make_notebook, line):
    with pytest.raises(ValueError, match="write: name_unit = literal"):
        parameters_of(make_notebook(f"seed = 0  # chance\n{line}"))


def test_what_is_no_notebook_is_said(make_notebook, tmp_path):
    with pytest.raises(ValueError, match=r"no\.ipynb: no such notebook"):
        parameters_of(tmp_path / "no.ipynb")
    (tmp_path / "bad.ipynb").write_text("hello")
    with pytest.raises(ValueError, match="is not a notebook"):
        parameters_of(tmp_path / "bad.ipynb")
    with pytest.raises(ValueError, match="has no cell tagged 'parameters'"):
        parameters_of(make_notebook("a = 1", tag="other"))
