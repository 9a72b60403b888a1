"""Who may import whom, and how large a file and a folder may be: the rules of the layout, read from the code itself."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bicode_lab", "bicode_studies")
FIRMWARE = ROOT / "bicode_lab" / "fabrication" / "bicode_tx.py"  # data: it runs on the microcontroller
FILES = sorted(path for name in PACKAGES for path in (ROOT / name).rglob("*.py") if path != FIRMWARE)

MODULE = {"events", "boxes", "paper", "constants", "kernels"}
LAB = {"marker", "camera", "recognition", "soft_receiver", "sequential", "pose", "lights", "recordings", "fabrication"}
BASE = {"repository", "statistics"}
# What each part (a folder or a file of a package) may import of the two packages, beside itself.
KNOWS: dict[str, dict[str, set[str]]] = {
    "bicode_lab": {
        "": LAB | MODULE,  # the package's __init__ names them
        "events": set(),
        "boxes": set(),
        "paper": set(),
        "constants": set(),
        "kernels": set(),
        "marker": MODULE,
        "camera": MODULE | {"marker"},
        "recognition": MODULE | {"marker"},
        "soft_receiver": MODULE | {"marker", "recognition"},
        "sequential": MODULE | {"marker", "recognition", "soft_receiver"},
        "pose": MODULE | {"marker", "recognition"},
        "lights": MODULE | {"marker", "recognition", "soft_receiver"},
        "recordings": {"events", "paper", "kernels"},
        "fabrication": {"paper", "marker"},
    },
    "bicode_studies": {
        "": set(),
        "repository": set(),
        "statistics": set(),
        "sweep": {"repository"},
        "notebook": {"repository"},
        "plots": set(),
        "score": {"statistics"},
        "trial": {"statistics", "score"},
        "paper_experiments": BASE | {"score", "trial", "sweep", "plots"},
        "link_budget": BASE | {"score", "trial", "plots", "paper_experiments"},
        "calibration": BASE | {"score", "trial", "sweep", "plots", "paper_experiments", "real_light"},
        "pose_accuracy": BASE,
        "light_kinds": BASE | {"sweep"},
        "robustness": BASE | {"score", "trial", "sweep", "plots", "paper_experiments"},
        "claims": BASE | {"sweep", "paper_experiments", "link_budget"},
        "predictions": {"sweep", "trial", "paper_experiments", "calibration", "claims"},
        "what_if": BASE | {"score", "trial", "plots", "link_budget", "notebook"},  # its page is a notebook
        "bench": BASE | {"sweep", "paper_experiments", "plots", "notebook"},  # it times whole runs
        "inspect": BASE,
        "own_recording": BASE | {"plots", "notebook"},
        "real_light": BASE | {"plots"},
    },
}
STUDIES = set(KNOWS["bicode_studies"]) - {""}
KNOWS["bicode_studies"]["cli"] = STUDIES

ONLY_FRONT = {"IPython", "ipywidgets", "papermill", "click", "nbformat", "nbclient", "jupyter_client"}
FRONT = ("bicode_studies/cli/", "bicode_studies/notebook/", "bicode_studies/what_if/page")
NOT_IN_THE_MODULE = {"matplotlib", "joblib", "loky", "tqdm", "papermill"}  # bicode_lab draws nothing and asks nobody

MOST_FILES_OF_FOLDER = 16
MOST_LINES_OF_FILE = 320
MOST_LINES_OF_FUNCTION = 55  # without its docstring

each_file = pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))


def name_of(path: Path) -> str:
    """Return the dotted name of a module."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


NAMES = {name_of(path): path for path in FILES}


def part_of(module: str) -> str:
    """Return the folder or file of its package that a module belongs to; empty for the package's __init__."""
    return module.split(".")[1] if "." in module else ""


def imports_in(path: Path) -> Iterator[tuple[str, str | None]]:
    """Yield (full module, imported name or None) of every import in a file, also those inside functions."""
    parts = path.relative_to(ROOT).parent.parts
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = list(parts[: len(parts) - node.level + 1]) if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            yield from ((module, alias.name) for alias in node.names)


@cache
def inner_imports(path: Path) -> list[tuple[str, str | None]]:
    """List (module of ours, name) that a file imports; a module imported by name from its folder is that module."""
    found: list[tuple[str, str | None]] = []
    for module, name in imports_in(path):
        if module.split(".")[0] in PACKAGES:
            inner = f"{module}.{name}"
            found.append((inner, None) if inner in NAMES else (module, name))
    return found


def docstring_lines(node: ast.AST) -> int:
    """Count the lines of the docstring of a function."""
    first = node.body[0] if getattr(node, "body", None) else None
    if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant) and isinstance(first.value.value, str):
        return (first.end_lineno or 0) - first.lineno + 1
    return 0


@each_file
def test_a_part_imports_only_the_parts_below_it(path: Path) -> None:
    module = name_of(path)
    package, part = module.split(".")[0], part_of(module)
    assert part in KNOWS[package], f"say in KNOWS what {package}/{part} may import"
    for other, name in inner_imports(path):
        target, known = other.split(".")[0], part_of(other)
        if package == "bicode_lab":
            assert target == "bicode_lab", f"the module must not import the studies ({other})"
        if target == package:
            allowed = KNOWS[package][part] | {part}
            assert known in allowed, f"{package}/{part} must not import {other} ({name})"


def test_receivers_do_not_import_the_camera() -> None:
    """A receiver must not see the truth, not even through another module."""
    blind = ("recognition", "soft_receiver", "lights", "pose", "recordings")
    for start in (name for name in NAMES if part_of(name) in blind):
        seen, waiting = set(), [start]
        while waiting:
            here = waiting.pop()
            if here in seen or here not in NAMES:
                continue
            seen.add(here)
            waiting += [module for module, _ in inner_imports(NAMES[here]) if module != "bicode_lab"]
        assert not [name for name in seen if name.startswith("bicode_lab.camera")], start


def test_no_circle_between_files() -> None:
    """Imports for types only count, too; a package's __init__ that names its own files is no circle by itself."""
    edges: dict[str, set[str]] = {name: set() for name in NAMES}
    for name, path in NAMES.items():
        for module, _ in inner_imports(path):
            if module in NAMES and module != name:
                edges[name].add(module)
    done: set[str] = set()

    def visit(name: str, trail: tuple[str, ...]) -> None:
        assert name not in trail, " -> ".join([*trail[trail.index(name) :], name])
        if name not in done:
            for other in sorted(edges[name]):
                visit(other, (*trail, name))
            done.add(name)

    for name in NAMES:
        visit(name, ())


@each_file
def test_plots_of_a_study_import_only_types(path: Path) -> None:
    """A picture computes nothing: it imports the types of what it draws, and constants."""
    if part_of(name_of(path)) == "plots" or path.name.startswith("plots"):
        for module, name in inner_imports(path):
            if module.startswith("bicode_studies.plots") or part_of(module) in (
                "paper",
                "events",
                "constants",
                "marker",
            ):
                continue
            assert name, f"{path.name} imports all of {module}; import the types it draws by name"
            assert name[0].isupper(), f"{path.name} must not compute with {module}.{name}"


@each_file
def test_only_the_front_knows_notebooks_and_the_command_line(path: Path) -> None:
    if not str(path.relative_to(ROOT)).startswith(FRONT):
        used = ONLY_FRONT & {module.split(".")[0] for module, _ in imports_in(path)}
        assert not used, f"only cli/, notebook/ and what_if/page import {used}"


@each_file
def test_the_module_draws_nothing_and_runs_nothing_in_parallel(path: Path) -> None:
    if path.is_relative_to(ROOT / "bicode_lab"):
        used = NOT_IN_THE_MODULE & {module.split(".")[0] for module, _ in imports_in(path)}
        assert not used, f"bicode_lab does without {used}"


@each_file
def test_no_private_name_crosses_a_folder(path: Path) -> None:
    """Neither imported, nor overridden by a class of another folder."""
    for module, name in inner_imports(path):
        home = NAMES[module].parent if module in NAMES else None
        private = [
            word for word in (*module.split("."), name or "") if word.startswith("_") and not word.endswith("__")
        ]
        assert not private or home == path.parent, f"{module}.{name} is private to its folder"
    tree = ast.parse(path.read_text(encoding="utf-8"))
    foreign = {name for module, name in inner_imports(path) if module in NAMES and NAMES[module].parent != path.parent}
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and foreign & {base.id for base in node.bases if isinstance(base, ast.Name)}:
            own = [each.name for each in node.body if isinstance(each, ast.FunctionDef)]
            hidden = [name for name in own if name.startswith("_") and not name.endswith("__")]
            assert not hidden, f"{node.name} overrides or adds {hidden} to a class of another folder"


@each_file
def test_files_and_functions_are_short(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= MOST_LINES_OF_FILE
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            lines = (node.end_lineno or 0) - node.lineno + 1 - docstring_lines(node)
            assert lines <= MOST_LINES_OF_FUNCTION, f"{node.name} has {lines} lines without its docstring"


@pytest.mark.parametrize(
    "folder", sorted({path.parent for path in FILES}), ids=lambda path: str(path.relative_to(ROOT))
)
def test_a_folder_holds_few_files(folder: Path) -> None:
    assert len(list(folder.glob("*.py"))) <= MOST_FILES_OF_FOLDER


@pytest.mark.parametrize(
    "folder", sorted({path.parent for path in FILES if path.name == "__init__.py"}), ids=lambda path: path.name
)
def test_a_folder_says_what_it_holds(folder: Path) -> None:
    text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))) or ""
    assert len(text.split()) >= 4, f"{folder.name}/__init__.py says nothing of what is in the folder"
    assert not {"to be written", "to be filled"} & {text.lower().strip(" .")}


def test_the_tests_mirror_the_folders() -> None:
    """Each folder of tests is named as the folder that it tests."""
    tests = ROOT / "tests"
    for path in sorted(tests.rglob("test_*.py")):
        folders = path.relative_to(tests).parts[:-1]
        if not folders or folders == ("browser",):
            continue
        home = (
            ROOT / "bicode_studies" / Path(*folders[1:])
            if folders[0] == "studies"
            else ROOT / "bicode_lab" / folders[0]
        )
        assert home.is_dir(), f"{path.relative_to(ROOT)} tests no folder of the packages"


def test_marker_camera_and_recognition_can_be_imported_without_the_rest(tmp_path: Path) -> None:
    """A copy that holds nothing else imports, module by module."""
    core = tmp_path / "bicode_lab"
    core.mkdir()
    (core / "__init__.py").touch()
    for path in (ROOT / "bicode_lab").glob("*"):
        if path.is_file() and path.name != "__init__.py":
            shutil.copy(path, core)
    for part in ("marker", "camera", "recognition"):
        shutil.copytree(ROOT / "bicode_lab" / part, core / part, ignore=shutil.ignore_patterns("__pycache__"))
    names = [".".join(path.relative_to(tmp_path).with_suffix("").parts) for path in sorted(core.rglob("*.py"))]
    modules = [name.removesuffix(".__init__") for name in names]
    # -P, and the copy first: an installed package must not stand in for a missing file.
    script = f"""import importlib, sys
sys.path.insert(0, {str(tmp_path)!r})
for name in {modules!r}: importlib.import_module(name)
print(sys.modules["bicode_lab"].__file__)"""
    done = subprocess.run([sys.executable, "-P", "-c", script], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(core / "__init__.py")


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("import bicode_lab.camera.pixels", [("bicode_lab.camera.pixels", None)]),
        ("from bicode_lab.camera.pixels import PixelModel", [("bicode_lab.camera.pixels", "PixelModel")]),
        ("from bicode_lab import camera", [("bicode_lab.camera", None)]),
        ("from bicode_lab import Scene", [("bicode_lab", "Scene")]),
        ("from ..camera import pixels", [("bicode_lab.camera.pixels", None)]),
        ("from . import track", [("bicode_lab.recognition.track", None)]),
        ("def f():\n    from bicode_lab.camera import pixels", [("bicode_lab.camera.pixels", None)]),
        ("if TYPE_CHECKING:\n    from bicode_lab.camera import pixels", [("bicode_lab.camera.pixels", None)]),
        ("import numpy", []),
    ],
)
def test_the_check_itself_sees_every_kind_of_import(
    source: str, found: list[tuple[str, str | None]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    path = tmp_path / "bicode_lab" / "recognition" / "decode.py"
    path.parent.mkdir(parents=True)
    path.write_text(source)
    assert inner_imports(path) == found
