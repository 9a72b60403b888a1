"""``bicode what-if``: serve the sliders of notebook 15 as a page of their own on this machine."""

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
CULLING = {"idle_timeout": 120, "interval": 30}  # [s] ends the kernels of readers who have left
PAGE = "from bicode_studies.what_if.page import what_if_page\n\nwhat_if_page()"
# Voila's own template loads a font from the network; this page must also open without a network.
TEMPLATE = """{%- extends 'voila/templates/lab/index.html.j2' -%}
{%- block notebook_css -%}
{{ super() | replace("https://cdn.jsdelivr.net/npm/@fortawesome/fontawesome-free@^5/css/all.min.css", "data:text/css,")
 | replace("https://cdn.jsdelivr.net/npm/@fortawesome/fontawesome-free@^5/css/v4-shims.min.css", "data:text/css,") }}
{%- endblock notebook_css -%}
"""


@click.command("what-if")
@click.option(
    "--port", type=click.IntRange(1, 65535), default=8866, show_default=True, help="Port of the page's address."
)
@click.option("--no-browser", is_flag=True, help="Print the address, but open no browser.")
def what_if(port: int, no_browser: bool) -> int:
    """Serve a page with sliders that shows how well a marker is read.

    The page opens in the browser and shows what happens when the packet, the receiver's times, the marker or the light
    are changed. Ctrl-C ends the command.
    """
    if importlib.util.find_spec("voila") is None:
        raise ValueError("the page needs voila, which is not installed; install it with: pip install 'bicode-lab[app]'")
    refuse_taken(port)
    with tempfile.TemporaryDirectory(prefix="bicode-what-if-") as folder:
        serve(Path(folder), port, no_browser)
    return 0


def refuse_taken(port: int) -> None:
    """Raise an error if a port cannot be used.

    Parameters
    ----------
    port : int

    Raises
    ------
    ValueError
        If something else listens on the port, or the user has no right to use it.
    """
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((ADDRESS, port))
        except OSError as error:
            raise ValueError(f"port {port} cannot be used ({error.strerror}); choose another with --port") from None


def serve(folder: Path, port: int, no_browser: bool) -> None:
    """Write the page to a folder and serve it until Ctrl-C.

    Parameters
    ----------
    folder : Path
        An empty folder.
    port : int
    no_browser : bool
        Whether only the address is printed.
    """
    from tornado.ioloop import IOLoop
    from voila.app import Voila

    from bicode_studies.notebook.runner import KERNEL_NAME, kernel_of_this_interpreter

    class Page(Voila):  # type: ignore[misc]
        """Voila that prints its address as soon as it serves the page."""

        def listen(self) -> None:
            """Serve until Ctrl-C, and print the address first."""
            message = f"the page is at http://{ADDRESS}:{port}/ (Ctrl-C ends it)"
            IOLoop.current().add_callback(click.echo, message)
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
        options += [f"--MappingKernelManager.cull_{what}={seconds}" for what, seconds in CULLING.items()]
        logging.getLogger("tornado").setLevel(logging.ERROR)
        Page.launch_instance([str(notebook), *options, *(["--no-browser"] if no_browser else [])])


def page_notebook(kernel_name: str) -> dict[str, object]:
    """Return the page as a notebook of one cell.

    Parameters
    ----------
    kernel_name : str
        Name of the Jupyter kernel that runs it.

    Returns
    -------
    dict
        The notebook in nbformat 4.5.
    """
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
