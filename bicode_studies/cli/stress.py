"""``bicode stress``: how both receivers fare as recordings get worse, seed by seed, into a table."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
from tqdm import tqdm

from bicode_studies.cli.kept_rows import KeptRows
from bicode_studies.repository import repository_root
from bicode_studies.robustness.receiver_ranges import receiver_ranges
from bicode_studies.robustness.stressors import DISTANCE, STRESSORS, over_seeds
from bicode_studies.robustness.stressors import stress as stress_trial


@click.command()
@click.option("--seeds", type=click.IntRange(1), default=20, show_default=True, help="Recordings of each condition.")
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Where rows are kept  [default: figures/stress.csv]",
)
def stress(seeds: int, out: Path | None) -> None:
    """Lose, add, shift and saturate events, move away, and count the periods that both receivers still read.

    Each trial is written to OUT when it is done, and one that is there is not done again, if the same code made it.
    """
    kept = KeptRows(out or repository_root() / "figures" / "stress.csv", stress_trial)
    names = ["stressor", "level", "seed"]
    done = set() if kept.table.empty else set(kept.table[names].itertuples(index=False, name=None))
    trials = [(s, float(level), seed) for seed in range(seeds) for s in (*STRESSORS, DISTANCE) for level in s.levels]
    missing = [trial for trial in trials if (trial[0].name, trial[1], trial[2]) not in done]
    for stressor, level, seed in tqdm(missing, unit=" trials", disable=None):
        kept.add(stress_trial(stressor, level, seed))
    table = kept.table[kept.table["seed"] < seeds]
    summary = over_seeds(table, np.random.default_rng(0))
    click.echo(summary.drop(columns="distance_m").to_string(index=False, float_format="%.3g"))
    click.echo()
    click.echo(receiver_ranges(table, np.random.default_rng(0)).to_string(index=False, float_format="%.3g"))
