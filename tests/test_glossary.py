"""One word, one meaning, and each name that a word is bound to is there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ROWS = [
    [cell.strip() for cell in line.strip().strip("|").split(" | ")]
    for line in (ROOT / "GLOSSARY.md").read_text(encoding="utf-8").splitlines()
    if line.startswith("| **")
]
CODE = "\n".join(
    path.read_text(encoding="utf-8")
    for path in sorted([*(ROOT / "bicode_lab").rglob("*.py"), *(ROOT / "bicode_studies").rglob("*.py")])
)
IDENTIFIERS = set(re.findall(r"[A-Za-z_]\w*", CODE))
OF_THE_HOUSE = {
    "event", "polarity", "frame", "packet", "bit", "chip", "start", "payload", "checksum", "ID", "period", "region",
    "track", "recording", "trial", "accuracy",
}  # fmt: skip


def words_of(row: list[str]) -> list[str]:
    return [word.strip() for word in re.sub(r"\*\*", "", row[0]).split(",")]


def test_each_word_has_one_meaning() -> None:
    words = [word for row in ROWS for word in words_of(row)]
    assert len(words) > 80
    assert len(words) == len(set(words)), sorted({word for word in words if words.count(word) > 1})
    assert set(words) >= OF_THE_HOUSE


@pytest.mark.parametrize("row", ROWS, ids=lambda row: words_of(row)[0])
def test_each_word_has_a_meaning_and_is_bound_to_names_that_exist(row: list[str]) -> None:
    assert len(row) >= 3, "word | meaning | in the code | in the paper"
    assert row[1]
    named = re.findall(r"`([^`]+)`", row[2])
    assert named, "bind it to a name"
    for text in named:
        for name in re.findall(r"[A-Za-z_]\w*", re.sub(r"\.(json|csv|npz)\b|\bdata/|\bOUT\b|\btruth\b", "", text)):
            assert name in IDENTIFIERS, f"{name}: nothing in bicode_lab is called so"
