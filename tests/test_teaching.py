"""The minutes of the course plan add up, and its links lead to files and headings that exist."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PLAN = (ROOT / "docs" / "teaching.md").read_text(encoding="utf-8")


def minutes(heading: str) -> int:
    (section,) = [part for part in PLAN.split("\n## ") if part.startswith(heading)]
    return sum(int(number) for number in re.findall(r"(?m)^\| (\d+) \|", section))


def test_the_minutes_add_up() -> None:
    assert minutes("90 minutes") == 90
    assert minutes("A day") == 8 * 60


def test_every_link_and_file_is_there() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", PLAN):
        assert (ROOT / "docs" / target).is_file(), target
    for named in re.findall(r"`((?:data|docs|notebooks)/[^`*]+)`", PLAN):
        assert (ROOT / named).exists(), named


def test_the_headings_it_stops_at_are_in_the_notebooks() -> None:
    for number, heading in re.findall(r'\[(\d\d)\]\([^)]+\), to "([^"]+)"', PLAN):
        (notebook,) = (ROOT / "notebooks").glob(f"{number}_*.ipynb")
        assert f"## {heading.rstrip('?')}" in notebook.read_text(encoding="utf-8"), heading


def test_it_is_one_page() -> None:
    assert len(PLAN.split()) < 900
