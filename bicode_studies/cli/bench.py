"""``bicode bench``: how fast this is on this machine, beside what it should reach."""

from __future__ import annotations

import dataclasses
import json
import os
from datetime import UTC, datetime

import click
from tqdm import tqdm

from bicode_studies.bench.files import file_rows
from bicode_studies.bench.rows import GROUPS, Row
from bicode_studies.bench.timing import Watch, machine, opencv_threads
from bicode_studies.bench.whole_runs import evaluation_row, notebook_row, worker_row
from bicode_studies.repository import results_folder

LONG = {"workers": worker_row, "notebooks": notebook_row, "evaluation": evaluation_row}
IDLE = 0.1  # share of the machine that other programs may use while its figures are still quoted

SHORT = GROUPS | {"files": file_rows}
"""The groups of rows that are measured without --long."""


@click.command()
@click.option("--save", is_flag=True, help="Save the table in results/bench/, named after day and processor.")
@click.option("--long", is_flag=True, help="Also time workers, notebooks and the whole evaluation: half an hour.")
@click.option("--only", type=click.Choice([*SHORT, *LONG]), multiple=True, help="Measure only these rows.")
def bench(save: bool, long: bool, only: tuple[str, ...]) -> None:
    """Measure the speed of receiver and simulated camera, the start time and the memory, each on one core.

    Values are processor times, the shortest of several repeats; the elapsed time stands beside them. On an idle machine
    both are the same. "others" is the share of the machine that other programs used meanwhile: compare ratios within
    one run, and quote figures of an idle machine only.
    """
    if save:
        results_folder()  # says so at once where there is no repository
    watch = Watch()
    rows: list[Row] = []
    every = {**SHORT, **LONG}
    with opencv_threads(1):
        for group in tqdm(only or list(every if long else SHORT), unit=" groups", disable=None):
            for row in every[group]():
                rows.append(row)
                tqdm.write(_line(row))
    about = machine()
    others = watch.others()
    click.echo("  ".join(f"{name} {value}" for name, value in about.items()))
    click.echo(f"others used {others:.0%} of the machine, load average {os.getloadavg()[0]:.1f}"
               + ("" if others <= IDLE else ": not idle, compare ratios only"))  # fmt: skip
    if save:
        click.echo(_save(rows, {**about, "others": round(others, 3)}))


def _line(row: Row) -> str:
    """Return a row as a line of text."""
    sign = ">=" if row.at_least else "<="
    verdict = "ok  " if row.is_met else "miss"
    return (
        f"{verdict} {row.name:17} {row.measured:8.3g} {row.unit} (reach {sign} {row.reach:.3g}; by the clock "
        f"{row.by_clock:.3g}; others {row.others:.0%}, load {row.load:.1f})  {row.what}; beside: {row.beside}"
    )


def _save(rows: list[Row], about: dict[str, object]) -> str:
    """Write rows and a description of the machine to a file of results/bench/ and return its name."""
    now = datetime.now(UTC)
    processor = "-".join(str(about["processor"]).lower().replace("(r)", "").split())
    folder = results_folder() / "bench"
    folder.mkdir(exist_ok=True)
    path = folder / f"{now:%Y-%m-%d}-{processor}-{about['cores']}-cores.json"
    table = {"when": f"{now:%Y-%m-%d %H:%M} UTC", **about, "rows": [dataclasses.asdict(row) for row in rows]}
    path.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    return f"results/bench/{path.name}"
