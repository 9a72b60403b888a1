"""``bicode what-if``: the sliders of notebook 15 as a page of their own, at an address of this machine."""

from __future__ import annotations

import importlib.util
import json
import logging
import os
import socket
import tempfile
from pathlib import Path

import click

ADDRESS = "127.0.0.1"
FORGET = {"idle_timeout": 120, "interval": 30}  # s; a reader who has left leaves a kernel behind
PAGE = "from bicode_studies.what_if.page import what_if_page\n\nwhat_if_page()"
# Voila's own template loads a font from the network; the page has to open without one.
TEMPLATE = """{%- extends 'voila/templates/lab/index.html.j2' -%}
{%- block notebook_css -%}
{{ super() | replace("https://cdn.jsdelivr.net/npm/@fortawesome/fontawesome-free@^5/css/all.min.css", "data:text/css,")
 | replace("https://cdn.jsdelivr.net/npm/@fortawesome/fontawesome-free@^5/css/v4-shims.min.css", "data:text/css,") }}
{%- endblock notebook_css -%}
"""


@click.command("what-if")
@click.option("--port", type=click.IntRange(1, 65535), default=8866, show_default=True, help="Of the address.")
@click.option("--no-browser", is_flag=True, help="Only print the address.")
def what_if(port: int, no_browser: bool) -> int:
    """Ask what if with sliders, on a page in the browser; Ctrl-C ends it."""
    if importlib.util.find_spec("voila") is None:
        raise ValueError("the page needs voila, which is not here; install it with: pip install 'bicode-lab[app]'")
    refuse_taken(port)
    with tempfile.TemporaryDirectory(prefix="bicode-what-if-") as folder:
        serve(Path(folder), port, no_browser)
    return 0


def refuse_taken(port: int) -> None:
    """A port in; `ValueError` where something else listens on it, or it may not be used."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((ADDRESS, port))
        except OSError as error:
            raise ValueError(f"port {port} cannot be used ({error.strerror}); choose another with --port") from None


def serve(folder: Path, port: int, no_browser: bool) -> None:
    """An empty folder and a port in; the page is written there and served until Ctrl-C."""
    from tornado.ioloop import IOLoop
    from voila.app import Voila

    from bicode_studies.notebook.runner import KERNEL_NAME, kernel_of_this_interpreter

    class Page(Voila):  # type: ignore[misc]
        """Voila that says where it is once it is there."""

        def listen(self) -> None:
            """Wait for readers until Ctrl-C; the first thing that the loop does is to say where."""
            said = f"the page is at http://{ADDRESS}:{port}/ (Ctrl-C ends it)"
            IOLoop.current().add_callback(click.echo, said)
            super().listen()

    template = folder / "voila" / "templates" / "bicode"
    template.mkdir(parents=True)
    (template / "conf.json").write_text(json.dumps({"base_template": "lab"}), encoding="utf-8")
    (template / "index.html.j2").write_text(TEMPLATE, encoding="utf-8")
    notebook = folder / "Bicode, what if.ipynb"
    notebook.write_text(json.dumps(page_notebook(KERNEL_NAME)), encoding="utf-8")
    os.environ["JUPYTER_PATH"] = os.pathsep.join(filter(None, [str(folder), os.environ.get("JUPYTER_PATH")]))
    with kernel_of_this_interpreter(folder):
        options = [f"--port={port}", f"--Voila.ip={ADDRESS}", "--Voila.log_level=ERROR", "--template=bicode"]
        options += [f"--MappingKernelManager.cull_{what}={seconds}" for what, seconds in FORGET.items()]
        logging.getLogger("tornado").setLevel(logging.ERROR)
        Page.launch_instance([str(notebook), *options, *(["--no-browser"] if no_browser else [])])


def page_notebook(kernel_name: str) -> dict[str, object]:
    """The name of a kernel in, the page as a notebook of one cell out."""
    cell: dict[str, object] = {
        "cell_type": "code",
        "id": "page",
        "metadata": {},
        "source": PAGE,
        "outputs": [],
        "execution_count": None,
    }
    kernel = {"display_name": "bicode_lab", "language": "python", "name": kernel_name}
    return {"cells": [cell], "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
