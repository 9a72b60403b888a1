"""The files for Binder keep repo2docker's rules: one folder, a Python it knows, a script it can run."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
BINDER = ROOT / ".binder"
# What repo2docker would build from instead of runtime.txt, were it in the same folder.
STRONGER = {"environment.yml", "Dockerfile", "Pipfile", "Pipfile.lock", "requirements.txt", "install.R", "Project.toml"}
PYTHONS = {f"python-3.{minor}" for minor in range(10, 15)}  # those repo2docker has a base environment for


def test_there_is_one_folder_of_configuration() -> None:
    assert not (ROOT / "binder").exists(), "repo2docker refuses binder/ beside .binder/"
    assert {path.name for path in BINDER.iterdir()} == {"postBuild", "runtime.txt"}
    assert not {path.name for path in BINDER.iterdir()} & STRONGER


def test_the_python_is_one_that_binder_and_the_package_know() -> None:
    runtime = (BINDER / "runtime.txt").read_text(encoding="utf-8").strip()
    assert runtime in PYTHONS
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    least = re.fullmatch(r">=3\.(\d+)", project["requires-python"])
    assert least is not None
    assert int(runtime.removeprefix("python-3.")) >= int(least[1])
    assert runtime.removeprefix("python-") in (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_script_can_run_in_the_repositorys_root() -> None:
    script = BINDER / "postBuild"
    text = script.read_text(encoding="utf-8")
    assert text.startswith("#!/usr/bin/env bash\n")
    assert script.stat().st_mode & 0o100, "it must be executable"
    subprocess.run(["bash", "-n", str(script)], check=True)
    for named in re.findall(r"(?<=-r )\S+|(?<=lab/tree/)\S+", text):
        assert (ROOT / named).is_file(), named
    assert "sudo" not in text
    assert "--require-hashes" in text


def test_git_keeps_it_executable() -> None:
    listed = subprocess.run(["git", "ls-files", "-s", ".binder/postBuild"], cwd=ROOT, capture_output=True, text=True)
    if not listed.stdout:
        pytest.skip("not a clone")
    assert listed.stdout.startswith("100755")
