"""Test of notebook 00 in JupyterLab: Run All Cells runs without an error."""

from __future__ import annotations

import json
import shutil
import time
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).resolve().parents[2] / "notebooks" / "00_start_here.ipynb"
RUN_S = 180


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """Copy the notebook to a temporary folder, because JupyterLab saves what it has run."""
    for name in ("CONFIG_DIR", "DATA_DIR", "RUNTIME_DIR"):
        monkeypatch.setenv(f"JUPYTER_{name}", str(tmp_path / name.lower()))
    for name in ("SETTINGS_DIR", "WORKSPACES_DIR"):
        monkeypatch.setenv(f"JUPYTERLAB_{name}", str(tmp_path / name.lower()))
    monkeypatch.setenv("BICODE_FIGURES", str(tmp_path / "figures"))
    (tmp_path / "notebooks").mkdir()
    return Path(shutil.copy(NOTEBOOK, tmp_path / "notebooks"))


def test_all_cells_run_in_jupyterlab(browser, serve, copy):
    server = [
        f"--ServerApp.root_dir={copy.parent}",
        "--ServerApp.port={port}",
        "--IdentityProvider.token=",
        "--no-browser",
    ]
    quiet = ["--allow-root", "--ServerApp.log_level=ERROR", "--LabApp.news_url=", "--LabApp.extension_manager=readonly"]
    browser.get(serve("-m", "jupyterlab", *server, *quiet, path=f"/lab/tree/{copy.name}"))
    _until(lambda: browser.find_elements("css selector", ".jp-Notebook .jp-CodeCell"), 90)
    _until(lambda: "Idle" in _status(browser), 90)
    _choose(browser, "Run", "Run All Cells")
    _until(lambda: _ran(browser, copy), RUN_S)
    cells = [cell for cell in json.loads(copy.read_text())["cells"] if cell["cell_type"] == "code"]
    outputs = [output for cell in cells for output in cell["outputs"]]
    assert not [output["ename"] for output in outputs if output["output_type"] == "error"]
    assert not [output["text"] for output in outputs if output.get("name") == "stderr"]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert browser.find_elements("css selector", ".jp-OutputArea-output img")


def _status(browser):
    """Return the state of the kernel as JupyterLab shows it, such as Idle or Busy."""
    found = browser.find_elements("css selector", ".jp-Notebook-ExecutionIndicator")
    return found[0].get_attribute("data-status").capitalize() if found else ""


def _choose(browser, menu, item):
    """Click an item of a menu."""
    for group, text in ((".lm-MenuBar-itemLabel", menu), (".lm-Menu-itemLabel", item)):
        _until(lambda group=group, text=text: _labelled(browser, group, text), 20)
        _labelled(browser, group, text)[0].click()


def _labelled(browser, group, text):
    return [label for label in browser.find_elements("css selector", group) if label.text == text]


def _ran(browser, copy):
    """Save, and return whether in the file all cells have run or any has failed."""
    _choose(browser, "File", "Save Notebook")
    time.sleep(1)
    code = [cell for cell in json.loads(copy.read_text())["cells"] if cell["cell_type"] == "code"]
    failed = any(output["output_type"] == "error" for cell in code for output in cell["outputs"])
    return failed or (all(cell["execution_count"] for cell in code) and _status(browser) == "Idle")


def _until(condition, seconds):
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, f"the condition does not hold after {seconds} s"
        time.sleep(0.3)
