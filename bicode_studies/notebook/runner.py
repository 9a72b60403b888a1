"""Run notebooks without a browser, through papermill: one or all, each in a process of its own.

The kernel is always the interpreter that runs this file, with this copy of the packages,
whatever kernels are registered on the machine.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bicode_studies.notebook.parameters import check_parameters, parameters_of
from bicode_studies.repository import repository_root

if TYPE_CHECKING:
    from nbclient.output_widget import OutputWidget

KERNEL_NAME = "bicode-lab-runner"
TIMEOUT_S = 1800


class NotebookError(RuntimeError):
    """A notebook failed: one line with its name, the cell and the reason. The log holds the rest."""


@dataclass(frozen=True, kw_only=True)
class NotebookRun:
    """The outcome of one notebook's run.

    Parameters
    ----------
    notebook, output : Path
        The notebook and its executed copy.
    seconds : float
        Duration of the run [s].
    error : str, optional
        Why it failed, in one line; None if every cell ran.
    """

    notebook: Path
    output: Path
    seconds: float
    error: str | None = None

    @property
    def succeeded(self) -> bool:
        """Whether every cell ran."""
        return self.error is None


def find_notebooks(only: str = "") -> list[Path]:
    """Return the numbered notebooks of the repository, in order.

    Parameters
    ----------
    only : str
        The start of a name, such as ``"02"``; the empty text selects all notebooks.

    Returns
    -------
    list of Path
        The notebooks whose names start so.

    Raises
    ------
    ValueError
        If no name starts so. The message lists the names there are.
    """
    every = sorted((repository_root() / "notebooks").glob("[0-9][0-9]_*.ipynb"))
    chosen = [path for path in every if path.name.startswith(only)]
    if only and not chosen:
        names = ", ".join(path.stem for path in every) or "none yet"
        raise ValueError(f"no notebook's name starts with {only!r}; there are: {names}")
    return chosen


def default_figures(quick: bool) -> Path:
    """Return the folder for figures: ``figures/`` for full settings, else ``figures/quick/``, which git ignores."""
    folder = repository_root() / "figures"
    return folder / "quick" if quick else folder


def run_notebook(
    path: str | Path,
    parameters: Mapping[str, Any] | None = None,
    output: str | Path | None = None,
    quick: bool = True,
    figures: str | Path | None = None,
) -> NotebookRun:
    """Run one notebook.

    Parameters
    ----------
    path : path
        The notebook. It runs in its own folder.
    parameters : mapping, optional
        Values for names in its parameters cell. Text is read as a value of the default's type.
    output : path, optional
        The executed copy; by default it goes to ``build/notebooks/`` of the repository. The log of a
        failure is written beside it, with the ending ``.log``.
    quick : bool
        Passed on if the notebook has a parameter ``quick``.
    figures : path, optional
        The folder that `save_figure` writes to; by default that of `default_figures`, but never the
        committed one if `parameters` are given.

    Returns
    -------
    NotebookRun
        Its ``error`` is None.

    Raises
    ------
    ValueError
        If there is no such notebook, a parameter is unknown or a value has the wrong type.
    NotebookError
        If a cell fails.
    """
    values = check_parameters(path, parameters or {})
    path = Path(path).resolve()
    if "quick" in parameters_of(path):
        values.setdefault("quick", quick)
    output = Path(output or repository_root() / "build" / "notebooks" / path.name).resolve()
    folder = Path(figures or default_figures(quick or bool(parameters))).resolve()
    for needed in (output.parent, folder):
        needed.mkdir(parents=True, exist_ok=True)
    start_s = time.perf_counter()
    with kernel_of_this_interpreter(folder):
        _execute(path, output, values)
    return NotebookRun(notebook=path, output=output, seconds=time.perf_counter() - start_s)


def run_all(quick: bool = True, jobs: int = 2, only: str = "") -> list[NotebookRun]:
    """Run every numbered notebook of the repository.

    A notebook that fails does not stop the others: its `NotebookRun` has an ``error``.

    Parameters
    ----------
    quick : bool
        Short settings or the paper's.
    jobs : int
        How many notebooks run at a time.
    only : str
        The start of the names to run, see `find_notebooks`.

    Returns
    -------
    list of NotebookRun
        One for each notebook, in their order.
    """
    folder = repository_root() / "build" / "notebooks"
    return run_paths({path: folder / path.name for path in find_notebooks(only)}, quick=quick, jobs=jobs)


def run_paths(outputs: Mapping[Path, Path], *, quick: bool = True, jobs: int = 2) -> list[NotebookRun]:
    """Run some notebooks, as `run_all` does.

    Parameters
    ----------
    outputs : mapping
        The path of each notebook, and that of its executed copy.
    quick, jobs
        As in `run_all`.

    Returns
    -------
    list of NotebookRun
        One for each notebook, ordered by name.
    """
    from joblib import Parallel, delayed
    from tqdm import tqdm

    figures = default_figures(quick)
    tasks = (delayed(_run_one)(path, output, quick, figures) for path, output in outputs.items())
    finished = Parallel(n_jobs=max(1, min(jobs, len(outputs))), return_as="generator_unordered")(tasks)
    bar = tqdm(finished, total=len(outputs), unit="notebook", disable=not sys.stderr.isatty(), leave=False)
    return sorted(bar, key=lambda run: (run.notebook.name, run.notebook))


def _run_one(path: Path, output: Path, quick: bool, figures: Path) -> NotebookRun:
    """Run one notebook; a failure becomes a result instead of an exception."""
    try:
        return run_notebook(path, output=output, quick=quick, figures=figures)
    except (NotebookError, ValueError, OSError) as error:
        return NotebookRun(notebook=path, output=output, seconds=0.0, error=str(error))


@contextlib.contextmanager
def kernel_of_this_interpreter(figures: Path) -> Iterator[None]:
    """Provide a kernel named `KERNEL_NAME` that runs this interpreter, until the ``with`` block ends.

    Parameters
    ----------
    figures : Path
        The folder that notebooks of this kernel write their figures to.
    """
    package_parent = str(Path(__file__).resolve().parents[2])
    with tempfile.TemporaryDirectory(prefix="bicode-kernel-") as folder:
        spec = Path(folder) / "kernels" / KERNEL_NAME
        spec.mkdir(parents=True)
        # A kernel is interrupted before it is shut down, and a slow one reports that as an error. Failing cells are
        # reported in another way, so the kernel's own log may be silent.
        argv = [sys.executable, "-m", "ipykernel_launcher", "--log-level=CRITICAL", "-f", "{connection_file}"]
        about = {"display_name": "bicode_lab", "language": "python"}
        (spec / "kernel.json").write_text(json.dumps({"argv": argv, **about}), encoding="utf-8")
        changed = {
            "BICODE_FIGURES": str(figures),
            "JUPYTER_PATH": os.pathsep.join(filter(None, [folder, os.environ.get("JUPYTER_PATH")])),
            "PYTHONPATH": os.pathsep.join(filter(None, [package_parent, os.environ.get("PYTHONPATH")])),
            "PYTHONHASHSEED": "0",
            "PYDEVD_DISABLE_FILE_VALIDATION": "1",
        }
        before = {name: os.environ.get(name) for name in changed}
        os.environ.update(changed)
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    os.environ.pop(name, None)
                else:
                    os.environ[name] = value


def _execute(path: Path, output: Path, values: dict[str, Any]) -> None:
    """Run the cells; if one fails, write the log and raise `NotebookError`."""
    import papermill
    from nbclient.exceptions import CellTimeoutError, DeadKernelError
    from nbclient.output_widget import OutputWidget
    from papermill.exceptions import PapermillExecutionError

    logging.getLogger("papermill").setLevel(logging.ERROR)  # unknown parameters are errors already
    # An output widget answers on the socket on which the reply of its cell arrives. Now and then nbclient then misses
    # that reply and waits until the time is up. Nobody moves a slider here, so the widget need not answer.
    OutputWidget.sync_state = _send_nothing  # type: ignore[method-assign, assignment]
    log = output.with_suffix(".log")
    log.unlink(missing_ok=True)
    try:
        papermill.execute_notebook(
            path,
            output,
            parameters=values,
            kernel_name=KERNEL_NAME,
            language="python",
            cwd=path.parent,
            progress_bar=False,
            execution_timeout=TIMEOUT_S,
        )
    except PapermillExecutionError as error:
        where = f"cell {_cell_number(path, error.cell_index, bool(values))}"
        reason = f"{error.ename}: {error.evalue}".strip().splitlines()
        said = reason[0] if len(reason) == 1 else f"{reason[0]} ... {reason[-1]}"
        raise _failure(path, where, said, log, str(error)) from None
    except CellTimeoutError as error:
        raise _failure(path, "a cell", f"took longer than {TIMEOUT_S} s", log, str(error)) from None
    except DeadKernelError as error:
        raise _failure(path, "a cell", "the kernel died (out of memory?)", log, str(error)) from None


def _send_nothing(widget: OutputWidget) -> None:
    """Replace an output widget's answer to the kernel."""


def _failure(path: Path, where: str, reason: str, log: Path, text: str) -> NotebookError:
    """Return the error that describes a failed notebook in one line, and write the whole text to the log."""
    log.write_text(f"{path.name}, {where}: {reason}\n{text}\n", encoding="utf-8")
    return NotebookError(f"{path.name}, {where}: {reason} (log: {log})")


def _cell_number(path: Path, index: int, injected: bool) -> int:
    """Return the number of a cell as a reader counts them: from 1, without the cell that papermill injects."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    tagged = [i for i, cell in enumerate(cells) if "parameters" in cell.get("metadata", {}).get("tags", [])]
    return index + 1 - int(injected and bool(tagged) and index > tagged[0])
