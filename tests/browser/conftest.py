"""Fixtures: a headless browser and local servers; without Chromium the tests are skipped with a reason."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")
FLAGS = [
    "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-dev-shm-usage",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--force-device-scale-factor=1",
]  # fmt: skip
STARTS_WITHIN_S = 90


def pytest_collection_modifyitems(items):
    """Mark all tests of this folder, and skip them if there is no Chromium."""
    here = Path(__file__).parent
    for item in items:
        if here in Path(item.path).parents:
            item.add_marker(pytest.mark.browser)
            if not (CHROMIUM and DRIVER):
                item.add_marker(pytest.mark.skip(reason="no Chromium here: apt install chromium chromium-driver"))


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """Open one window for all tests."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('chromium')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    window = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=DRIVER))
    window.set_page_load_timeout(STARTS_WITHIN_S)
    yield window
    window.quit()


@pytest.fixture(scope="session")
def serve(tmp_path_factory):
    """Return a function that starts a server from Python's arguments ({port} is filled in) and returns its address."""
    running = []

    def start(*words: str, path: str = "/") -> str:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        log = tmp_path_factory.mktemp("server") / "log.txt"
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "JUPYTER_CONFIG_DIR": str(log.parent / "config")}
        command = [sys.executable, *(word.replace("{port}", str(port)) for word in words)]
        with log.open("w") as to:
            server = subprocess.Popen(command, env=environment, stdout=to, stderr=to, cwd=ROOT)
        running.append(server)
        address = f"http://127.0.0.1:{port}{path}"
        until = time.monotonic() + STARTS_WITHIN_S
        while time.monotonic() < until and server.poll() is None:
            try:
                urllib.request.urlopen(address, timeout=STARTS_WITHIN_S).close()
            except OSError:
                time.sleep(0.3)
            else:
                return address
        raise AssertionError(f"no answer from {' '.join(command)}:\n{log.read_text()[-2000:]}")

    yield start
    for server in running:
        server.terminate()
    for server in running:
        server.wait(20)
