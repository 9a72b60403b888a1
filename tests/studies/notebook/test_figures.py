"""A saved figure is the same bytes from the same data, and holds its data and parameters."""

import json

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest

from bicode_studies.notebook.figures import as_table, save_figure, use_style
from bicode_studies.repository import figures_folder, repository_root

mpl.use("Agg")

from matplotlib import pyplot as plt


@pytest.fixture
def draw():
    """Return a function that draws a line and a frame in the style of this collection."""

    def make():
        with plt.rc_context():
            use_style()
            fig, (left, right) = plt.subplots(1, 2)
            left.plot(np.arange(100), np.sin(np.arange(100) / 5))
            left.set_xlabel("time (ms)")
            right.imshow(np.eye(30))
        return fig

    yield make
    plt.close("all")


def test_the_same_figure_gives_the_same_bytes(draw, tmp_path, monkeypatch):
    contents = []
    for name in ("first", "second"):
        monkeypatch.setenv("BICODE_FIGURES", str(tmp_path / name))
        picture = save_figure(
            draw(), "03_frames", {"t_us": [1, 2], "v": [0.1, 1 / 3]}, {"seed": 5, "d_m": np.float64(2)}
        )
        assert picture == tmp_path / name / "fig_03_frames.png"
        contents.append({path.name: path.read_bytes() for path in picture.parent.iterdir()})
    assert contents[0] == contents[1]
    assert sorted(contents[0]) == ["fig_03_frames.csv", "fig_03_frames.json", "fig_03_frames.png"]
    assert contents[0]["fig_03_frames.csv"] == b"t_us,v\n1,0.1\n2,0.333333\n"
    record = json.loads(contents[0]["fig_03_frames.json"])
    assert record["seed"] == 5
    assert record["parameters"] == {"d_m": 2.0, "seed": 5}
    assert "numpy" in record["versions"]
    assert len(contents[0]["fig_03_frames.png"]) < 200_000
    assert b"matplotlib" not in contents[0]["fig_03_frames.png"].lower()


def test_the_picture_keeps_white_white_and_the_colours_of_the_lines(draw, tmp_path, monkeypatch):
    from PIL import Image

    monkeypatch.setenv("BICODE_FIGURES", str(tmp_path))
    colours = set(Image.open(save_figure(draw(), "03_frames", {}, {})).convert("RGB").get_flattened_data())
    assert (255, 255, 255) in colours
    blue = np.array([0x00, 0x72, 0xB2])
    assert min(np.abs(np.array(colour) - blue).max() for colour in colours) <= 4


@pytest.mark.parametrize("slug", ["frames", "3_frames", "03", "03_Frames", "03_a/b"])
def test_a_slug_without_number_is_refused(draw, slug):
    with pytest.raises(ValueError, match="write its number and a name"):
        save_figure(draw(), slug, {}, {})


def test_a_setting_that_json_cannot_hold_is_refused(draw, tmp_path, monkeypatch):
    monkeypatch.setenv("BICODE_FIGURES", str(tmp_path))
    with pytest.raises(ValueError, match="cannot be written as JSON"):
        save_figure(draw(), "03_frames", {}, {"what": object()})


def test_data_of_any_shape_become_one_table():
    frame = np.zeros((3, 4), np.int8)
    frame[1, 2] = -1
    table = as_table({"frame": frame, "line": [5.0, 6.0], "table": pd.DataFrame({"a": [1]})})
    assert table["series"].tolist() == ["frame", "line", "line", "table"]
    assert table.loc[0, ["y", "x", "value"]].tolist() == [1, 2, -1]
    assert as_table({"a": 1, "b": [2, 3]}).to_dict("list") == {"a": [1, 1], "b": [2, 3]}
    assert as_table({}).empty
    with pytest.raises(ValueError, match="3 dimensions"):
        as_table({"a": np.zeros((2, 2, 2))})


def test_figures_go_to_quick_unless_told(monkeypatch, tmp_path):
    monkeypatch.delenv("BICODE_FIGURES", raising=False)
    (tmp_path / "notebooks").mkdir()
    (tmp_path / "bicode_lab").mkdir()
    monkeypatch.chdir(tmp_path / "notebooks")
    assert repository_root() == tmp_path
    assert figures_folder() == tmp_path / "figures" / "quick"
