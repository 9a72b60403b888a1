"""The run times of notebooks are kept per notebook and setting, and go into the README."""

from pathlib import Path

from bicode_studies.notebook.run_times import read_run_times, with_minutes, write_run_times
from bicode_studies.notebook.runner import NotebookRun


def run_of(name: str, seconds: float, error: str | None = None) -> NotebookRun:
    path = Path(f"{name}.ipynb")
    return NotebookRun(notebook=path, output=path, seconds=seconds, error=error)


def test_times_are_entered_and_others_stay(tmp_path: Path) -> None:
    path = tmp_path / "run_times.csv"
    write_run_times(path, [run_of("02_b", 6.04), run_of("01_a", 3.0)], quick=True)
    write_run_times(path, [run_of("02_b", 90.0), run_of("01_a", 1.0, error="it failed")], quick=False)
    assert path.read_text(encoding="utf-8") == "notebook,quick_s,full_s\n01_a,3.0,\n02_b,6.0,90.0\n"
    write_run_times(path, [run_of("01_a", 5.0)], quick=True)
    assert read_run_times(path).loc["01_a", "quick_s"] == 5.0
    assert read_run_times(path).loc["02_b"].tolist() == [6.0, 90.0]


def test_minutes_go_into_the_rows_of_their_notebooks_alone(tmp_path: Path) -> None:
    path = tmp_path / "run_times.csv"
    write_run_times(path, [run_of("02_b", 6.0)], quick=True)
    write_run_times(path, [run_of("02_b", 89.0)], quick=False)
    readme = (
        "| [01 A](notebooks/01_a.ipynb) | Fig. 1 | 0.5 / 0.5 | yes |\n"
        "| [02 B](notebooks/02_b.ipynb) | Fig. 2 | ? / 9.9 | 1 / 2 of them |\n"
        "text 1 / 2"
    )
    expected = readme.replace("0.5 / 0.5", "? / ?").replace("? / 9.9", "0.1 / 1.5")
    assert with_minutes(readme, read_run_times(path)) == expected
    assert with_minutes(expected, read_run_times(path)) == expected
