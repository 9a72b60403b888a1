"""A notebook runs with this interpreter, in its own folder, with the values given; a failure is one line."""

import json
import sys

import pytest

from bicode_studies.notebook import runner
from bicode_studies.notebook.runner import NotebookError, find_notebooks, run_all, run_notebook

pytestmark = pytest.mark.notebook

PARAMETERS = "quick = True  # short settings\nseed = 0  # chance\ndistance_m = 2.5  # to the marker [m]"
TELL = """import json, os, pathlib, sys
import bicode_lab
facts = dict(python=sys.executable, quick=quick, distance_m=distance_m, figures=os.environ["BICODE_FIGURES"])
facts |= dict(folder=os.getcwd(), package=bicode_lab.__file__)
pathlib.Path(os.environ["BICODE_FIGURES"], "facts.json").write_text(json.dumps(facts))"""


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """Make a folder that looks like a clone, and change into it."""
    for name in ("notebooks", "bicode_lab"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def facts_of(folder):
    return json.loads((folder / "facts.json").read_text())


def test_a_notebook_runs_here_with_the_values_given(make_notebook, tmp_path):
    path = make_notebook(PARAMETERS, TELL)
    done = run_notebook(path, {"distance_m": "4"}, tmp_path / "out" / "a.ipynb", quick=False, figures=tmp_path / "f")
    assert done.succeeded
    assert done.output == tmp_path / "out" / "a.ipynb"
    assert done.output.is_file()
    facts = facts_of(tmp_path / "f")
    assert facts["python"] == sys.executable
    assert facts["package"] == sys.modules["bicode_lab"].__file__
    assert facts["folder"] == str(path.parent)
    assert facts["distance_m"] == 4.0
    assert facts["quick"] is False


def test_a_foreign_kernel_of_the_usual_name_is_not_used(make_notebook, tmp_path, monkeypatch):
    spec = tmp_path / "jupyter" / "kernels" / "python3"
    spec.mkdir(parents=True)
    (spec / "kernel.json").write_text('{"argv": ["false"], "display_name": "broken", "language": "python"}')
    monkeypatch.setenv("JUPYTER_PATH", str(tmp_path / "jupyter"))
    run_notebook(make_notebook(PARAMETERS, TELL), output=tmp_path / "a.ipynb", figures=tmp_path)
    assert facts_of(tmp_path)["python"] == sys.executable


def test_a_failure_names_notebook_cell_and_reason_and_keeps_a_log(make_notebook, tmp_path):
    path = make_notebook(PARAMETERS, "x = 1", "def f():\n    raise KeyError('no such\\nmarker')\nf()")
    with pytest.raises(NotebookError) as caught:
        run_notebook(path, output=tmp_path / "o" / "a.ipynb", figures=tmp_path)
    log = tmp_path / "o" / "a.log"
    assert str(caught.value).startswith("02_try_things.ipynb, cell 4: KeyError: ")
    assert str(caught.value).endswith(f"(log: {log})")
    assert "\n" not in str(caught.value)
    assert "raise KeyError" in log.read_text()


def test_misuse_is_found_before_anything_runs(make_notebook, monkeypatch):
    monkeypatch.setattr(runner, "_execute", lambda *_: pytest.fail("it ran"))
    with pytest.raises(ValueError, match="did you mean 'distance_m'"):
        run_notebook(make_notebook(PARAMETERS), {"distnce_m": 1})


def test_all_run_and_one_failure_does_not_stop_the_rest(make_notebook, clone):
    make_notebook(PARAMETERS, TELL, name="notebooks/01_see_one.ipynb")
    make_notebook(PARAMETERS, "1 / 0", name="notebooks/02_see_two.ipynb")
    make_notebook(PARAMETERS, "raise SystemError", name="notebooks/solutions/01_see_one.ipynb")
    runs = run_all(jobs=2)
    assert [run.succeeded for run in runs] == [True, False]
    assert "02_see_two.ipynb, cell 3: ZeroDivisionError" in runs[1].error
    assert facts_of(clone / "figures" / "quick")["quick"] is True


def test_full_figures_are_only_written_with_the_papers_values(make_notebook, clone):
    path = make_notebook(PARAMETERS, TELL, name="notebooks/01_see_one.ipynb")
    run_notebook(path, quick=False)
    assert facts_of(clone / "figures")["quick"] is False
    run_notebook(path, {"distance_m": 9}, quick=False)
    assert facts_of(clone / "figures" / "quick")["distance_m"] == 9
    assert facts_of(clone / "figures")["distance_m"] == 2.5


def test_a_name_that_starts_no_notebook_lists_what_there_is(make_notebook, clone):
    make_notebook(PARAMETERS, name="notebooks/01_see_one.ipynb")
    assert [path.stem for path in find_notebooks("01")] == ["01_see_one"]
    with pytest.raises(ValueError, match="there are: 01_see_one"):
        find_notebooks("07")


def test_no_notebooks_is_no_failure(clone):
    assert run_all() == []
