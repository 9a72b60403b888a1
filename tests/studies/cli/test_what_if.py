"""Tests of `bicode what-if`: errors take one line, the page is served, and Ctrl-C ends the command."""

import importlib.util
import os
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import nbformat
import pytest

from bicode_lab.marker import Board, Marker, PacketFormat
from bicode_studies.cli import what_if
from bicode_studies.cli.main import main
from bicode_studies.what_if.choice import Choice

ROOT = Path(__file__).resolve().parents[3]


def said_by(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    return ended.value.code, capsys.readouterr().err


def test_without_voila_it_says_what_to_install(monkeypatch, capsys):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "voila" else find(name))
    code, said = said_by(["what-if"], capsys)
    assert (code, said.count("\n")) == (2, 1)
    assert "pip install '.[app]'" in said


def test_a_port_that_is_taken_is_refused_in_one_line(capsys):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        code, said = said_by(["what-if", "--port", str(other.getsockname()[1])], capsys)
    assert (code, said.count("\n")) == (2, 1)
    assert "choose another with --port" in said


def test_the_page_is_a_notebook_that_shows_the_widget():
    notebook = nbformat.from_dict(what_if.page_notebook("a-kernel", {"size_m": 0.1}))
    nbformat.validate(notebook)
    assert "what_if_page(Choice(size_m=0.1))" in notebook.cells[0].source


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="Ctrl-C is sent as a signal")
def test_it_prints_its_address_serves_nothing_from_elsewhere_and_ends_on_ctrl_c():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    script = f"""import signal; signal.signal(signal.SIGINT, signal.default_int_handler)
from bicode_studies.cli.main import main; main(["what-if", "--no-browser", "--port", "{port}"])"""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    server = subprocess.Popen([sys.executable, "-c", script], env=environment, **pipes)
    try:
        address = f"http://127.0.0.1:{port}/"
        assert address in server.stdout.readline()
        with urllib.request.urlopen(address, timeout=120) as answer:
            page = answer.read().decode()
        server.send_signal(signal.SIGINT)
        _, noise = server.communicate(timeout=60)
    finally:
        server.kill()
    assert server.returncode == 0
    assert "Traceback" not in page + noise
    assert "what_if_page" not in page, "the page shows its code"
    assert 'rel="stylesheet" href="http' not in page


def test_a_marker_sets_the_sliders_and_what_has_none_is_told(capsys):
    marker = Marker(
        payload=3, current_ma=20.0, board=Board(size_m=0.1, glow="white"), packet_format=PacketFormat(f_id_hz=500)
    )
    settings = what_if.settings_of(marker)
    assert settings == {
        "f_id_hz": 500, "start_bits": 3, "payload_bits": 8, "checksum": "sum", "size_m": 0.1, "current_ma": 20.0,
    }  # fmt: skip
    assert Choice(**settings).packet_format == marker.packet_format
    assert capsys.readouterr().err == "the page has no slider for glow=white, and shows the default\n"
    what_if.settings_of(Marker())
    assert capsys.readouterr().err == ""


def test_a_marker_file_that_is_wrong_is_one_line(capsys, tmp_path):
    code, said = said_by(["what-if", "--marker", str(tmp_path / "none.toml")], capsys)
    assert (code, said.count("\n")) == (2, 1)
    assert "none.toml" in said
