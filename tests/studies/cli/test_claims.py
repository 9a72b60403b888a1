"""``bicode claims`` and the table in docs/claims.md."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bicode_studies.claims.beside_null import judge_beside_null, summary_line
from bicode_studies.claims.table import (
    as_json,
    as_markdown,
    as_page,
    as_text,
    missing_line,
    read_claims,
    read_trials,
)
from bicode_studies.cli.main import main
from tests.studies.claims.paper_world import paper_world

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def repository(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a repository with the claims, and with trials of a world as the paper says."""
    root = tmp_path_factory.mktemp("repository")
    for name in ("notebooks", "bicode_lab", "data", "figures", "results"):
        (root / name).mkdir()
    (root / "README.md").write_text("# Title\n\nNot yet counted.\n\nThe rest.\n")
    (root / "data" / "paper_claims.csv").write_bytes((ROOT / "data" / "paper_claims.csv").read_bytes())
    for figure, table in paper_world().items():
        table.to_csv(root / "results" / f"{figure}.csv", index=False, float_format="%.6g")
    return root


@pytest.fixture
def claims(repository: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """Return a function that runs ``bicode claims`` with some words and returns exit code, stdout and stderr."""
    monkeypatch.chdir(repository)

    def run(*words: str) -> tuple[object, str, str]:
        with pytest.raises(SystemExit) as ended:
            main(["claims", *words])
        said = capsys.readouterr()
        return ended.value.code, said.out, said.err

    return run


def test_it_covers_every_claim_in_every_form(claims) -> None:
    names = read_claims()["id"].tolist()
    code, out, err = claims("--format", "json")
    assert (code, err) == (0, "")
    assert [row["id"] for row in json.loads(out)] == names
    _, table, _ = claims()
    assert all(f" {name} " in f" {' '.join(table.split())} " for name in names)
    _, markdown, _ = claims("--format", "markdown")
    rows = [line.split(" ")[1] for line in markdown.splitlines() if line.startswith("| ")]
    assert [row for row in rows if row in set(names)] == sorted(names, key=rows.index)


def test_it_says_which_trials_are_missing_and_what_makes_them(claims) -> None:
    code, out, err = claims("--quick")
    assert code == 1
    assert "no trials yet" in out
    assert err.count("\n") == 1
    assert all(f"results/quick/{figure}.csv" in err for figure in ("08", "09", "10", "11", "12", "13", "14"))
    assert "bicode figures --only 08" in err
    assert "--full --only 14" in missing_line(set(), quick=False)
    assert missing_line(set(read_trials(quick=False)), quick=False) == ""


def test_it_writes_the_page_and_the_same_page_again(claims, repository: Path) -> None:
    page = repository / "docs" / "claims.md"
    assert claims("--write")[0] == 0
    text = page.read_text()
    assert re.search(r"\| tests the model \| ours \|( \d+ \|)+ 14 \|", text)
    assert re.search(r"\| tests the model \| null model \|( \d+ \|)+ 14 \|", text)
    assert "| P01 |" in text
    readme = (repository / "README.md").read_text().split("\n")
    assert readme[2] in text
    assert readme[2].startswith("Of the 14 statements of the paper that test the simulation, it reproduces ")
    assert [*readme[:2], *readme[3:]] == ["# Title", "", "", "The rest.", ""]
    assert claims("--write")[0] == 0
    assert page.read_text() == text
    code, _, err = claims("--write", "--quick")
    assert code == 2
    assert "leave out --quick" in err


def test_the_same_trials_give_the_same_table() -> None:
    """Shuffle the rows of the trials; the verdicts stay the same."""
    claims = read_claims()
    world = paper_world()
    shuffled = {figure: table.sample(frac=1, random_state=3) for figure, table in world.items()}
    once, again = judge_beside_null(claims, world), judge_beside_null(claims, shuffled)
    assert once["verdict"].tolist() == again["verdict"].tolist()
    for column in ("value_a", "low_a", "high_a", "value_b", "low_b", "high_b"):
        assert np.allclose(once[column].astype(float), again[column].astype(float), equal_nan=True)
    for form in (as_text, as_json, as_markdown):
        assert form(once) == form(judge_beside_null(claims, world))


@pytest.fixture(scope="module")
def judged() -> pd.DataFrame:
    """Return every claim, judged by the committed trials."""
    tables = read_trials(quick=False)
    line = missing_line(set(tables), quick=False)
    if line:
        pytest.skip(line)
    return judge_beside_null(read_claims(), tables)


def test_the_page_holds_the_table_of_the_committed_trials(judged: pd.DataFrame) -> None:
    page = (ROOT / "docs" / "claims.md").read_text(encoding="utf-8")
    assert page == as_page(judged), "docs/claims.md is out of date: bicode claims --write"
    third = (ROOT / "README.md").read_text(encoding="utf-8").split("\n")[2]
    assert third == summary_line(judged), "README.md is out of date: bicode claims --write"


def test_each_claim_that_is_contradicted_has_a_cause(judged: pd.DataFrame) -> None:
    """An undecided one needs more trials first; claims that hold for another reason than the paper's have one, too."""
    contradicted = set(judged.loc[judged["verdict"] == "contradicted", "id"])
    causes = read_claims().set_index("id")["cause"]
    causes = causes[causes != ""]
    assert contradicted <= set(causes.index)
    for name, cause in causes.items():
        numbers = re.findall(r"notebook (\d\d)", cause)
        assert numbers, f"{name}: name the notebook whose experiment shows it"
        assert all(list((ROOT / "notebooks").glob(f"{number}_*.ipynb")) for number in numbers)


def test_a_claim_that_was_not_tested_stays_in_the_table() -> None:
    judged = judge_beside_null(read_claims(), {})
    assert isinstance(judged, pd.DataFrame)
    assert as_markdown(judged).count("| no trials yet (") == (judged["verdict"] == "no trials yet").sum() > 39
