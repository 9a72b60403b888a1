"""Change the code in many small ways, one at a time, and see whether a test notices (``make mutants``).

The changes are made in a copy of the tree, ``build/mutants/tree``. Results are kept in
``build/mutants/finished.jsonl``, so a run that was stopped goes on where it was. A result holds as long as the changed
file stays what it was, and the test file that noticed the change, or, for a survivor, all tests that were asked.

No finished tool fits. mutmut 3 changes neither decorated functions, so no kernel, nor constants of a module. cosmic-ray
starts Python anew for each change and needs 14 packages that are not pinned here. Kernels compile again exactly where a
changed file is imported, see `bicode_lab.kernels`.

    python tests/mutation/run.py --part marker --part camera --per-part 50
    python tests/mutation/run.py --full
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pandas as pd
import psutil
from mutants import Mutant
from parts import ALL_OF, PARTS, PER_PART, SEED, asked_tests, mutants_of_part, sample
from tables import mutant_table, score_table

ROOT = Path(__file__).resolve().parents[2]
LIMIT_SHARE, LIMIT_EXTRA_S = 2, 20  # time limit: twice what the unchanged code needs, compiling included
FIRST_LIMIT_S = 1800  # of the unchanged code, whose kernels may all have to be compiled


class Workshop:
    """A copy of the tree, and a process that runs pytest in it.

    Parameters
    ----------
    source : Path
        The checkout; it is read only.
    folder : Path
        Where the copy, the compiled kernels and the finished results are.
    """

    def __init__(self, source: Path, folder: Path) -> None:
        self.tree, self.kernels, self.store = folder / "tree", folder / "numba", folder / "finished.jsonl"
        self.kernels.mkdir(parents=True, exist_ok=True)
        copy_tree(source, self.tree)
        neighbour = source.parent / "shared"  # real recordings, beside the project
        if neighbour.is_dir() and not (folder / "shared").exists():
            (folder / "shared").symlink_to(neighbour)
        environment = {**os.environ, "PYTHONPATH": str(self.tree), "NUMBA_CACHE_DIR": str(self.kernels)}
        environment |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
        command = [sys.executable, str(Path(__file__).with_name("fork_server.py")), str(self.tree)]
        self.server = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            preexec_fn=go_behind,
            start_new_session=True,
        )
        self.finished: dict[str, dict[str, object]] = {}
        if self.store.exists():
            for line in self.store.read_text(encoding="utf-8").splitlines():
                result = json.loads(line)
                self.finished[result["key"]] = result

    def pytest(self, tests: list[str], limit_s: float) -> dict[str, object]:
        """Run tests in the tree as it is."""
        assert self.server.stdin is not None
        assert self.server.stdout is not None
        self.server.stdin.write(json.dumps({"arguments": tests, "limit_s": limit_s}) + "\n")
        self.server.stdin.flush()
        return json.loads(self.server.stdout.readline())

    def close(self) -> None:
        """End the process and the tests that it runs."""
        for process in [*psutil.Process(self.server.pid).children(recursive=True), self.server]:
            process.kill()
        self.server.wait()

    def limit_s(self, tests: list[str]) -> float:
        """Return the time limit of a part, from its tests on the unchanged code, which must pass."""
        key = "unchanged " + self._digest_of_all(tests)
        if key not in self.finished:
            answer = self.pytest(tests, FIRST_LIMIT_S)
            if answer["outcome"] != "passed":
                raise click.ClickException(f"the unchanged code: {answer['outcome']} {answer['by']}")
            self._keep({**answer, "key": key})
        return LIMIT_SHARE * float(str(self.finished[key]["seconds"])) + LIMIT_EXTRA_S

    def result(self, mutant: Mutant, tests_of_part: list[str]) -> dict[str, object]:
        """Return the outcome of a mutant, from the store or from its tests."""
        tests = asked_tests(self.tree, mutant.file)
        key = self._digest(mutant.file, *map(str, (mutant.start, mutant.end, mutant.text)), *mutant.name)
        known = self.finished.get(key)
        if known and known["tests"] == self._digest_of_tests(str(known["by"]), tests):
            return known
        limit_s = self.limit_s(tests_of_part)
        with self._changed(mutant):
            answer = self.pytest(tests, limit_s)
        by = str(answer["by"])
        known = {**answer, "key": key, "tests": self._digest_of_tests(by, tests)}
        self._keep(known)
        return known

    def _keep(self, result: dict[str, object]) -> None:
        self.finished[str(result["key"])] = result
        with self.store.open("a", encoding="utf-8") as to:
            to.write(json.dumps(result) + "\n")

    def _digest(self, file: str, *words: str) -> str:
        text = (self.tree / file).read_bytes() + "\0".join(words).encode()
        return hashlib.sha256(text).hexdigest()[:24]

    def _digest_of_tests(self, by: str, tests: list[str]) -> str:
        """Return a digest of the test file that noticed a mutant, or else of all that were asked."""
        noticing = by.removeprefix("import of ").partition("::")[0]
        if noticing in tests:
            return self._digest(noticing)
        return self._digest_of_all(tests)

    def _digest_of_all(self, tests: list[str]) -> str:
        return hashlib.sha256(" ".join(f"{test} {self._digest(test)}" for test in tests).encode()).hexdigest()[:24]

    @contextlib.contextmanager
    def _changed(self, mutant: Mutant) -> Iterator[None]:
        """Hold the changed file in the tree; afterwards all is as before, also its time, which numba looks at."""
        path = self.tree / mutant.file
        before, kernels = path.stat(), set(self.kernels.iterdir())
        source = path.read_bytes()
        compiled = Path(importlib.util.cache_from_source(str(path)))
        try:
            path.write_bytes(mutant.apply(source))
            compiled.unlink(missing_ok=True)
            yield
        finally:
            path.write_bytes(source)
            os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
            compiled.unlink(missing_ok=True)
            for folder in set(self.kernels.iterdir()) - kernels:
                shutil.rmtree(folder)


def go_behind() -> None:
    """Let everything else on the machine go first."""
    os.nice(15)
    with contextlib.suppress(OSError):
        Path("/proc/self/autogroup").write_text("15")


def copy_tree(source: Path, tree: Path) -> None:
    """Make the copy equal to the files that git knows or would add; files that are equal already keep their time."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, cwd=source, check=True, capture_output=True, text=True).stdout.split("\0")
    wanted = {name for name in names if (source / name).is_file()}
    for path in tree.rglob("*.py"):
        if path.relative_to(tree).as_posix() not in wanted:
            path.unlink()
    for name in sorted(wanted):
        if not (tree / name).is_file() or (tree / name).read_bytes() != (source / name).read_bytes():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source / name, tree / name)


def try_part(workshop: Workshop, part: str, mutants: list[Mutant], files: list[str]) -> Iterator[dict[str, object]]:
    """Yield a row of the table for each mutant of a part, which has these files."""
    tests = list(dict.fromkeys(test for file in files for test in asked_tests(workshop.tree, file)))
    for mutant in mutants:
        result = workshop.result(mutant, tests)
        outcome = "noticed" if result["outcome"] == "failed" else "survived"
        click.echo(f"{result['seconds']:>6} s  {outcome:8}  {mutant.file}:{mutant.line}  {mutant.change}")
        row = {"part": part, "file": mutant.file, "line": mutant.line, "function": mutant.function}
        yield {**row, "change": mutant.change, "outcome": outcome, "noticed_by": result["by"]}


@click.command(help=__doc__)
@click.option("--part", "parts", multiple=True, type=click.Choice(list(PARTS)), help="Part to try; all if not given.")
@click.option("--per-part", default=PER_PART, show_default=True, help="Mutants of each part; of small parts all.")
@click.option("--full", is_flag=True, help="All mutants of all parts; takes a day.")
@click.option("--seed", default=SEED, show_default=True, help="Which mutants are drawn.")
@click.option("--root", default=ROOT, type=click.Path(path_type=Path), help="The checkout.")
def main(parts: tuple[str, ...], per_part: int, full: bool, seed: int, root: Path) -> None:
    """Try mutants and write the tables; rows of parts that are not tried stay."""
    table, scores = root / "results" / "mutants.csv", root / "results" / "mutants_by_part.csv"
    rows: dict[str, list[dict[str, object]]] = {part: [] for part in PARTS}
    for row in pd.read_csv(table, keep_default_na=False).to_dict("records") if table.exists() else []:
        outcome = "noticed" if row["outcome"] == "noticed" else "survived"  # equivalent ones are marked anew
        rows[str(row["part"])].append({**row, "outcome": outcome})
    workshop = Workshop(root, root / "build" / "mutants")
    every = {part: mutants_of_part(workshop.tree, part) for part in PARTS}
    try:
        for part in parts or PARTS:
            chosen = sample(every[part], len(every[part]) if full or part in ALL_OF else per_part, seed)
            rows[part] = []
            for new in try_part(workshop, part, chosen, list(dict.fromkeys(mutant.file for mutant in every[part]))):
                rows[part].append(new)
    finally:
        workshop.close()
        flat = [row for part in PARTS for row in sorted(rows[part], key=lambda row: (row["file"], row["line"]))]
        mutants = mutant_table(flat, root / "tests" / "mutation" / "equivalent.csv")
        mutants.to_csv(table, index=False, lineterminator="\n")
        by_part = score_table(mutants, {part: len(each) for part, each in every.items()})
        by_part.to_csv(scores, index=False, lineterminator="\n")
        click.echo(by_part.to_string(index=False))


if __name__ == "__main__":
    main()
