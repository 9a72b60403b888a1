"""Run pytest again and again in children of one process that has imported the libraries once.

Started with the folder of a source tree. Reads one request a line from standard input, ``{"arguments": [...],
"limit_s": 30}``, and answers with one line, ``{"outcome": "passed", "by": "", "seconds": 2.1}``. The outcome is
"passed", "failed" (by the first test that fails, a time limit or a crash) or "no tests". Seconds are of processor time.
The packages of the tree itself are imported in the child alone, so each child sees the tree as it is.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import resource
import select
import signal
import sys
import time
from pathlib import Path

import psutil
import pytest

LIBRARIES = ("numpy", "scipy.ndimage", "scipy.stats", "scipy.spatial.transform", "scipy.optimize", "pandas", "numba")
LIBRARIES += ("cv2", "h5py", "faery", "hypothesis", "matplotlib.pyplot", "skimage", "lazy_loader")
MOST_BYTES = 12 << 30  # of memory: a mutant must not take the whole machine
OPTIONS = ["-x", "-q", "--no-header", "--tb=line", "-p", "no:cacheprovider"]
PASSED, NO_TESTS = 0, 5  # exit codes of pytest
LOOK_EVERY_S = 0.2
IDLE_LIMIT_S = 60  # somebody sleeps or waits for what never comes


class FirstFailure:
    """Remember the first test, or the first file that cannot be imported."""

    by = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep the name of a test that fails."""
        if report.failed:
            self.by = self.by or report.nodeid

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Keep the name of a file that cannot be imported."""
        if report.failed:
            self.by = self.by or f"import of {report.nodeid}"


def import_libraries() -> None:
    """Import what tests need from others, and let hypothesis forget its clock: a changed kernel is compiled anew."""
    for name in LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    from hypothesis import settings

    settings.register_profile("mutants", deadline=None, derandomize=True, database=None)
    settings.load_profile("mutants")


def child(root: Path, arguments: list[str], answer_to: int) -> None:
    """Run pytest in the tree and write the answer. Never returns."""
    os.setsid()
    os.chdir(root)
    sys.path.insert(0, str(root))
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    log = os.open(root.parent / "pytest.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(log, 1)
    os.dup2(log, 2)
    first = FirstFailure()
    try:
        code = int(pytest.main([*OPTIONS, *arguments], plugins=[first]))
    except BaseException as error:  # also SystemExit: whatever ends pytest is no pass
        code, first.by = 1, first.by or f"pytest ended by {type(error).__name__}"
    outcome = {PASSED: "passed", NO_TESTS: "no tests"}.get(code, "failed")
    by = "" if outcome == "passed" else first.by or f"pytest ended with code {code}"
    os.write(answer_to, json.dumps({"outcome": outcome, "by": by}).encode() + b"\n")
    os._exit(0)


def run(root: Path, arguments: list[str], limit_s: float) -> dict[str, object]:
    """Run pytest in a child, and end the child and all that it has started when it hangs."""
    reader, writer = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(reader)
        child(root, arguments, writer)
    os.close(writer)
    family = Family(psutil.Process(pid))
    ready = False
    while not ready and family.spent_s() <= limit_s and family.idle_s() <= IDLE_LIMIT_S:
        ready = bool(select.select([reader], [], [], LOOK_EVERY_S)[0])
    said = os.read(reader, 1 << 16) if ready else b""
    seconds = family.spent_s()
    family.kill()
    status = os.waitpid(pid, 0)[1]
    os.close(reader)
    if said:
        answer = json.loads(said)
    else:
        by = f"crash: {signal.Signals(os.WTERMSIG(status)).name}" if ready and os.WIFSIGNALED(status) else "time limit"
        answer = {"outcome": "failed", "by": by}
    return {**answer, "seconds": round(seconds, 2)}


class Family:
    """A process and all that it starts. Their time is that of the processor: the machine may be busy otherwise."""

    def __init__(self, head: psutil.Process) -> None:
        self.head = head
        self.spent: dict[int, float] = {}
        self.active_at = time.monotonic()

    def spent_s(self) -> float:
        """Return the processor time of all, also of those that have ended."""
        before = sum(self.spent.values())
        for process in self._members():
            with contextlib.suppress(psutil.Error):
                times = process.cpu_times()
                self.spent[process.pid] = times.user + times.system
                if process.status() == psutil.STATUS_RUNNING:  # it may wait for a processor
                    self.active_at = time.monotonic()
        if sum(self.spent.values()) > before:
            self.active_at = time.monotonic()
        return sum(self.spent.values())

    def idle_s(self) -> float:
        """Return for how long nobody has computed or waited for a processor."""
        return time.monotonic() - self.active_at

    def kill(self) -> None:
        """End all."""
        for process in self._members():
            with contextlib.suppress(psutil.Error):
                process.kill()

    def _members(self) -> list[psutil.Process]:
        with contextlib.suppress(psutil.Error):
            return [*self.head.children(recursive=True), self.head]
        return [self.head]


def main() -> None:
    """Answer requests until the input ends."""
    root = Path(sys.argv[1]).resolve()
    sys.path[:] = [each for each in sys.path if Path(each).resolve() != Path(__file__).resolve().parent]
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # no test needs plugins, and looking for them takes 0.3 s
    import_libraries()
    answers = os.fdopen(os.dup(1), "w")
    for line in sys.stdin:
        request = json.loads(line)
        answers.write(json.dumps(run(root, request["arguments"], request["limit_s"])) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
