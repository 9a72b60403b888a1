"""``bicode doctor``: check that all that is needed is installed and works, with one line per check."""

from __future__ import annotations

import importlib.util
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

IN_A_CLONE = "run: make clean-all figures (or: pip install --require-hashes -r environment/requirements.txt)"
ELSEWHERE = "in a clone of the repository, run: pip install ."
EXTRAS = {
    # extra: (module, what needs it); those who need no more than notebooks and commands do without
    "app": ("voila", "bicode what-if needs it"),
    "cluster": ("distributed", "--cluster needs it"),
}
MINIMUM_FREE_GB = 1.0
PROJECT = Path(__file__).resolve().parents[2]

Check = tuple[str, Callable[[], str], str]
"""Name of the check, a function that returns what it found or raises an error, and what to do in that case."""


@click.command()
def doctor() -> int:
    """Check Python, all dependencies, ArUco, numba, fonts, folders, memory and the notebook kernel.

    The exit code is 1 if a check fails. What only one command needs may be missing; then that is said.
    """
    failures = 0
    for name, check, way_out in all_checks():
        try:
            click.echo(f"ok    {name}: {check()}")
        except Exception as error:  # any error is a result of the check
            failures += 1
            reason = (str(error).strip().splitlines() or [type(error).__name__])[-1]
            click.echo(f"FAIL  {name}: {reason}; {way_out}")
    missing = missing_extras()
    for extra, needs in missing.items():
        click.echo(f"none  {EXTRAS[extra][0]}: is not installed; {needs}: in a clone, pip install '.[{extra}]'")
    well = "all is well" if not missing else "all is well, but for " + " and ".join(EXTRAS[each][0] for each in missing)
    click.echo(well if not failures else f"{failures} to mend")
    return 1 if failures else 0


def missing_extras() -> dict[str, str]:
    """Return the extras that are not installed, and what needs each."""
    return {extra: needs for extra, (module, needs) in EXTRAS.items() if importlib.util.find_spec(module) is None}


def way_to_install() -> str:
    """Return how packages are installed: by make in a clone of the repository, else by pip."""
    return IN_A_CLONE if (PROJECT / "Makefile").is_file() else ELSEWHERE


def all_checks() -> Iterator[Check]:
    """Yield all checks, the quick ones first.

    Yields
    ------
    Check
    """
    yield "python", check_python, "install Python 3.11, 3.12 or 3.13, then make PYTHON=python3.12 clean-all figures"
    pins, install = read_pins(), way_to_install()
    for name, allowed in requirements():
        yield name, partial(check_package, name, allowed, pins.get(name.lower())), install
    yield "cv2.aruco", check_aruco, "uninstall other opencv packages, they share a folder; then " + install
    yield "numba", check_numba, install
    yield "fonts", check_fonts, install
    yield "folders", check_folders, "set NUMBA_CACHE_DIR and MPLCONFIGDIR to folders that can be written to"
    yield "kernels", check_kernels, "delete it, then it is compiled anew"
    yield "machine", check_machine, "close other programs, or run with --jobs 1"
    yield "kernel", check_kernel, install


def requirements() -> list[tuple[str, str]]:
    """Return all dependencies.

    Returns
    -------
    list of (str, str)
        Name of each package and the versions that are allowed, such as ">=2.0".
    """
    try:
        lines = metadata.requires("bicode-lab") or []
    except metadata.PackageNotFoundError:
        import tomllib

        text = (PROJECT / "pyproject.toml").read_text(encoding="utf-8")
        lines = tomllib.loads(text)["project"]["dependencies"]
    plain = [line for line in lines if "extra ==" not in line]
    parts = [re.fullmatch(r"([\w.-]+)\s*(.*)", line.split(";")[0].strip()) for line in plain]
    return [(part.group(1), part.group(2)) for part in parts if part]


def read_pins() -> dict[str, str]:
    """Return the pinned version of each package.

    Returns
    -------
    dict of str to str
        Versions by name of the package; empty outside a clone of the repository.
    """
    path = PROJECT / "environment" / "requirements.txt"
    if not path.is_file():
        return {}
    return dict(re.findall(r"^([\w.-]+)==([\w.]+)", path.read_text(encoding="utf-8"), flags=re.MULTILINE))


def check_python() -> str:
    """Return the version of Python, or raise RuntimeError if it is too old."""
    if tuple(sys.version_info) < (3, 11):
        raise RuntimeError(f"{platform.python_version()} is older than 3.11")
    return f"{platform.python_version()} at {sys.executable}"


def check_package(name: str, allowed: str, pin: str | None) -> str:
    """Return the version of a package, or raise RuntimeError if it is missing or not allowed.

    Parameters
    ----------
    name : str
        Name of the package.
    allowed : str
        Versions that are allowed, such as ">=2.0".
    pin : str or None
        The pinned version; another one is allowed, but mentioned.

    Returns
    -------
    str
        The version, with a remark where it is not the pinned one.
    """
    from packaging.specifiers import SpecifierSet

    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        raise RuntimeError("is not installed") from None
    if not SpecifierSet(allowed).contains(version, prereleases=True):
        raise RuntimeError(f"{version} is installed, {allowed} is needed")
    return version if pin in (None, version) else f"{version} (the pins have {pin}; figures may differ a little)"


def check_aruco() -> str:
    """Draw a 2D marker and detect it with OpenCV."""
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
    """Compile a function with numba and call it."""
    import numba

    config: Any = numba.config
    if config.DISABLE_JIT:
        raise RuntimeError("NUMBA_DISABLE_JIT is set, so nothing is compiled and no kernel runs; unset it")
    double: Callable[[int], int] = numba.njit(lambda x: 2 * x)
    if double(21) != 42:
        raise RuntimeError("a compiled function gives a wrong result")
    return f"compiles, {numba.get_num_threads()} threads"


def check_fonts() -> str:
    """Find the font of the figures."""
    from matplotlib import font_manager

    return Path(font_manager.findfont("DejaVu Sans", fallback_to_default=False)).name


def check_folders() -> str:
    """Check that the folders of temporary files and caches can be written to."""
    import matplotlib as mpl

    from bicode_lab.kernels import cache_folder

    for folder in (Path(tempfile.gettempdir()), Path(mpl.get_cachedir())):
        if not os.access(folder, os.W_OK):
            raise RuntimeError(f"{folder} cannot be written to")
    kernels = cache_folder("bicode_lab.recognition.event_codes")
    if kernels is None:
        raise RuntimeError("compiled kernels cannot be cached, so every start is slow")
    return f"can be written to; kernels are cached in {kernels.parent}"


def check_kernels() -> str:
    """Read every compiled kernel of the present sources, or raise RuntimeError if one is damaged."""
    from bicode_studies.cli.helpers.kernel_files import count_kernels, damaged_kernels

    found = damaged_kernels()
    if found:
        more = f" and {len(found) - 1} more" if len(found) > 1 else ""
        raise RuntimeError(f"{found[0].file}{more} is damaged or cut short")
    return f"{count_kernels()} compiled, none is damaged"


def check_machine() -> str:
    """Count the cores, and check that there is enough free memory."""
    import psutil

    free_gb = psutil.virtual_memory().available / 1e9
    if free_gb < MINIMUM_FREE_GB:
        raise RuntimeError(f"{free_gb:.1f} GB of memory are free, {MINIMUM_FREE_GB:.0f} GB are needed")
    return f"{os.cpu_count()} cores, {free_gb:.1f} GB of memory free"


def check_kernel() -> str:
    """Run a notebook of one line."""
    import nbformat

    from bicode_studies.notebook.runner import run_notebook

    node = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("quick = True  # short settings")])
    node.cells[0].metadata["tags"] = ["parameters"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "00_check_kernel.ipynb"
        nbformat.write(node, path)
        done = run_notebook(path, output=Path(folder) / "out.ipynb", figures=folder)
    return f"starts and runs a cell in {done.seconds:.1f} s"
