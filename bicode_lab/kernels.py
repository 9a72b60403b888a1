"""Compile loops over events with numba, and cache the machine code for exactly these sources.

A *kernel* is a function that numba compiles. Numba caches the machine code of a kernel and compiles the kernel again
when its file changes. Numba does not watch the other files whose functions a kernel calls, so after an update it would
use machine code with old functions inside. `njit` therefore caches the kernels of a file in a folder whose name
contains a hash of the file and of all files that it imports, directly or through others: changed sources use another
folder. No file is ever deleted.

The first of these places that can be written holds the folder: the one that ``NUMBA_CACHE_DIR`` names, this package's
``__pycache__``, the user's cache folder, the folder for temporary files. Where none can be written, kernels are
compiled once in each process and not cached. `numba.config.CACHE_DIR` is set only while `njit` decorates a function,
so the kernels of other libraries stay where they are.
"""

from __future__ import annotations

import ast
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
            folder = cache_folder(function.__module__)
            _config.CACHE_DIR = str(folder or "")
            try:
                wanted = options if folder else {**options, "cache": False}
                compiled: Function = numba.njit(**wanted)(function)
            finally:
                _config.CACHE_DIR = given
            return compiled

    return decorate


def cache_folder(module: str) -> Path | None:
    """Return the folder in which the kernels of a module are cached; make it where it is missing.

    Parameters
    ----------
    module : str
        Dotted name of a module that has been imported or is being imported.

    Returns
    -------
    Path or None
        None where no place can be written.
    """
    return _first_writable(f"kernels-{_hash_of_sources(module)}", _config.CACHE_DIR)


@cache
def _hash_of_sources(module: str) -> str:
    """Return a hash of the names and contents of a module's file and of all files that it reaches by imports."""
    ours = {module.partition(".")[0], PACKAGE.name}
    names, waiting = {module}, [module]
    while waiting:
        reached = {
            name for name in _imports(waiting.pop()) if name.partition(".")[0] in ours and _file_of(name)
        } - names
        names |= reached
        waiting += reached
    digest = hashlib.sha256()
    for name in sorted(names):
        path = _file_of(name)
        digest.update(f"{name}\0".encode() + (path.read_bytes() if path else b"") + b"\0")
    return digest.hexdigest()[:16]


def _imports(module: str) -> Iterator[str]:
    """Yield the modules that a module's imports can mean: in ``from a import b``, both a and a.b."""
    path = _file_of(module)
    if path is None:
        return
    package = module.split(".")[: None if path.name == "__init__.py" else -1]
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*base, *([node.module] if node.module else [])])
            yield source
            yield from (f"{source}.{alias.name}" for alias in node.names)


def _file_of(module: str) -> Path | None:
    """Return the file of a module; None if it has none."""
    package, *rest = module.split(".")
    places = [Path(root).joinpath(*rest) for root in getattr(sys.modules.get(package), "__path__", ())]
    tries = [path for place in places for path in (place.with_suffix(".py"), place / "__init__.py")]
    alone = getattr(sys.modules.get(module), "__file__", None)
    return next((path for path in tries if path.is_file()), Path(alone) if alone else None)


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
