"""``pip install .`` in a clone gives a command that works anywhere, with all that it needs."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TEXTS = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("notebooks/*.ipynb"), *ROOT.glob(".binder/*")]
PACKAGES = ("bicode_lab", "bicode_studies")
DISTRIBUTIONS = {  # of modules that have another name, or come with another package
    "cv2": "opencv-contrib-python-headless", "skimage": "scikit-image", "yaml": "pyyaml", "PIL": "matplotlib",
    "jupyter_client": "jupyterlab", "jupyter_core": "jupyterlab", "IPython": "jupyterlab", "ipykernel": "jupyterlab",
    "tornado": "jupyterlab", "jinja2": "nbconvert", "dask": "distributed", "llvmlite": "numba",
    "backports": "backports-zstd",
}  # fmt: skip
STANDARD = {*sys.stdlib_module_names, "compression"}  # the last one from Python 3.14 on


def project() -> dict[str, object]:
    """Return the table of the project."""
    table: dict[str, object] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return table


def test_everything_that_is_imported_is_a_dependency() -> None:
    table = project()
    extras: dict[str, list[str]] = table["optional-dependencies"]  # type: ignore[assignment]
    listed = [*table["dependencies"], *(one for each in extras.values() for one in each)]  # type: ignore[misc]
    declared = {re.split(r"[^\w-]", line)[0].lower().replace("_", "-") for line in listed}
    for name in PACKAGES:
        for path in sorted((ROOT / name).rglob("*.py")):
            if path.name == "bicode_tx.py":
                continue
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                found = [each.name for each in node.names] if isinstance(node, ast.Import) else []
                if isinstance(node, ast.ImportFrom) and not node.level:
                    found.append(node.module or "")
                for top in {one.split(".")[0] for one in found} - STANDARD - set(PACKAGES):
                    wanted = DISTRIBUTIONS.get(top, top).lower().replace("_", "-")
                    assert wanted in declared, f"{path.relative_to(ROOT)} imports {top}, which nothing installs"


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: path.name)
def test_nobody_is_sent_to_a_name_that_is_not_ours(path: Path) -> None:
    assert not re.search(r"pip install\s+['\"\\]*bicode", path.read_text(encoding="utf-8"))


def test_no_message_sends_there_either() -> None:
    for name in PACKAGES:
        for path in (ROOT / name).rglob("*.py"):
            assert not re.search(r"pip install\s+['\"\\]*bicode", path.read_text(encoding="utf-8")), path


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment with nothing but the package, installed by pip from a copy of the clone.

    The packages that it depends on are those of this environment, so that no network is needed.
    """
    folder = tmp_path_factory.mktemp("install")
    clone = folder / "clone"
    clone.mkdir()
    for name in (*PACKAGES, "pyproject.toml", "README.md", "LICENSE"):
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, clone / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, clone)
    venv.create(folder / "env", with_pip=True)
    python = folder / "env" / "bin" / "python"
    ask = [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    site = subprocess.run(ask, capture_output=True, text=True, check=True).stdout.strip()
    # Behind the environment's own packages, so that the copy is found first; .pth files there are not followed.
    others = [entry for entry in sys.path if entry.endswith("site-packages")]
    (Path(site) / "others.pth").write_text("\n".join(others) + "\n", encoding="utf-8")
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", folder, "."]
    subprocess.run(build, cwd=clone, check=True, env=clean(folder))
    (wheel,) = folder.glob("bicode_lab-*.whl")
    words = [python, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", wheel]
    subprocess.run(words, cwd=folder, check=True, env=clean(folder))
    shutil.rmtree(clone)
    return folder


def clean(folder: Path) -> dict[str, str]:
    """Return an environment without anything of this clone, with a home of its own."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "BICODE", "NUMBA"))}
    (folder / "home").mkdir(exist_ok=True)
    return {**kept, "HOME": str(folder / "home"), "PIP_DISABLE_PIP_VERSION_CHECK": "1"}


def call(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run the installed command in an empty folder."""
    work = folder / "work"
    work.mkdir(exist_ok=True)
    command = [str(folder / "env" / "bin" / "bicode"), *words]
    return subprocess.run(command, cwd=work, env=clean(folder), capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_the_command_simulates_inspects_and_decodes_anywhere(installed: Path) -> None:
    where = "import bicode_studies, bicode_lab.fabrication as f; print(bicode_studies.__file__, f.__file__)"
    python = installed / "env" / "bin" / "python"
    at = subprocess.run([python, "-c", where], cwd=installed, env=clean(installed), capture_output=True, text=True)
    assert at.stdout.count(str(installed)) == 2, at
    for words in (
        ("--version",),
        ("marker", "--id", "37", "--out", "parts"),
        ("simulate", "m.npz", "--marker", "parts/marker.toml", "--distance-m", "4", "--seconds", "0.1"),
        ("inspect", "m.npz"),
    ):
        done = call(installed, *words)
        assert done.returncode == 0, done.stderr
        assert "Traceback" not in done.stderr
    done = call(installed, "decode", "m.npz", "--marker", "parts/marker.toml")
    assert done.returncode == 0, done.stderr
    assert "ID 37: in 4 of 4 periods" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("command", ["sweep 08", "claims", "figures", "html", "calibrate", "stress", "run 06"])
def test_what_needs_the_repository_says_so_at_once(installed: Path, command: str) -> None:
    done = call(installed, *command.split())
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "clone" in done.stderr or "cloned" in done.stderr


@pytest.mark.slow
def test_the_style_and_the_tables_are_installed(installed: Path) -> None:
    code = (
        "from importlib.resources import files as f\n"
        "assert (f('bicode_lab') / 'constants.csv').is_file()\n"
        "assert (f('bicode_studies.plots') / 'bicode.mplstyle').is_file()\n"
        "assert (f('bicode_studies.what_if') / 'page.css').is_file()\n"
        "assert (f('bicode_lab.fabrication') / 'bicode_tx.py').is_file()\n"
    )
    python = installed / "env" / "bin" / "python"
    subprocess.run([python, "-c", code], cwd=installed, env=clean(installed), check=True)
