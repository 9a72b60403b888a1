"""No file that git keeps holds the address of a package index or a path of one machine, and data stay small."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MOST_BYTES_OF_DATA = 5_000_000
MOST_BYTES_OF_FIGURE = 400_000

# Written in pieces, so that this file does not hold what it looks for.
INDEX = [
    r"pypi\.(org|python)",
    "files" + r"\.pythonhosted",
    r"https?://\S+/simp" + r"le(/|\b)",
    r"(?<!emit-)index-u" + "rl[ =]",
]
MACHINE = [r"(?<![\w.~-])/(work|root|Users)" + r"/\w", r"(?<![\w.~-])/ho" + r"me/\w", r"\b[A-Z]:\\Us" + "ers"]


def tracked_files():
    """Return the files that git keeps; none if this is not a clone."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    return [ROOT / name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]


TRACKED = tracked_files()


def texts():
    """Yield path and text of each file that is text."""
    for path in TRACKED:
        try:
            yield path.relative_to(ROOT), path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue


@pytest.mark.parametrize("patterns", [INDEX, MACHINE], ids=["address of a package index", "path of one machine"])
def test_no_file_holds(patterns):
    found = [
        f"{path}:{text[: match.start()].count(chr(10)) + 1}: {match.group()}"
        for path, text in texts()
        for pattern in patterns
        for match in re.finditer(pattern, text)
    ]
    assert not found, found


def test_there_is_no_lock_file_and_no_environment():
    names = {path.relative_to(ROOT).parts[0] for path in TRACKED}
    assert not names & {"uv.lock", ".venv", "build", "dist", "node_modules"}


def test_quick_figures_and_checkpoints_are_not_kept():
    paths = [str(path.relative_to(ROOT)) for path in TRACKED]
    assert not [path for path in paths if path.startswith("figures/quick/") or ".ipynb_checkpoints" in path]


def test_data_and_figures_are_small():
    assert sum(path.stat().st_size for path in TRACKED if path.is_relative_to(ROOT / "data")) <= MOST_BYTES_OF_DATA
    for path in TRACKED:
        if path.is_relative_to(ROOT / "figures"):
            assert path.stat().st_size <= MOST_BYTES_OF_FIGURE, path.name


def test_every_figure_comes_with_its_data_and_parameters():
    for picture in (ROOT / "figures").glob("fig_*.png"):
        for ending in (".csv", ".json"):
            assert picture.with_suffix(ending).is_file(), picture.name


def test_each_package_is_pinned_once_with_hashes():
    text = (ROOT / "environment" / "requirements.txt").read_text(encoding="utf-8")
    names = re.findall(r"(?m)^([\w.-]+)==", text)
    assert len(names) == len(set(names)), "two versions of one package"
    blocks = re.split(r"(?m)^(?=[\w.-]+==)", text)[1:]
    assert all("--hash=sha256:" in block for block in blocks)


def test_everything_the_package_needs_is_pinned():
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"].values()
    needed = [*project["dependencies"], *(line for extra in extras for line in extra)]
    pinned = (ROOT / "environment" / "requirements.txt").read_text(encoding="utf-8")
    for line in needed:
        name = re.match(r"[\w.-]+", line).group()
        assert f"\n{name}==" in pinned, f"{name}: make pins"
