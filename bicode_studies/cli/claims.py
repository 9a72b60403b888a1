"""``bicode claims``: the paper's claims and the figures' tables in; a verdict for each claim out."""

from __future__ import annotations

import math
from pathlib import Path

import click
import pandas as pd

from bicode_studies.claims.verdicts import VERDICTS, count_verdicts, judge_claims
from bicode_studies.repository import repository_root

TABLES = {
    "08": "fig_08_current.csv",
    "09": "fig_09_angle.csv",
    "10": "fig_10_size.csv",
    "11": "fig_11_light.csv",
    "12": "fig_12_camera_motion.csv",
    "13": "fig_13_frames.csv",
    "14": "fig_14_marker_rotation.csv",
}
"""The figures' trials, by figure; notebooks 08 to 14 write them beside their pictures."""

MOST_LETTERS = 50  # in a column of the terminal's table; JSON and markdown have all
BEGIN, END = "<!-- claims: made by bicode claims --write-readme -->", "<!-- end of claims -->"


@click.command()
@click.option(
    "--format", "form", type=click.Choice(["table", "json", "markdown"]), default="table", show_default=True
)  # fmt: skip
@click.option("--quick", is_flag=True, help="From the quick figures (figures/quick/), which are too short to judge by.")
@click.option("--write-readme", is_flag=True, help="Put the table into README.md, too.")
def claims(form: str, quick: bool, write_readme: bool) -> int:
    """Compare every claim of the paper with the figures' trials.

    Reads data/paper_claims.csv and the tables that notebooks 08 to 14 wrote to figures/. Ends with 1 where some of
    those are missing, with what makes them.
    """
    if quick and write_readme:
        raise click.UsageError("--write-readme takes the trials at the paper's scale; leave --quick out")
    root = repository_root()
    folder = root / "figures" / "quick" if quick else root / "figures"
    judged = judge_claims(read_claims(root), read_tables(folder))
    click.echo({"table": as_text, "json": as_json, "markdown": as_markdown}[form](judged))
    if write_readme:
        readme = root / "README.md"
        text = readme.read_text(encoding="utf-8")
        readme.write_text(with_claims(text, as_markdown(judged)), encoding="utf-8")
    missing = missing_line(folder, quick)
    if missing:
        click.echo(f"bicode: {missing}", err=True)
    return 1 if missing else 0


def read_claims(root: Path) -> pd.DataFrame:
    """The repository in, the paper's claims out, all as text."""
    return pd.read_csv(root / "data" / "paper_claims.csv", dtype=str, keep_default_na=False)


def read_tables(folder: Path) -> dict[str, pd.DataFrame]:
    """A folder of figures in, the trials that are there out, by figure."""
    return {figure: pd.read_csv(folder / name) for figure, name in TABLES.items() if (folder / name).is_file()}


def missing_line(folder: Path, quick: bool) -> str:
    """A folder of figures in; a line that says which tables are missing and what makes them out, or nothing."""
    missing = [figure for figure, name in TABLES.items() if not (folder / name).is_file()]
    if not missing:
        return ""
    names = ", ".join(TABLES[figure] for figure in missing)
    made = "; ".join(f"bicode figures{'' if quick else ' --full'} --only {figure}" for figure in missing)
    return f"{names} not in {folder.name}/: claims of these figures have no trials yet; make them with: {made}"


def as_text(judged: pd.DataFrame) -> str:
    """Rows of `judge_claims` in, a table for the terminal out, with the counts below it."""
    shown = pd.DataFrame(
        {
            "id": judged["id"],
            "claim": judged["claim"].map(_short),
            "tested": judged["tested"].map(_short),
            "ours": judged["ours"],
            "95 %": [interval_of(row) for row in judged.to_dict("records")],
            "verdict": judged["verdict"],
            "note": judged["note"].map(_short),
        }
    )
    return f"{shown.to_string(index=False)}\n\n{count_verdicts(judged).to_string()}"


def _short(text: str) -> str:
    """Text in, no more than `MOST_LETTERS` of it out."""
    return text if len(text) <= MOST_LETTERS else text[: MOST_LETTERS - 3] + "..."


def as_json(judged: pd.DataFrame) -> str:
    """Rows of `judge_claims` in, JSON out: a list of objects; null where a number does not apply."""
    finite = judged.replace([math.inf, -math.inf], math.nan)
    return str(finite.to_json(orient="records", indent=1, force_ascii=False))


def as_markdown(judged: pd.DataFrame) -> str:
    """Rows of `judge_claims` in, a table for the README out, numbers and orders first, the rest in one below it."""
    measured = judged["kind"].isin(["number", "order"])
    head = "| claim | the paper | tested | ours | 95 % | verdict |\n|---|---|---|---|---|---|"
    parts = [_counts_line(judged), head, *_lines(judged[measured])]
    parts += ["", "Facts, rules and parameters:", "", head, *_lines(judged[~measured])]
    return "\n".join(parts)


def _counts_line(judged: pd.DataFrame) -> str:
    """How many claims have each verdict, in words."""
    measured = judged[judged["kind"].isin(["number", "order"])]
    counts = measured["verdict"].value_counts()
    told = ", ".join(f"{counts[each]} {each}" for each in VERDICTS if each in counts)
    return f"Of {len(measured)} numbers and orders: {told}.\n"


def _lines(judged: pd.DataFrame) -> list[str]:
    """Rows of `judge_claims` in, lines of a markdown table out."""
    rows = []
    for row in judged.to_dict("records"):
        found = row["verdict"] + (f" ({row['note']})" if row["note"] else "")
        cells = (row["id"], row["claim"], row["tested"], row["ours"], interval_of(row), found)
        rows.append("| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |")
    return rows


def interval_of(row: dict[object, object]) -> str:
    """A row of `judge_claims` in, its interval in words out; empty where it has none."""
    low, high = (float(str(row[end])) for end in ("low", "high"))
    return "" if math.isnan(low) else f"{low:.3g} .. {high:.3g}"


def with_claims(readme: str, table: str) -> str:
    """The README's text and the table in, the text with the table between its two marks out.

    Raises
    ------
    ValueError
        A text without the marks.
    """
    if readme.count(BEGIN) != 1 or readme.count(END) != 1:
        raise ValueError(f"README.md does not hold {BEGIN!r} and {END!r} once each; put them where the table goes")
    before, rest = readme.split(BEGIN)
    _, after = rest.split(END)
    return f"{before}{BEGIN}\n{table}\n{END}{after}"
