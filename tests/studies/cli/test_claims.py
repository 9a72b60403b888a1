"""``bicode claims`` and the table in the README."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bicode_studies.claims.verdicts import CAUSES, judge_claims
from bicode_studies.cli import claims as module
from bicode_studies.cli.claims import (
    as_json,
    as_markdown,
    as_text,
    missing_line,
    read_claims,
    read_tables,
    with_claims,
)
from bicode_studies.cli.main import main
from tests.studies.claims.paper_world import paper_world

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def repository(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A repository with the claims, the README's marks, and trials of a world as the paper says."""
    root = tmp_path_factory.mktemp("repository")
    for name in ("notebooks", "bicode_lab", "data", "figures"):
        (root / name).mkdir()
    (root / "data" / "paper_claims.csv").write_bytes((ROOT / "data" / "paper_claims.csv").read_bytes())
    (root / "README.md").write_text(f"Before\n{module.BEGIN}\nold\n{module.END}\nafter\n")
    for figure, table in paper_world().items():
        table.to_csv(root / "figures" / module.TABLES[figure], index=False, float_format="%.6g")
    return root


@pytest.fixture
def claims(repository: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """A function: words typed after ``bicode claims`` in; (exit code, stdout, stderr) out."""
    monkeypatch.chdir(repository)

    def run(*words: str) -> tuple[object, str, str]:
        with pytest.raises(SystemExit) as ended:
            main(["claims", *words])
        said = capsys.readouterr()
        return ended.value.code, said.out, said.err

    return run


def test_it_covers_every_claim_in_every_form(claims) -> None:
    names = read_claims(ROOT)["id"].tolist()
    code, out, err = claims("--format", "json")
    assert (code, err) == (0, "")
    assert [row["id"] for row in json.loads(out)] == names
    _, table, _ = claims()
    assert all(f" {name} " in f" {' '.join(table.split())} " for name in names)
    _, markdown, _ = claims("--format", "markdown")
    assert sorted(line.split(" ")[1] for line in markdown.splitlines() if line.startswith("| ")) == sorted(
        [*names, "claim", "claim"]
    )


def test_it_says_which_trials_are_missing_and_what_makes_them(
    claims, repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, out, err = claims("--quick")
    assert code == 1
    assert "no trials yet" in out
    assert err.count("\n") == 1
    assert "fig_08_current.csv" in err
    assert "bicode figures --only 08" in err
    assert "--full --only 14" in missing_line(repository / "data", quick=False)
    assert missing_line(repository / "figures", quick=False) == ""


def test_it_writes_the_table_between_the_marks_and_nothing_else(claims, repository: Path) -> None:
    readme = repository / "README.md"
    assert claims("--write-readme")[0] == 0
    text = readme.read_text()
    assert text.startswith(f"Before\n{module.BEGIN}\nOf 39 numbers and orders: ")
    assert text.endswith(f"\n{module.END}\nafter\n")
    assert "old" not in text.split("after")[0].split("\n")
    assert claims("--write-readme")[0] == 0
    assert readme.read_text() == text
    code, _, err = claims("--write-readme", "--quick")
    assert code == 2
    assert "leave --quick out" in err


def test_a_readme_without_marks_is_refused() -> None:
    for text in ("", module.BEGIN, f"{module.BEGIN}{module.END}{module.BEGIN}"):
        with pytest.raises(ValueError, match="once each"):
            with_claims(text, "table")


def test_the_same_trials_give_the_same_table() -> None:
    """Rows in any order, numbers as a figure's file keeps them: six digits."""
    claims = read_claims(ROOT)
    world = paper_world()
    shuffled = {figure: table.sample(frac=1, random_state=3) for figure, table in world.items()}
    once, again = judge_claims(claims, world), judge_claims(claims, shuffled)
    assert once["verdict"].tolist() == again["verdict"].tolist()
    for column in ("value", "low", "high"):
        assert np.allclose(once[column].astype(float), again[column].astype(float), equal_nan=True)
    for form in (as_text, as_json, as_markdown):
        assert form(once) == form(judge_claims(claims, world))


def test_the_readme_holds_the_table_of_the_committed_trials() -> None:
    line = missing_line(ROOT / "figures", quick=False)
    if line:
        pytest.skip(line)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    table = as_markdown(judge_claims(read_claims(ROOT), read_tables(ROOT / "figures")))
    assert readme == with_claims(readme, table), "README.md is out of date: bicode claims --write-readme"


def test_each_claim_that_does_not_come_out_has_a_cause_and_no_other() -> None:
    line = missing_line(ROOT / "figures", quick=False)
    if line:
        pytest.skip(line)
    judged = judge_claims(read_claims(ROOT), read_tables(ROOT / "figures"))
    open_ones = set(judged.loc[judged["verdict"].isin(["contradicted", "undecided"]), "id"])
    assert open_ones == set(CAUSES)
    for name, cause in CAUSES.items():
        numbers = re.findall(r"notebook (\d\d)", cause)
        assert numbers, f"{name}: name the notebook whose experiment shows it"
        assert all(list((ROOT / "notebooks").glob(f"{number}_*.ipynb")) for number in numbers)


def test_a_claim_that_was_not_tested_stays_in_the_table() -> None:
    judged = judge_claims(read_claims(ROOT), {})
    assert isinstance(judged, pd.DataFrame)
    assert as_markdown(judged).count("| no trials yet") == (judged["verdict"] == "no trials yet").sum() > 39
