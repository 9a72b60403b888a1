"""The command line ends with the right exit code, and explains every misuse in one line with the nearest name."""

import importlib
import subprocess
import sys
import types
from pathlib import Path

import click
import pytest

from bicode_studies.cli import main as cli
from bicode_studies.cli.doctor import check_folders, check_package, read_pins, requirements, way_to_install
from bicode_studies.notebook.runner import NotebookError


@pytest.fixture
def call(capsys):
    """Return a function that runs ``bicode`` with words and returns exit code, stdout and stderr."""

    def run(*words):
        with pytest.raises(SystemExit) as ended:
            cli.main(words)
        captured = capsys.readouterr()
        return ended.value.code, captured.out, captured.err

    return run


@pytest.fixture
def raising(monkeypatch):
    """Return a function after which ``bicode doctor`` raises a given exception."""

    def install(error):
        @click.command()
        def doctor():
            raise error

        monkeypatch.setitem(cli.COMMANDS, "doctor", ("command_broken", "doctor", "Break."))
        broken = types.ModuleType("bicode_studies.cli.command_broken")
        broken.doctor = doctor
        broken.__spec__ = types.SimpleNamespace()
        monkeypatch.setitem(sys.modules, "bicode_studies.cli.command_broken", broken)

    return install


def test_help_lists_the_commands(call):
    code, out, _ = call("--help")
    assert code == 0
    assert {"run", "figures", "doctor"} <= set(out.split())


@pytest.mark.parametrize("name", ["run", "figures", "doctor"])
def test_every_command_has_help_with_its_words(call, name):
    code, out, _ = call(name, "--help")
    assert code == 0
    assert out.startswith(f"Usage: bicode {name}")


def test_help_imports_nothing_heavy():
    script = (
        "import sys; from bicode_studies.cli.main import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: print(sorted(set(sys.modules) & {'papermill', 'cv2', 'numba', 'pandas', 'matplotlib'}))"
    )
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert out.rstrip().endswith("[]")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["figurs"], "no command 'figurs'; did you mean 'figures'?"),
        (["xyzzy"], "no command 'xyzzy'; there are: "),
        (["figures", "--fulll"], "--full"),
        (["figures", "--jobs", "none"], "'none' is not a valid integer"),
        (["run"], "Missing argument"),
        (["run", "nope.ipynb"], "nope.ipynb: no such notebook"),
    ],
)
def test_misuse_is_one_line_and_exit_code_2(call, words, said):
    code, out, err = call(*words)
    assert code == 2
    assert out == ""
    assert err.startswith("bicode: ")
    assert err.count("\n") == 1
    assert said in err


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (ValueError("first\n second"), 2, "bicode: first second\n"),
        (FileNotFoundError(2, "No such file or directory", "a.raw"), 2, "bicode: a.raw: No such file or directory\n"),
        (KeyboardInterrupt(), 130, "bicode: stopped\n"),
        (click.ClickException("as click says"), 1, "bicode: as click says\n"),
        (OSError(28, "No space left on device"), 2, "No space left on device\n"),
        (
            MemoryError("149 GiB"),
            2,
            "bicode: there is not enough memory (149 GiB); read a shorter file, or free some\n",
        ),
        (EOFError("cut"), 1, "EOFError: cut (this was not foreseen; bicode --debug ... shows where it happened)\n"),
        (BrokenPipeError(), 0, ""),
    ],
)
def test_errors_of_the_library_are_one_line(call, raising, error, code, said):
    raising(error)
    got, _, err = call("doctor")
    assert got == code
    assert err.endswith(said)
    assert "Traceback" not in err


@pytest.mark.parametrize("words", ["decode {0} --format csv", "decode {0}", "--help"])
def test_a_reader_that_has_seen_enough_is_no_error(words):
    near = Path(__file__).resolve().parents[3] / "data" / "near_1m.npz"
    code = "from bicode_studies.cli.main import main; main()"
    command = [sys.executable, "-c", code, *words.format(near).split()]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        process.stdout.close()
        assert "Traceback" not in process.stderr.read()
        assert process.wait() == 0


def test_kernels_without_a_compiler_are_refused_in_one_line(call, monkeypatch):
    importlib.import_module("bicode_studies.cli.decode")  # numba looks at the environment when it is imported
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    code, _, err = call("decode", "any.raw")
    assert (code, err.count("\n")) == (2, 1)
    assert "NUMBA_DISABLE_JIT=1 is set" in err
    assert call("decode", "--help")[0] == call("marker", "--help")[0] == 0
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "0")
    assert "any.raw" in call("decode", "any.raw")[2]


@pytest.mark.parametrize(
    ("words", "ends"),
    [
        (["sweep", "08", "--store", "s.sqlite"], True),
        (["claims"], True),
        (["figures"], True),
        (["html"], True),
        (["calibrate", "--only-current"], True),
        (["stress", "--out", "a.csv"], True),
        (["false-ids", "--store", "a.sqlite"], True),
        (["decode", "any.raw"], False),
        (["sweep", "--help"], False),
    ],
)
def test_commands_that_need_the_repository_say_so_before_they_start(call, monkeypatch, words, ends):
    def nowhere():
        raise ValueError("no notebooks/ here; change into the clone")

    monkeypatch.setattr("bicode_studies.cli.options.repository_root", nowhere)
    code, out, err = call(*words)
    assert (f"bicode {words[0]} works on a clone of the repository: no notebooks/ here; change" in err) == ends
    assert not ends or (code, out, err.count("\n")) == (2, "", 1)
    assert "--out and --store" in err or words[0] not in ("stress", "false-ids")


@pytest.mark.parametrize("words", [["stress"], ["false-ids"], ["calibrate"], ["run", "06"]])
def test_a_file_that_is_named_is_not_replaced(call, tmp_path, words):
    out = tmp_path / "mine"
    out.write_text("mine")
    code, _, err = call(*words, "--output" if words[0] == "run" else "--out", str(out))
    assert (code, err.count("\n")) == (2, 1)
    assert f"{out} is there already and is not replaced" in err
    assert out.read_text() == "mine"


def test_the_table_beside_the_posterior_is_not_replaced(call, tmp_path):
    (tmp_path / "mine_tried.csv").touch()
    assert "mine_tried.csv is there" in call("calibrate", "--out", str(tmp_path / "mine.csv"))[2]


def test_debug_shows_where_an_error_came_from(call, raising, monkeypatch):
    monkeypatch.setenv("BICODE_DEBUG", "")
    raising(ValueError("seven"))
    assert "Traceback" not in call("doctor")[2]
    _, _, err = call("--debug", "doctor")
    assert "Traceback" in err
    assert err.endswith("bicode: seven\n")


def test_run_passes_the_parameters_on(call, make_notebook, monkeypatch, tmp_path):
    path = make_notebook("distance_m = 2.5  # [m]")
    code, out, _ = call(
        "run", str(path), "-p", "distance_m", "-4", "--output", str(tmp_path / "a.ipynb"), "--figures", "."
    )
    assert code == 0
    assert out.startswith("02_try_things.ipynb: ")
    assert "distance_m = -4.0" in (tmp_path / "a.ipynb").read_text()


def test_a_failing_notebook_is_one_line_and_exit_code_1(call, make_notebook, tmp_path):
    path = make_notebook("seed = 0", "1 / 0")
    code, _, err = call("run", str(path), "--output", str(tmp_path / "a.ipynb"), "--figures", str(tmp_path))
    assert code == 1
    assert err.startswith("bicode: 02_try_things.ipynb, cell 3: ZeroDivisionError: division by zero (log: ")
    assert err.count("\n") == 1


def test_figures_tells_each_notebook_and_fails_with_one(call, make_notebook, monkeypatch, tmp_path):
    (tmp_path / "bicode_lab").mkdir()
    make_notebook("seed = 0", name="notebooks/01_see_one.ipynb")
    make_notebook("seed = 0", "1 / 0", name="notebooks/02_see_two.ipynb")
    monkeypatch.chdir(tmp_path)
    code, out, err = call("figures", "--jobs", "2")
    assert code == 1
    assert "ok    01_see_one.ipynb" in out
    assert "1 of 2 notebooks ran; 0 figures written to figures/quick" in out
    assert "FAIL  02_see_two.ipynb, cell 3: ZeroDivisionError" in err
    assert call("figures", "--only", "01")[0] == 0


def test_doctor_finds_all_well_here(call):
    code, out, _ = call("doctor")
    assert "FAIL" not in out
    assert code == 0
    for name in ("numpy", "numba", "cv2.aruco", "kernel", "machine", "fonts"):
        assert f"ok    {name}: " in out


def test_doctor_tells_the_way_out(call, monkeypatch):
    monkeypatch.setattr("bicode_studies.cli.doctor.check_numba", lambda: 1 / 0)
    monkeypatch.setattr("bicode_studies.cli.doctor.requirements", lambda: [("no-such-package", ">=1")])
    monkeypatch.setattr("bicode_studies.cli.doctor.check_kernel", lambda: "skipped")
    code, out, _ = call("doctor")
    assert code == 1
    assert "FAIL  no-such-package: is not installed; run: make" in out
    assert "FAIL  numba: division by zero; run: make" in out
    assert out.endswith("2 to mend\n")


def test_doctor_names_the_cache_of_kernels_or_says_that_there_is_none(monkeypatch, tmp_path):
    monkeypatch.setattr("bicode_lab.kernels.cache_folder", lambda module: tmp_path / "kernels-of-one-file")
    assert check_folders().endswith(f" {tmp_path}")
    monkeypatch.setattr("bicode_lab.kernels.cache_folder", lambda module: None)
    with pytest.raises(RuntimeError, match="kernels cannot be cached"):
        check_folders()


def test_doctor_tells_an_extra_that_is_missing_and_does_not_fail(call, monkeypatch):
    monkeypatch.setattr("bicode_studies.cli.doctor.all_checks", lambda: iter(()))
    monkeypatch.setattr("bicode_studies.cli.doctor.EXTRAS", {"app": ("no_such_module", "bicode what-if needs it")})
    code, out, _ = call("doctor")
    assert code == 0
    assert "no_such_module: is not installed; bicode what-if needs it: in a clone, pip install '.[app]'" in out
    assert out.endswith("all is well, but for no_such_module\n")
    monkeypatch.setattr("bicode_studies.cli.doctor.EXTRAS", {"app": ("numpy", "")})
    assert call("doctor")[1] == "all is well\n"


def test_doctor_sends_nobody_to_make_where_there_is_no_clone(monkeypatch, tmp_path):
    assert way_to_install().startswith("run: make")
    monkeypatch.setattr("bicode_studies.cli.doctor.PROJECT", tmp_path)
    assert way_to_install() == "in a clone of the repository, run: pip install ."


def test_doctor_knows_versions_and_pins():
    assert ("numba", ">=0.60") in requirements()
    assert read_pins()["numpy"][0].isdigit()
    with pytest.raises(RuntimeError, match=">=99 is needed"):
        check_package("numpy", ">=99", None)
    assert "the pins have 0.1" in check_package("numpy", ">=1", "0.1")


def test_a_notebook_error_is_no_misuse():
    assert not issubclass(NotebookError, (ValueError, OSError))
