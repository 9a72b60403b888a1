"""Who may know whom: the folders are the communication link, and a receiver must not see the truth."""

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "bicode_lab"
FIRMWARE = {PACKAGE / "marker" / "bicode_tx.py"}  # data: runs on the microcontroller, nothing here imports it
MODULES = sorted(set(PACKAGE.rglob("*.py")) - FIRMWARE)

# part: what it may import of the package. A part is a folder or a file of bicode_lab.
KNOWS = {
    "constants": set(),
    "kernel_cache": set(),
    "events": set(),
    "event_codes": {"events"},
    "paper": set(),
    "recordings": {"events", "paper"},
    "marker": {"events", "paper"},
    "workshop": {"paper", "marker"},
    "camera": {"constants", "events", "paper", "marker"},
    "recognition": {"events", "event_codes", "paper", "marker"},
    "soft": {"events", "paper", "marker", "recognition"},
    "evaluation": {"constants", "events", "paper", "recordings", "marker", "camera", "recognition", "soft"},
    "plots": {"events", "paper", "marker", "camera", "recognition", "evaluation"},
    "lab": {
        "constants",
        "events",
        "event_codes",
        "paper",
        "recordings",
        "marker",
        "workshop",
        "camera",
        "recognition",
        "soft",
        "evaluation",
        "plots",
    },
}
TYPES_ONLY = {"camera", "recognition", "evaluation"}  # of these, plots may know the names of types
ONLY_LAB = {"IPython", "ipywidgets", "papermill", "click", "nbformat", "nbclient", "jupyter_client"}
NOT_IN_THE_CORE = ONLY_LAB | {"matplotlib", "faery", "joblib", "tqdm"}
CORE = ("marker", "camera", "recognition")

MOST_STATEMENTS_OF_CORE = 2350
MOST_LINES_OF_FILE = 320  # all of them
MOST_LINES_OF_FUNCTION = 55  # without its docstring

each_module = pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))


def part_of(path):
    """The folder or file of the package a module belongs to; empty for the package's own __init__."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return "" if parts == ("__init__",) else group_of(parts[0])


def group_of(name):
    """The part a name inside the package counts to: `recording_checks` is of `recordings`."""
    return "recordings" if name.startswith("recording_") else name


def imports_of(path):
    """(full module, name or None) of every import in a file, also those inside functions."""
    package = ["bicode_lab", *path.relative_to(PACKAGE).parent.parts]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            yield from ((module, alias.name) for alias in node.names)


def inner_imports_of(path):
    """(part of the package, name) of what a file imports from the package."""
    for module, name in imports_of(path):
        words = module.split(".")
        if words[0] != "bicode_lab":
            continue
        if len(words) > 1:
            yield group_of(words[1]), name
        elif group_of(name or "") in KNOWS:
            yield group_of(name), None
        else:
            yield "", name


def docstring_lines(node):
    """The line numbers of the docstring of a module, class or function."""
    first = node.body[0] if getattr(node, "body", None) else None
    if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant) and isinstance(first.value.value, str):
        return set(range(first.lineno, first.end_lineno + 1))
    return set()


def statements(path):
    """How many statements a file has, docstrings left out: lines of code, however they are broken."""
    return sum(
        isinstance(node, ast.stmt) and not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    )


@each_module
def test_a_part_only_knows_those_before_it(path):
    part = part_of(path)
    if not part:
        assert "lab" not in {known for known, _ in inner_imports_of(path)}, "the package must not import its own top"
        return
    assert part in KNOWS, f"say in KNOWS what {part} may import"
    allowed = KNOWS[part] | {part}
    for known, name in inner_imports_of(path):
        assert known in allowed, f"{part} must not know {known or 'the package as a whole'} ({name})"


@each_module
def test_plots_know_no_more_than_the_types_of_what_they_draw(path):
    if part_of(path) == "plots":
        for known, name in inner_imports_of(path):
            if known in TYPES_ONLY:
                assert name, f"plots import all of {known}; import the types they draw by name"
                assert name[0].isupper(), f"plots must not compute with {known}.{name}"


@each_module
def test_only_lab_knows_notebooks_and_the_command_line(path):
    if part_of(path) != "lab":
        used = ONLY_LAB & {module.split(".")[0] for module, _ in imports_of(path)}
        assert not used, f"only bicode_studies.cli may import {used}"


@each_module
def test_the_core_does_without_pictures_and_files(path):
    if part_of(path) in (*CORE, "events", "event_codes", "paper"):
        used = NOT_IN_THE_CORE & {module.split(".")[0] for module, _ in imports_of(path)}
        assert not used, f"marker, camera and recognition do without {used}"


@each_module
def test_files_and_functions_are_short(path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= MOST_LINES_OF_FILE
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            lines = node.end_lineno - node.lineno + 1 - len(docstring_lines(node))
            assert lines <= MOST_LINES_OF_FUNCTION, f"{node.name} has {lines} lines without its docstring"


def test_marker_camera_and_recognition_are_small_together():
    counts = {path.name: statements(path) for path in MODULES if part_of(path) in CORE}
    assert sum(counts.values()) <= MOST_STATEMENTS_OF_CORE, counts


def test_marker_camera_and_recognition_can_be_imported_without_the_rest(tmp_path):
    """A copy that holds nothing else imports, module by module."""
    core = tmp_path / "bicode_lab"
    core.mkdir()
    (core / "__init__.py").touch()
    for name in ("events.py", "event_codes.py", "paper.py", "constants.py", "constants.csv"):
        if (PACKAGE / name).exists():
            shutil.copy(PACKAGE / name, core)
    for part in CORE:
        leave = shutil.ignore_patterns("__pycache__", *(path.name for path in FIRMWARE))
        shutil.copytree(PACKAGE / part, core / part, ignore=leave)
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
        ("import bicode_lab.camera.pixels", [("camera", None)]),
        ("from bicode_lab.camera.pixels import record", [("camera", "record")]),
        ("from bicode_lab import camera", [("camera", None)]),
        ("from bicode_lab import no_events", [("", "no_events")]),
        ("from ..camera import sensor", [("camera", "sensor")]),
        ("from .. import camera", [("camera", None)]),
        ("from . import track", [("recognition", "track")]),
        ("def f():\n    from bicode_lab.camera import sensor", [("camera", "sensor")]),
        ("import numpy", []),
    ],
)
def test_the_check_itself_sees_every_kind_of_import(source, found, tmp_path, monkeypatch):
    monkeypatch.setattr(f"{__name__}.PACKAGE", tmp_path / "bicode_lab")
    path = tmp_path / "bicode_lab" / "recognition" / "decode.py"
    path.parent.mkdir(parents=True)
    path.write_text(source)
    assert list(inner_imports_of(path)) == found
