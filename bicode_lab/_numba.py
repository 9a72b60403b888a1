"""Compiled kernels of other sources are thrown away.   the package's files -> its cached kernels, or none

Numba keeps a compiled kernel beside its file and compiles it again when that file changes. A kernel that is called by
it, from another file, it does not watch: after an update, a kept kernel would go on with the old one inside, without
a word. So the state of all sources is kept beside them, and where it is another, every kept kernel goes.
"""

from __future__ import annotations

import contextlib
import hashlib
from pathlib import Path

STAMP = "kernels.stamp"


def forget_stale_kernels(package: Path) -> bool:
    """A package's folder in; True where sources have changed since its kernels were kept, and they were removed.

    A source is known by its path, size and time of change. Where nothing can be written nothing is kept either,
    and nothing is done.
    """
    sources = sorted(path for path in package.rglob("*.py") if "__pycache__" not in path.parts)
    states = [(path.relative_to(package).as_posix(), path.stat()) for path in sources]
    text = "\n".join(f"{name} {state.st_size} {state.st_mtime_ns}" for name, state in states)
    now = hashlib.sha256(text.encode()).hexdigest()
    stamp = package / "__pycache__" / STAMP
    if stamp.is_file() and stamp.read_text(encoding="utf-8") == now:
        return False
    with contextlib.suppress(OSError):
        stamp.parent.mkdir(exist_ok=True)
        for pattern in ("*.nbi", "*.nbc"):
            for kept in package.rglob(pattern):
                kept.unlink(missing_ok=True)
        stamp.write_text(now, encoding="utf-8")
        return True
    return False
