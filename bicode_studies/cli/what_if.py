"""``bicode what-if``: serve the sliders of notebook 15 as a page of their own on this machine."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
import logging
import os
import socket
import tempfile
from pathlib import Path

import click

from bicode_lab.fabrication import read_marker
from bicode_lab.marker import Marker
from bicode_studies.cli.helpers.marker_options import marker_option

ADDRESS = "127.0.0.1"
CULLING = {"idle_timeout": 120, "interval": 30}  # [s] ends the kernels of readers who have left
PAGE = """from bicode_studies.what_if.choice import Choice
from bicode_studies.what_if.page import what_if_page

what_if_page(Choice({settings}))"""
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
@marker_option
@click.option("--no-browser", is_flag=True, help="Print the address, but open no browser.")
def what_if(port: int, no_browser: bool, marker_file: Path | None) -> int:
    """Serve a page with sliders that shows how well a marker is read.

    The page opens in the browser and shows what happens when the packet, the receiver's times, the marker or the light
    are changed. Ctrl-C ends the command. With --marker it begins with the settings of that marker.
    """
    settings = {} if marker_file is None else settings_of(read_marker(marker_file))
    if importlib.util.find_spec("voila") is None:
        raise ValueError(
            "the page needs voila, which is not installed; in a clone of the repository: pip install '.[app]'"
        )
    refuse_taken(port)
    with tempfile.TemporaryDirectory(prefix="bicode-what-if-") as folder:
        serve(Path(folder), port, no_browser, settings)
    return 0


def settings_of(marker: Marker) -> dict[str, object]:
    """Return the page's settings of a marker, and say on standard error which of the marker's it has no slider for."""
    packet, board, usual = marker.packet_format, marker.board, Marker()
    shown: dict[str, object] = {
        "f_id_hz": packet.f_id_hz,
        "start_bits": packet.start_bits,
        "payload_bits": packet.payload_bits,
        "checksum": packet.checksum,
        "size_m": board.size_m,
        "current_ma": marker.current_ma,
    }
    parts = ((packet, usual.packet_format), (board, usual.board))
    others = [
        f"{field.name}={getattr(part, field.name)}"
        for part, default in parts
        for field in dataclasses.fields(part)
        if field.name not in shown and getattr(part, field.name) != getattr(default, field.name)
    ]
    if others:
        click.echo(f"the page has no slider for {', '.join(others)}, and shows the default", err=True)
    return shown


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


def serve(folder: Path, port: int, no_browser: bool, settings: dict[str, object]) -> None:
    """Write the page to a folder and serve it until Ctrl-C.

    Parameters
    ----------
    folder : Path
        An empty folder.
    port : int
    no_browser : bool
        Whether only the address is printed.
    settings : dict
        What the page begins with, as fields of `what_if.choice.Choice`.
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
    notebook.write_text(json.dumps(page_notebook(KERNEL_NAME, settings)), encoding="utf-8")
    os.environ["JUPYTER_PATH"] = os.pathsep.join(filter(None, [str(folder), os.environ.get("JUPYTER_PATH")]))
    with kernel_of_this_interpreter(folder):
        options = [f"--port={port}", f"--Voila.ip={ADDRESS}", "--Voila.log_level=ERROR", "--template=bicode"]
        options += [f"--MappingKernelManager.cull_{what}={seconds}" for what, seconds in CULLING.items()]
        logging.getLogger("tornado").setLevel(logging.ERROR)
        Page.launch_instance([str(notebook), *options, *(["--no-browser"] if no_browser else [])])


def page_notebook(kernel_name: str, settings: dict[str, object]) -> dict[str, object]:
    """Return the page as a notebook of one cell.

    Parameters
    ----------
    kernel_name : str
        Name of the Jupyter kernel that runs it.
    settings : dict
        What the page begins with.

    Returns
    -------
    dict
        The notebook in nbformat 4.5.
    """
    cell: dict[str, object] = {
        "cell_type": "code",
        "id": "page",
        "metadata": {},
        "source": PAGE.format(settings=", ".join(f"{name}={value!r}" for name, value in settings.items())),
        "outputs": [],
        "execution_count": None,
    }
    kernel = {"display_name": "bicode_lab", "language": "python", "name": kernel_name}
    return {"cells": [cell], "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
