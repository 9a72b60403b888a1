"""``bicode doctor``: is everything here, and does it work? One line per check, with the way out."""

from __future__ import annotations

import os
import platform
import re
import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

import click

INSTALL = "run: make clean-all figures (or: pip install --require-hashes -r environment/requirements.txt)"
MINIMUM_FREE_GB = 1.0

Check = tuple[str, Callable[[], str], str]
"""What is checked, a function that returns what it found or raises, and the way out."""


@click.command()
def doctor() -> int:
    """Check Python, every dependency, numba, ArUco, the kernel, fonts, folders and memory."""
    failures = 0
    for name, check, way_out in all_checks():
        try:
            click.echo(f"ok    {name}: {check()}")
        except Exception as error:  # whatever is broken is what we are here to tell
            failures += 1
            reason = (str(error).strip().splitlines() or [type(error).__name__])[-1]
            click.echo(f"FAIL  {name}: {reason}; {way_out}")
    click.echo("all is well" if not failures else f"{failures} to mend")
    return 1 if failures else 0


def all_checks() -> Iterator[Check]:
    """Nothing in, the checks out, quick ones first."""
    yield "python", check_python, "install Python 3.11, 3.12 or 3.13, then make PYTHON=python3.12 clean-all figures"
    pins = read_pins()
    for name, allowed in requirements():
        yield name, partial(check_package, name, allowed, pins.get(name.lower())), INSTALL
    yield "cv2.aruco", check_aruco, "uninstall other opencv packages, they share a folder; then " + INSTALL
    yield "numba", check_numba, INSTALL
    yield "fonts", check_fonts, INSTALL
    yield "folders", check_folders, "set NUMBA_CACHE_DIR and MPLCONFIGDIR to folders that can be written"
    yield "machine", check_machine, "close other programs, or run with --jobs 1"
    yield "kernel", check_kernel, INSTALL


def requirements() -> list[tuple[str, str]]:
    """Nothing in, (package, versions allowed) of every dependency out."""
    try:
        lines = metadata.requires("bicode-lab") or []
    except metadata.PackageNotFoundError:
        import tomllib

        text = (Path(__file__).resolve().parents[2] / "pyproject.toml").read_text(encoding="utf-8")
        lines = tomllib.loads(text)["project"]["dependencies"]
    plain = [line for line in lines if "extra ==" not in line]
    parts = [re.fullmatch(r"([\w.-]+)\s*(.*)", line.split(";")[0].strip()) for line in plain]
    return [(part.group(1), part.group(2)) for part in parts if part]


def read_pins() -> dict[str, str]:
    """Nothing in, the pinned version of every package out; empty outside a clone."""
    path = Path(__file__).resolve().parents[2] / "environment" / "requirements.txt"
    if not path.is_file():
        return {}
    return dict(re.findall(r"^([\w.-]+)==([\w.]+)", path.read_text(encoding="utf-8"), flags=re.MULTILINE))


def check_python() -> str:
    """The version, or an error where it is too old."""
    if tuple(sys.version_info) < (3, 11):
        raise RuntimeError(f"{platform.python_version()} is older than 3.11")
    return f"{platform.python_version()} at {sys.executable}"


def check_package(name: str, allowed: str, pin: str | None) -> str:
    """A package's version, or an error where it is missing or not one of those allowed."""
    from packaging.specifiers import SpecifierSet

    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        raise RuntimeError("is not installed") from None
    if not SpecifierSet(allowed).contains(version, prereleases=True):
        raise RuntimeError(f"{version} is here, {allowed} is needed")
    return version if pin in (None, version) else f"{version} (the pins have {pin}; figures may differ a little)"


def check_aruco() -> str:
    """Draw a 2D marker and find it again."""
    import cv2
    import numpy as np

    aruco: Any = cv2.aruco
    dictionary = aruco.getPredefinedDictionary(aruco.DICT_4X4_50)
    image = np.full((120, 120), 255, np.uint8)
    image[20:100, 20:100] = aruco.generateImageMarker(dictionary, 7, 80)
    _, ids, _ = aruco.ArucoDetector(dictionary).detectMarkers(image)
    if ids is None or ids.ravel().tolist() != [7]:
        raise RuntimeError(f"marker 7 was drawn and {ids} was found")
    return f"OpenCV {cv2.__version__} finds a marker"


def check_numba() -> str:
    """Compile one function and call it."""
    import numba

    double: Callable[[int], int] = numba.njit(lambda x: 2 * x)
    if double(21) != 42:
        raise RuntimeError("a compiled function gives a wrong result")
    return f"compiles, {numba.get_num_threads()} threads"


def check_fonts() -> str:
    """The font of the figures is found."""
    from matplotlib import font_manager

    return Path(font_manager.findfont("DejaVu Sans", fallback_to_default=False)).name


def check_folders() -> str:
    """Caches and results can be written."""
    import matplotlib as mpl

    package = Path(__file__).resolve().parents[2] / "bicode_lab"
    folders = [Path(tempfile.gettempdir()), Path(mpl.get_cachedir())]
    folders.append(Path(os.environ.get("NUMBA_CACHE_DIR", package)))
    for folder in folders:
        if not os.access(folder, os.W_OK):
            raise RuntimeError(f"{folder} cannot be written")
    return "caches can be written"


def check_machine() -> str:
    """Cores and free memory."""
    import psutil

    free_gb = psutil.virtual_memory().available / 1e9
    if free_gb < MINIMUM_FREE_GB:
        raise RuntimeError(f"{free_gb:.1f} GB of memory are free, {MINIMUM_FREE_GB:.0f} GB are needed")
    return f"{os.cpu_count()} cores, {free_gb:.1f} GB of memory free"


def check_kernel() -> str:
    """Run a notebook of one line through the runner."""
    import nbformat

    from bicode_studies.notebook.runner import run_notebook

    node = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("quick = True  # short settings")])
    node.cells[0].metadata["tags"] = ["parameters"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "00_check_kernel.ipynb"
        nbformat.write(node, path)
        done = run_notebook(path, output=Path(folder) / "out.ipynb", figures=folder)
    return f"starts and runs a cell in {done.seconds:.1f} s"
