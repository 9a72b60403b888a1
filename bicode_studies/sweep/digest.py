"""The digest of the code that a result depends on.

A trial is kept under the digest of the code that made it, so trials of changed code run again. Changes that cannot
alter a result leave the digest as it is: comments, docstrings, imports for type checkers, the order of imports, and the
place and name of a module. The digests form a tree. The digest of a module is the hash of its own code, in which each
import of a module of ours is replaced by the names it imports and the digest of the module that defines them. The
digest of a function adds the versions of the libraries that compute, and the bytes of the data files that the caller
names.

Imports by name at run time (``importlib``) are not seen.
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
DIGITS = 16


@lru_cache
def digest_of(function: Callable[..., Any], data_files: tuple[str, ...]) -> str:
    """Return the digest of all that the results of a function depend on.

    It is computed once per process, soon after the code is loaded.

    Parameters
    ----------
    function : callable
        Defined at the top of a module, so that other processes find it by its name.
    data_files : tuple of str
        Paths of data files, relative to the folder that holds the packages.

    Returns
    -------
    str
        16 hexadecimal digits.

    Raises
    ------
    ValueError
        If the function cannot be found by its name, a data file is missing, or modules import each other in a circle.
    """
    found = getattr(sys.modules.get(function.__module__), function.__qualname__, None)
    if function.__module__ == "__main__" or found is not function:
        raise ValueError(
            f"{function.__module__}.{function.__qualname__} cannot be found by other processes; "
            "define it with def at the top of a module"
        )
    parts = [function.__name__, module_digests(function.__module__)[function.__module__]]
    parts += [f"{library} {metadata.version(library)}" for library in COMPUTING]
    root = Path(__file__).resolve().parents[2]
    for name in data_files:
        path = root / name
        if not path.is_file():
            raise ValueError(f"data file {name} is not in the folder that holds {PACKAGES[0]}; name one that is there")
        parts.append(f"{path.name} {hashlib.sha256(path.read_bytes()).hexdigest()}")
    return _hash(parts)


def module_digests(module: str) -> dict[str, str]:
    """Return the digest of a module and of each module of ours that its results depend on.

    Parameters
    ----------
    module : str
        Dotted name of a module that was imported.

    Returns
    -------
    dict of str to str
        By dotted name, 16 hexadecimal digits. Modules of `PACKAGES` and of the package of `module` count.

    Raises
    ------
    ValueError
        If a name cannot be followed to the module that defines it, or modules import each other in a circle.

    Examples
    --------
    >>> import bicode_lab.marker.packet
    >>> sorted(module_digests("bicode_lab.marker.packet"))
    ['bicode_lab.marker.manchester', 'bicode_lab.marker.packet']
    """
    tree = _Tree(_roots(module))
    tree.digest(module)
    return tree.digests


def normalise(tree: ast.Module) -> str:
    r"""Return the code of a module in one form, without comments, docstrings, imports and ``__all__``.

    Parameters
    ----------
    tree : ast.Module
        Syntax tree; it is changed.

    Examples
    --------
    >>> print(normalise(ast.parse("import math\ndef f( x ):  # why\n  'what'\n  return (x+1)")))
    def f(x):
        return x + 1
    """
    for node in ast.walk(tree):
        for field in ("body", "orelse", "finalbody"):
            lines = getattr(node, field, None)
            if isinstance(lines, list) and lines:
                kept = list(_kept(lines))
                setattr(node, field, kept or ([ast.Pass()] if field == "body" and node is not tree else []))
    return ast.unparse(tree)


def _kept(lines: Iterable[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield the statements that do something."""
    for line in lines:
        is_text = (
            isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant) and isinstance(line.value.value, str)
        )
        if isinstance(line, ast.If) and _is_for_types(line):
            yield from _kept(line.orelse)
        elif not (is_text or isinstance(line, ast.Import | ast.ImportFrom) or _lists_names(line)):
            yield line


def _is_for_types(node: ast.If) -> bool:
    """Return True for ``if TYPE_CHECKING``."""
    return ast.unparse(node.test).endswith("TYPE_CHECKING")


def _lists_names(line: ast.stmt) -> bool:
    """Return True for an assignment to ``__all__``."""
    return isinstance(line, ast.Assign) and ast.unparse(line.targets[0]) == "__all__"


class _Tree:
    """The digests of modules, each worked out once.

    Attributes
    ----------
    digests : dict of str to str
        By the dotted names of the modules reached so far.
    """

    def __init__(self, roots: dict[str, Path]) -> None:
        self.digests: dict[str, str] = {}
        self._roots = roots
        self._open: list[str] = []  # modules whose digest is being worked out

    def digest(self, module: str) -> str:
        """Return the digest of a module of ours."""
        if module not in self.digests:
            if module in self._open:
                circle = " -> ".join([*self._open[self._open.index(module) :], module])
                raise ValueError(f"modules import each other in a circle, {circle}; move what both need to a third")
            self._open.append(module)
            self.digests[module] = _hash([*self._own_code(module), *sorted(set(self._imports(module)))])
            self._open.pop()
        return self.digests[module]

    def _own_code(self, module: str) -> Iterator[str]:
        """Yield the code of a module and what the ``__init__`` of its folders do beside importing.

        The ``__init__`` of a whole package is left out: it only looks names up.
        """
        path = self._file_of(module)
        yield normalise(_parsed(path)) if path else ""
        folders = module.split(".")[:-1]
        for depth in range(len(folders), 1, -1):
            path = self._file_of(".".join(folders[:depth]))
            code = normalise(_parsed(path)) if path else ""
            if code:
                yield code

    def _imports(self, module: str) -> Iterator[str]:
        """Yield a line for each name that a module imports: the name, and where its meaning comes from."""
        path = self._file_of(module)
        if path is None:
            return
        for source, name, local in _imported(_parsed(path), module, path.name == "__init__.py", for_types=False):
            if source.split(".")[0] not in self._roots:
                if name != "TYPE_CHECKING":
                    yield f"{local} = {source}.{name}"
            else:
                home, own_name = self._home(source, name)
                yield f"{local} = {own_name} of {self.digest(home)}"

    def _home(self, source: str, name: str) -> tuple[str, str]:
        """Follow a name through re-exports to the module that defines it; a module has the name "module"."""
        inner = f"{source}.{name}" if name else source
        if self._file_of(inner):
            return inner, "module"
        path = self._file_of(source)
        if path is None:
            raise ValueError(f"{source} has no file, so the code of its {name!r} cannot be told; is it installed?")
        if path.name != "__init__.py":
            return source, name
        stub = path.with_suffix(".pyi")  # it lists the names that a package imports when they are first used
        tree = _parsed(stub if stub.is_file() else path)
        for module, other, local in _imported(tree, source, is_package=True, for_types=True):
            if local == name and module.split(".")[0] in self._roots:
                return self._home(module, other)
        if name not in _defined(tree):
            raise ValueError(
                f"{path} does not say where {name!r} comes from; import it from the module that defines it"
            )
        return source, name

    def _file_of(self, module: str) -> Path | None:
        """Return the file of a module; None where there is no such module of ours."""
        first, *rest = module.split(".")
        if first not in self._roots:
            return None
        place = self._roots[first].joinpath(*rest)
        tries = (place.with_suffix(".py"), place / "__init__.py")
        return next((path for path in tries if path.is_file()), None)


def _imported(tree: ast.AST, module: str, is_package: bool, *, for_types: bool) -> Iterator[tuple[str, str, str]]:
    """Yield (module, name in it, name here) of each import; the second is empty where a module itself is imported.

    An ``__init__`` that loads names when they are asked for tells them to type checkers; `for_types` includes those.
    """
    package = module.split(".") if is_package else module.split(".")[:-1]
    for node in ast.walk(tree) if for_types else _statements(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "", alias.asname or alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*base, *([node.module] if node.module else [])])
            yield from ((source, alias.name, alias.asname or alias.name) for alias in node.names)


def _statements(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield all nodes of a syntax tree but those under ``if TYPE_CHECKING``."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        if isinstance(node, ast.If) and _is_for_types(node):
            waiting.extend(node.orelse)
        else:
            waiting.extend(ast.iter_child_nodes(node))


def _defined(tree: ast.Module) -> set[str]:
    """Return the names that the top level of a module defines or assigns."""
    names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    for line in tree.body:
        if isinstance(line, ast.Assign | ast.AnnAssign):
            names |= {
                node.id for node in ast.walk(line) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
            }
    return names


def _parsed(path: Path) -> ast.Module:
    """Return the syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def _roots(module: str) -> dict[str, Path]:
    """Return the folder or file of each package whose code counts: `PACKAGES` and the one of a module."""
    loaded = sys.modules[module].__file__
    if loaded is None:
        raise ValueError(f"{module} has no file, so its code cannot be told from other code; define it in one")
    path = Path(loaded).resolve()
    depth = module.count(".") + (path.name == "__init__.py")
    own = path if depth == 0 else path.parents[depth - 1]
    home = Path(__file__).resolve().parents[2]
    return {**{name: home / name for name in PACKAGES}, module.split(".")[0]: own}


def _hash(parts: Iterable[str]) -> str:
    """Return the hash of some texts in their order."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:DIGITS]
