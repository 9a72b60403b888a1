"""Compile loops over events with numba, and cache the machine code for exactly these sources.

A *kernel* is a function that numba compiles. Numba caches the machine code of a kernel and compiles the kernel again
when its file changes. Numba does not watch the other files whose functions a kernel calls, so after an update it would
use machine code with old functions inside. `njit` therefore caches the kernels of a package in a folder whose name
contains a hash of all sources: changed sources use another folder. No file is ever deleted.

The first of these places that can be written holds the folder: the one that ``NUMBA_CACHE_DIR`` names, this package's
``__pycache__``, the user's cache folder, the folder for temporary files. Where none can be written, kernels are
compiled once in each process and not cached. `numba.config.CACHE_DIR` is set only while `njit` decorates a function,
so the kernels of other libraries stay where they are.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba

PACKAGE = Path(__file__).parent

Function = TypeVar("Function", bound=Callable[..., Any])

_config: Any = numba.config
_lock = threading.Lock()


def njit(**options: Any) -> Callable[[Function], Function]:
    """Return a decorator that compiles a function as ``numba.njit(**options)`` does, with a cache for these sources.

    Parameters
    ----------
    **options
        Options of `numba.njit`, for example ``cache=True`` or ``error_model="numpy"``.

    Returns
    -------
    callable
        The decorator; the function that it returns is compiled at its first call.

    Examples
    --------
    >>> @njit(inline="always")
    ... def double(x):
    ...     return 2 * x
    >>> double(21)
    42
    """

    def decorate(function: Function) -> Function:
        with _lock:
            given = _config.CACHE_DIR
            folder = cache_folder(function.__module__.partition(".")[0])
            _config.CACHE_DIR = str(folder or "")
            try:
                wanted = options if folder else {**options, "cache": False}
                compiled: Function = numba.njit(**wanted)(function)
            finally:
                _config.CACHE_DIR = given
            return compiled

    return decorate


def cache_folder(package: str = "bicode_lab") -> Path | None:
    """Return the folder in which the kernels of a package are cached; make it where it is missing.

    Parameters
    ----------
    package : str
        Name of an imported package.

    Returns
    -------
    Path or None
        None where no place can be written.
    """
    folders = {PACKAGE, *(Path(place) for place in getattr(sys.modules.get(package), "__path__", ()))}
    return _first_writable(f"kernels-{_hash_of_sources(frozenset(folders))}", _config.CACHE_DIR)


@cache
def _hash_of_sources(folders: frozenset[Path]) -> str:
    """Return a hash of the names and contents of all Python files in some folders."""
    digest = hashlib.sha256()
    for folder in sorted(folders):
        for path in sorted(folder.rglob("*.py")):
            digest.update(f"{folder.name}/{path.relative_to(folder).as_posix()}\0".encode())
            digest.update(path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


@cache
def _first_writable(name: str, given: str) -> Path | None:
    """Return the folder of a name in the first place that can be written."""
    for place in _places(given):
        try:
            (place / name).mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=place / name).close()
        except OSError:
            continue
        return place / name
    return None


def _places(given: str) -> Iterator[Path]:
    """Yield the places for the cache, the preferred one first."""
    if given:
        yield Path(given)
    yield PACKAGE / "__pycache__"
    if os.environ.get("XDG_CACHE_HOME"):
        yield Path(os.environ["XDG_CACHE_HOME"]) / "bicode_lab"
    try:
        if Path.home().is_dir():
            yield Path.home() / ".cache" / "bicode_lab"
    except RuntimeError:  # this user has no home
        pass
    user = os.getuid() if hasattr(os, "getuid") else os.environ.get("USERNAME", "")
    temporary = Path(tempfile.gettempdir()) / f"bicode_lab-{user}"
    try:
        temporary.mkdir(mode=0o700, exist_ok=True)
        if temporary.stat().st_uid == user or not hasattr(os, "getuid"):  # cached code of another user is not trusted
            yield temporary
    except OSError:
        pass
