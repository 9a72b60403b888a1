"""A file that appears whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bicode_lab.recordings.formats import RecordingError


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A path in, another beside it to write to out, which takes the path's place if all went well."""
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        unfinished.touch()  # some libraries would make a missing folder
        yield unfinished
        unfinished.replace(path)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written ({error.strerror or error}); check the folder") from None
    finally:
        unfinished.unlink(missing_ok=True)
