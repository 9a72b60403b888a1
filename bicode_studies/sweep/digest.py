"""Which code made a result?   a function -> a hash of all code its results depend on

A trial is kept under the digest of the code that made it: changed code is another digest,
so its trials run again; a comment or a docstring changes nothing and must not. So what is
hashed is the code without them: the syntax tree of the function's module and of every
module it imports, and those import in turn, as long as they are of this package (or of the
function's own). Imports that are made only for type checking and by name at run time
(``importlib``) are not followed. With it go the versions of the libraries that compute,
and the bytes of files the caller names, such as calibrated constants.
"""

from __future__ import annotations

import ast
import hashlib
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

COMPUTING = ("numpy", "numba", "opencv-contrib-python-headless", "scipy", "scikit-image")
PACKAGES = ("bicode_lab", "bicode_studies")


@lru_cache
def digest_of(function: Callable[..., Any], data_files: tuple[str, ...]) -> str:
    """A function of a module and names of files in, the digest of all its results depend on out.

    Parameters
    ----------
    function : callable
        Defined at the top of a module, so that other processes find it by its name.
    data_files : tuple of str
        Paths, seen from the folder that holds this package.

    Returns
    -------
    str
        16 hexadecimal digits. It is worked out once in a process, near the moment its code is loaded.

    Raises
    ------
    ValueError
        A function that cannot be found by its name, a file that is not there.
    """
    found = getattr(sys.modules.get(function.__module__), function.__qualname__, None)
    if function.__module__ == "__main__" or found is not function:
        raise ValueError(
            f"{function.__module__}.{function.__qualname__} cannot be found by other processes; "
            "define it with def at the top of a module"
        )
    hashed = hashlib.sha256()
    for name, text in sorted(code_of(function.__module__).items()):
        hashed.update(f"{name}\n{text}\n".encode())
    for library in COMPUTING:
        hashed.update(f"{library} {metadata.version(library)}\n".encode())
    root = Path(__file__).resolve().parents[2]
    for name in data_files:
        path = root / name
        if not path.is_file():
            raise ValueError(f"data file {name} is not in the folder that holds {PACKAGES[0]}; name one that is there")
        hashed.update(name.encode() + path.read_bytes())
    return hashed.hexdigest()[:16]


def code_of(module: str) -> dict[str, str]:
    """A module that was imported in; the code of it and of all it imports of its package and of this one out, by name.

    Examples
    --------
    >>> import bicode_lab.marker.packet
    >>> sorted(code_of("bicode_lab.marker.packet"))
    ['bicode_lab.marker', 'bicode_lab.marker.board', 'bicode_lab.marker.led', 'bicode_lab.marker.manchester',
     'bicode_lab.marker.packet', 'bicode_lab.marker.marker']
    """
    roots = _roots(module)
    found: dict[str, str] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        path = _file_of(name, roots)
        if name in found or path is None:
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        found[name] = normalise(tree)
        waiting += _imports(tree, name, is_package=path.name == "__init__.py")
        if name.count(".") > 1:  # its folder's __init__ runs first; that of the whole package only looks names up
            waiting.append(name.rpartition(".")[0])
    return found


def normalise(tree: ast.Module) -> str:
    r"""A syntax tree in; its code in one form, without comments and docstrings, out.

    Examples
    --------
    >>> print(normalise(ast.parse("def f( x ):  # why\n  'what'\n  return (x+1)")))
    def f(x):
        return x + 1
    """
    for node in ast.walk(tree):
        for field in ("body", "orelse", "finalbody"):
            lines = getattr(node, field, None)
            if isinstance(lines, list) and lines:
                kept = [line for line in lines if not _is_only_text(line)]
                setattr(node, field, kept or ([ast.Pass()] if field == "body" and node is not tree else []))
    return ast.unparse(tree)


def _is_only_text(line: ast.stmt) -> bool:
    """True for a docstring, or any other text that stands alone and does nothing."""
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant) and isinstance(line.value.value, str)


def _roots(module: str) -> dict[str, Path]:
    """A module in; the names whose code counts, this package and the module's own, with their folder or file, out."""
    loaded = sys.modules[module].__file__
    if loaded is None:
        raise ValueError(f"{module} has no file, so its code cannot be told from other code; define it in one")
    path = Path(loaded).resolve()
    depth = module.count(".") + (path.name == "__init__.py")
    own = path if depth == 0 else path.parents[depth - 1]
    home = Path(__file__).resolve().parents[2]
    return {**{name: home / name for name in PACKAGES}, module.split(".")[0]: own}


def _file_of(name: str, roots: dict[str, Path]) -> Path | None:
    """A dotted name in, the file of that module out; None where it is not a module of the packages that count."""
    first, *rest = name.split(".")
    if first not in roots:
        return None
    place = roots[first].joinpath(*rest)
    tries = (place.with_suffix(".py"), place / "__init__.py")
    return next((path for path in tries if path.is_file()), None)


def _imports(tree: ast.Module, module: str, is_package: bool) -> Iterator[str]:
    """A syntax tree and its module's name in; names that it may import, modules and what is in them, out."""
    package = module.split(".") if is_package else module.split(".")[:-1]
    for node in _statements(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*base, *([node.module] if node.module else [])])
            yield source
            yield from (f"{source}.{alias.name}" for alias in node.names)


def _statements(tree: ast.AST) -> Iterator[ast.AST]:
    """A syntax tree in, all its nodes out but those under ``if TYPE_CHECKING``."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        children: Iterable[ast.AST] = ast.iter_child_nodes(node)
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            children = node.orelse
        waiting.extend(children)
