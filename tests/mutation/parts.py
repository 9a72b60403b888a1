"""Which files are changed, which tests are asked about them, and which mutants belong to the sample."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path

from mutants import Mutant, mutants_of

PARTS = {  # folders, or files without their ending
    "marker": "bicode_lab/marker",
    "camera": "bicode_lab/camera",
    "recognition": "bicode_lab/recognition",
    "soft_receiver": "bicode_lab/soft_receiver",
    "recordings": "bicode_lab/recordings",
    "score": "bicode_studies/score",
    "statistics": "bicode_studies/statistics",
    "claims": "bicode_studies/claims",
}
PER_PART = 30  # mutants of a part in the sample
ALL_OF = {"score", "statistics"}  # small parts that every verdict rests on: never sampled
SEED = 1


def mutants_of_part(root: Path, part: str) -> list[Mutant]:
    """Return all mutants of a part, file by file."""
    return [
        mutant for path in _files(root / PARTS[part]) for mutant in mutants_of(_name(root, path), path.read_bytes())
    ]


def sample(mutants: Sequence[Mutant], count: int, seed: int) -> list[Mutant]:
    """Return as many mutants as asked for, drawn by seed and name, in the order in which they were drawn.

    A mutant has the same draw in every run, so a change of the sources changes the sample only where it must, and a
    larger sample holds the smaller one.
    """

    def draw(mutant: Mutant) -> str:
        return hashlib.sha256(repr((seed, *mutant.name)).encode()).hexdigest()

    return sorted(mutants, key=draw)[:count]


def asked_tests(root: Path, file: str) -> list[str]:
    """Return the files that pytest is given for a changed file, the nearest first.

    These are the test file of the same name, the file itself for its doctests, and the other tests of its folder. A
    kernel is also tested by what calls it, so the tests of the files that import it follow.
    """
    path = root / file
    chosen = [*_beside(root, path), path, *_tests_of_folder(root, path)]
    if "@njit" in path.read_text(encoding="utf-8"):
        for user in _users(root, path):
            chosen += _beside(root, user) or _tests_of_folder(root, user)
    return list(dict.fromkeys(_name(root, each) for each in chosen))


def _name(root: Path, path: Path) -> str:
    return path.relative_to(root).as_posix()


def _files(part: Path) -> list[Path]:
    """Return the files of a part, which is a folder or one file."""
    return sorted([*part.parent.glob(f"{part.name}.py"), *part.rglob("*.py")])


def _folder_of_tests(root: Path, path: Path) -> Path:
    package, *folders = path.relative_to(root).parent.parts
    return root.joinpath("tests", *(["studies"] if package == "bicode_studies" else []), *folders)


def _beside(root: Path, path: Path) -> list[Path]:
    """Return the test file of the same name, if there is one, and those whose names go on after it."""
    folder = _folder_of_tests(root, path)
    return sorted([*folder.glob(f"test_{path.stem}.py"), *folder.glob(f"test_{path.stem}_*.py")])


def _tests_of_folder(root: Path, path: Path) -> list[Path]:
    """Return the tests that are named after the folder; a file at the top of its package has only those of its name."""
    if len(path.relative_to(root).parts) <= 2:
        return []
    folder = _folder_of_tests(root, path)
    return sorted([*folder.parent.glob(f"test_{folder.name}.py"), *folder.glob("test_*.py")])


def _users(root: Path, path: Path) -> Iterator[Path]:
    """Yield the files of the other parts that import a file."""
    module = ".".join(path.relative_to(root).with_suffix("").parts)
    for part in PARTS.values():
        for other in _files(root / part):
            if other.parent != path.parent and module in _imports(other):
                yield other


def _imports(path: Path) -> set[str]:
    nodes = ast.walk(ast.parse(path.read_bytes()))
    return {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
