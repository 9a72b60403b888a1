"""Progress of what takes longer than two seconds: on standard error, and only on a terminal."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import click
from tqdm import tqdm

from bicode_lab.events import Events
from bicode_lab.recordings import Recording

DELAY_S = 2.0


def chunks_with_progress(recording: Recording) -> Iterator[Events]:
    """Yield the chunks of a recording with a progress bar, and say what the recording remarks, each line once.

    Parameters
    ----------
    recording : Recording

    Yields
    ------
    ndarray of EVENT_DTYPE
    """
    said: set[str] = set()
    first_us: int | None = None
    with tqdm(unit=" events", unit_scale=True, disable=None, delay=DELAY_S) as bar:
        for chunk in recording.chunks():
            _say_remarks(recording, said)
            first_us = int(chunk["t"][0]) if first_us is None else first_us
            yield chunk
            bar.set_description(f"{(int(chunk['t'][-1]) - first_us) * 1e-6:.1f} s", refresh=False)
            bar.update(chunk.size)
    _say_remarks(recording, said)


def _say_remarks(recording: Recording, said: set[str]) -> None:
    """Say what the recording remarks, each line once and as soon as it is known."""
    for line in recording.remarks:
        if line not in said:
            said.add(line)
            click.echo(f"{recording.path}: {line}", err=True)


@contextmanager
def waiting(words: str) -> Iterator[None]:
    """Show how long something takes that has no parts to count.

    Parameters
    ----------
    words : str
        What is going on.
    """
    if not sys.stderr.isatty():
        yield
        return
    begun, done = time.monotonic(), threading.Event()

    def show() -> None:
        wait_s = DELAY_S
        while not done.wait(wait_s):
            sys.stderr.write(f"\r{words}: {time.monotonic() - begun:.0f} s")
            sys.stderr.flush()
            wait_s = 1.0

    thread = threading.Thread(target=show, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
        if time.monotonic() - begun >= DELAY_S:
            sys.stderr.write("\r" + " " * (len(words) + 12) + "\r")
            sys.stderr.flush()
