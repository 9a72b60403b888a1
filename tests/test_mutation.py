"""The tool that changes the code and asks the tests: on a small package, and its kinds of change one by one."""

import ast
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

sys.path.insert(0, str(Path(__file__).parent / "mutation"))  # for the tool

import run
from mutants import mutants_of
from parts import PARTS, asked_tests, mutants_of_part, sample

ROOT = Path(__file__).resolve().parents[1]

TOY = '''"""A toy with 3 functions."""


def count(n: int) -> int:
    left = n
    while left > 0:
        left -= 1
    return n - left


def triple(n: int) -> int:
    """Return 3 * n.

    >>> triple(2)
    6
    """
    if n is None:
        raise ValueError(f"n={n + 1} is not 2 * 2")
    return 3 * n


def is_large(n: int) -> bool:
    return abs(n) > 100
'''

TESTS_OF_TOY = """from bicode_lab.marker.toy import count, is_large

def test_numbers():
    assert count(4) == 4
    assert is_large(1000) and not is_large(5)
"""

EQUIVALENT = """file,function,change,reason
bicode_lab/marker/toy.py,count,while left > 0: -> while left >= 0:,wrongly excused: a test fails
bicode_lab/marker/toy.py,is_large,return abs(n) > 100 -> return abs(n) >= 100,because nobody has exactly 100
"""


@pytest.fixture
def toy(tmp_path: Path) -> Path:
    """A repository with one file, one test and a table of reasons; the other parts are empty."""
    files = {
        "bicode_lab/marker/toy.py": TOY,
        "bicode_lab/__init__.py": "",
        "bicode_lab/marker/__init__.py": "",
        "tests/marker/test_toy.py": TESTS_OF_TOY,
        "tests/mutation/equivalent.csv": EQUIVALENT,
        "results/README.md": "",
        "pyproject.toml": "[tool.pytest.ini_options]\naddopts = '--doctest-modules --import-mode=importlib'\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    subprocess.run(["git", "init", "--quiet"], cwd=tmp_path, check=True)
    return tmp_path


@pytest.mark.slow
def test_a_toy_package(toy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One mutant is noticed by a test, one by a doctest, one hangs, one survives, and one is equivalent."""
    monkeypatch.setattr(run, "LIMIT_EXTRA_S", 1)
    monkeypatch.setattr(run, "go_behind", lambda: None)  # somebody waits for this test
    run.main.callback(parts=("marker",), per_part=100, full=False, seed=1, root=toy)
    table = pd.read_csv(toy / "results" / "mutants.csv", keep_default_na=False).set_index("change")
    assert (toy / "bicode_lab/marker/toy.py").read_text() == TOY
    assert (toy / "build/mutants/tree/bicode_lab/marker/toy.py").read_text() == TOY

    def row(change: str) -> tuple[str, str]:
        return table.outcome[change], table.noticed_by[change]

    by_test, by_doctest = (
        "tests/marker/test_toy.py::test_numbers",
        "bicode_lab/marker/toy.py::bicode_lab.marker.toy.triple",
    )
    assert row("return n - left -> return n + left") == ("survived", "")
    assert row("return abs(n) > 100 -> return abs(n) > 101") == ("survived", "")
    assert row("while left > 0: -> while left > 1:") == ("noticed", by_test)
    assert row("return 3 * n -> return 4 * n") == ("noticed", by_doctest)
    assert row("left -= 1 -> left += 1") == ("noticed", "time limit")
    assert row("return abs(n) > 100 -> return abs(n) >= 100") == ("equivalent", "")
    assert table.reason["return abs(n) > 100 -> return abs(n) >= 100"] == "because nobody has exactly 100"
    assert row("while left > 0: -> while left >= 0:") == ("noticed", by_test)
    assert table.reason["while left > 0: -> while left >= 0:"] == ""
    assert not table.index.str.contains("raise").any()  # no message is changed

    by_part = pd.read_csv(toy / "results" / "mutants_by_part.csv").set_index("part").loc["marker"]
    count = table.outcome.value_counts()
    assert by_part["all"] == by_part.tried == len(table)
    assert by_part.score == pytest.approx(count["noticed"] / (count["noticed"] + count["survived"]), abs=5e-4)
    assert by_part.low < by_part.score < by_part.high

    # A second run asks no test again, and one with other tests asks about the survivors.
    monkeypatch.setattr(run.Workshop, "pytest", lambda *_: pytest.fail("a finished mutant was tried again"))
    run.main.callback(parts=("marker",), per_part=100, full=False, seed=1, root=toy)
    again = pd.read_csv(toy / "results" / "mutants.csv", keep_default_na=False).set_index("change")
    pd.testing.assert_frame_equal(table, again)
    (toy / "tests/marker/test_toy.py").write_text(TESTS_OF_TOY + "    assert not is_large(100)\n")
    with pytest.raises(pytest.fail.Exception, match="tried again"):
        run.main.callback(parts=("marker",), per_part=100, full=False, seed=1, root=toy)


@pytest.mark.parametrize(
    ("source", "after"),
    [
        ("a < b", ["a <= b"]),
        ("a >= b", ["a > b"]),
        ("a == b != c", ["a != b != c", "a == b == c"]),
        ("a not in b", ["a in b"]),
        ("a is not b", ["a is b"]),
        ("(a) + (b)", ["(a) - (b)"]),
        ("a // b % c", ["a * b % c", "a // b * c"]),
        ("a and b or c", ["a or b or c", "a and b and c"]),
        ("not a", ["a"]),
        ("-a", ["a"]),
        ("-1", ["1", "-2", "-0"]),
        ("min(a, b)", ["max(a, b)"]),
        ("np.floor(a)", ["np.ceil(a)"]),
        ("a.any()", ["a.all()"]),
        ("0.5", ["1.0", "0.25"]),
        ("0.0", ["1.0"]),
        ("12", ["13", "24"]),
        ("True", ["False"]),
        ("a *= b", ["a /= b"]),
        ("a[1:]", ["a[2:]", "a[0:]"]),
        ("'a' + b", []),
        ("[a] * n", []),
        ("f'{a + b}'", []),
        ("int | None", []),
        ("raise ValueError(1)", []),
        ("a: Literal[1]", []),
        ("@d(1)\ndef f(): pass", []),
        ("def f(): 'says 1 + 1'", []),
        ("def __repr__(self): return 1", []),
        ("if TYPE_CHECKING: a = 1", []),
        ("zip(a, strict=True)", []),
    ],
)
def test_each_kind_of_change(source: str, after: list[str]) -> None:
    changed = [mutant.apply(source.encode()).decode() for mutant in mutants_of("a.py", source.encode())]
    assert sorted(changed) == sorted(after)


def test_a_change_is_named_by_its_line_and_function() -> None:
    source = b"class A:\n    def f(self):\n        return (\n            x  # 1 < 2\n            + 3\n        )\n"
    mutants = mutants_of("a.py", source)
    assert [(each.line, each.function, each.change) for each in mutants] == [
        (5, "A.f", "+ 3 -> - 3"), (5, "A.f", "+ 3 -> + 2"), (5, "A.f", "+ 3 -> + 4"),
    ]  # fmt: skip
    twice = mutants_of("a.py", b"x += y\nx += y\n")
    assert [each.change for each in twice] == ["x += y -> x -= y", "x += y -> x -= y [2]"]


@pytest.mark.parametrize("part", PARTS)
def test_every_mutant_of_the_packages_has_a_name_of_its_own_and_is_python(part: str) -> None:
    mutants = mutants_of_part(ROOT, part)
    assert len({each.name for each in mutants}) == len(mutants) > 50
    for each in sample(mutants, 20, seed=1):
        source = (ROOT / each.file).read_bytes()
        assert ast.dump(ast.parse(each.apply(source))) != ast.dump(ast.parse(source))


def test_every_reason_names_a_mutant() -> None:
    """A reason of which nothing is left is removed."""
    names = {each.name for part in PARTS for each in mutants_of_part(ROOT, part)}
    reasons = pd.read_csv(ROOT / "tests" / "mutation" / "equivalent.csv", keep_default_na=False, dtype=str)
    assert not {(row.file, row.function, row.change) for row in reasons.itertuples()} - names
    assert (reasons.reason.str.split().str.len() >= 4).all()


def test_a_larger_sample_holds_the_smaller_one() -> None:
    mutants = mutants_of_part(ROOT, "marker")
    assert sample(mutants, 20, seed=1)[:5] == sample(mutants[::-1], 5, seed=1)
    assert sample(mutants, 20, seed=1) != sample(mutants, 20, seed=2)
    assert len(sample(mutants, 10**9, seed=1)) == len(mutants)


def test_the_nearest_tests_come_first_and_a_kernel_has_those_of_its_users() -> None:
    assert asked_tests(ROOT, "bicode_lab/marker/led.py")[:2] == ["tests/marker/test_led.py", "bicode_lab/marker/led.py"]
    assert "tests/marker/test_board.py" in asked_tests(ROOT, "bicode_lab/marker/led.py")
    score = asked_tests(ROOT, "bicode_studies/score.py")
    assert score[0].startswith("tests/studies/test_score")
    assert not [test for test in score if "test_trial" in test]
    assert "tests/studies/claims/test_claims.py" in asked_tests(ROOT, "bicode_studies/claims/verdicts.py")
    kernel = asked_tests(ROOT, "bicode_lab/recognition/led_state.py")
    assert kernel[0] == "tests/recognition/test_led_state.py"
    assert kernel[-2:] == ["tests/soft_receiver/test_clock.py", "tests/soft_receiver/test_receiver.py"]
