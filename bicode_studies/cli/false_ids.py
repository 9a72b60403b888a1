"""``bicode false-ids``: hours of clutter without a marker, or recordings, in; counts of the IDs read there out."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click
import pandas as pd
from tqdm import tqdm

from bicode_lab.recordings import open_recording
from bicode_studies.cli.kept_rows import KeptRows
from bicode_studies.cli.options import Real
from bicode_studies.repository import repository_root
from bicode_studies.robustness.clutter import RECEIVERS, SCENE_S, SCENES_A_PIECE, add_up, count_ids, count_piece, rates


@click.command(name="false-ids")
@click.argument("files", nargs=-1, type=click.Path(path_type=Path))
@click.option("--hours", type=Real(), default=3.0, show_default=True, help="Of clutter.")
@click.option("--receiver", type=click.Choice([*RECEIVERS, "both"]), default="both", show_default=True)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Where rows are kept  [default: figures/false_ids.csv, for FILES figures/false_ids_real.csv]",
)
def false_ids(files: tuple[Path, ...], hours: float, receiver: str, out: Path | None) -> None:
    """Count IDs in simulated clutter, or in FILES, recordings that hold no marker.

    Clutter comes in pieces of half a minute with seeds of their own. Each is written to OUT when it
    is done, and a piece that is there is not done again, so that a run can be stopped and gone on with;
    pieces counted by other code are.
    """
    if hours <= 0:
        raise ValueError(f"--hours {hours:g} is no time to count in; choose more than 0")
    receivers = RECEIVERS if receiver == "both" else (receiver,)
    figures = repository_root() / "figures"
    if files:
        table = pd.concat([_count_file(file, receivers) for file in files], ignore_index=True)
        target = out or figures / "false_ids_real.csv"
        target.parent.mkdir(parents=True, exist_ok=True)
        table.to_csv(target, index=False, lineterminator="\n")
    else:
        table = _count_clutter(hours, receivers, out or figures / "false_ids.csv")
    for by in (("receiver", "checksum"), ("clutter", "receiver", "checksum")):
        click.echo(rates(table, by).to_string(index=False, float_format="%.4g"))


def _count_clutter(hours: float, receivers: Sequence[str], out: Path) -> pd.DataFrame:
    """Hours in; rows of all their pieces, the missing ones counted and written now, out."""
    kept = KeptRows(out, count_piece)
    done = set() if kept.table.empty else set(zip(kept.table["piece"], kept.table["receiver"], strict=True))
    n_pieces = -int(-hours * 3600 // (SCENE_S * SCENES_A_PIECE))
    missing = {n: [r for r in receivers if (n, r) not in done] for n in range(n_pieces)}
    todo = sorted((n for n in missing if missing[n]), key=lambda n: -len(missing[n]))  # new scenes first
    for number in tqdm(todo, unit=" pieces", disable=None):
        kept.add(count_piece(number, missing[number]))
    kept.write(kept.table.sort_values(["piece", "receiver"], kind="stable"))
    return kept.table[kept.table["piece"] < n_pieces]


def _count_file(file: Path, receivers: Sequence[str]) -> pd.DataFrame:
    """A recording in, its rows out, over its true length."""
    recording = open_recording(file)
    events = recording.read()
    if not events.size:
        raise ValueError(f"{file.name} holds no events, so there is nothing to count in; leave it out")
    seconds = (int(events["t"][-1]) - int(events["t"][0])) * 1e-6
    table = add_up(count_ids(events, seconds, recording.width, recording.height, receivers=receivers))
    table.insert(0, "clutter", file.name)
    table["events"] = events.size
    return table
