"""Tests of notebook 15 as a papermill job: it answers at any corner of its ranges, in words where it is impossible."""

import json
from pathlib import Path

import pandas as pd
import pytest

from bicode_studies.notebook.parameters import parameters_of
from bicode_studies.notebook.runner import run_notebook
from bicode_studies.what_if.choice import LIMITS

NOTEBOOK = Path(__file__).resolve().parents[3] / "notebooks" / "15_ask_what_if.ipynb"

pytestmark = pytest.mark.notebook

SLOWEST = {
    "f_id_hz": 100.0, "payload_bits": 32, "start_bits": 16, "delta_t_id_us": 5000, "delta_t_whole_us": 200_000,
    "delta_t_2d_us": 200_000, "delta_t_blinker_us": 200_000, "size_m": 0.1, "distance_m": 0.5, "current_ma": 100.0,
}  # fmt: skip
SHORTEST = {
    "delta_t_whole_us": 1000, "delta_t_2d_us": 1, "delta_t_blinker_us": 1, "delta_t_id_us": 1, "current_ma": 0.0,
    "illuminance_lux": 1.0, "distance_m": 60.0, "size_m": 0.01,
}  # fmt: skip
FASTEST = {
    "f_id_hz": 20_000.0, "payload_bits": 1, "start_bits": 2, "checksum": "crc3", "delta_t_id_us": 25,
    "illuminance_lux": 100_000.0, "distance_m": 0.5,
}  # fmt: skip


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({**SLOWEST, "distance_m": 2.5}, ["no period ever holds a whole packet", "your choice can be simulated"]),
        (SLOWEST, ["makes too many events in 200 ms", "for the paper's choice instead"]),
        (SHORTEST, ["no period ever holds a whole packet", "ID only, no pose", "your choice can be simulated"]),
        (FASTEST, ["your choice can be simulated"]),
        (
            {"f_id_hz": 0.0, "payload_bits": 99, "checksum": "parity", "distance_m": -1.0},
            ["impossible: f_id_hz", "impossible: payload_bits", "'parity' is not known", "impossible: distance_m"],
        ),
        (
            {"delta_t_id_us": 2000, "delta_t_2d_us": 50_000, "delta_t_blinker_us": 40_000},
            ["longer than one chip, 500 us", "longer than the period, 33 ms", "for the paper's choice instead"],
        ),
    ],
    ids=["slowest", "too near", "shortest", "fastest", "out of range", "impossible together"],
)
def test_a_corner_is_answered_in_words_and_numbers(given, words, tmp_path):
    done = run_notebook(NOTEBOOK, given, output=tmp_path / "done.ipynb", figures=tmp_path)
    cells = json.loads(done.output.read_text(encoding="utf-8"))["cells"]
    outputs = [output for cell in cells for output in cell.get("outputs", [])]
    said = "".join("".join(output.get("text", "")) for output in outputs if output.get("name") == "stdout")
    for word in words:
        assert word in said
    assert not [output for output in outputs if output.get("name") == "stderr"]
    for name in ("one_packet", "rate_map", "period", "frames"):
        assert (tmp_path / f"fig_15_{name}.png").stat().st_size > 5000
        assert len(pd.read_csv(tmp_path / f"fig_15_{name}.csv"))


def test_the_corners_above_are_those_of_the_ranges():
    corners = {}
    for given in (SLOWEST, SHORTEST, FASTEST):
        for name, value in given.items():
            corners.setdefault(name, set()).add(value)
    for name, (low, high) in LIMITS.items():
        assert corners[name] & {low, high}, name
    assert set(LIMITS) <= set(parameters_of(NOTEBOOK))
