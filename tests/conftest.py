"""What tests share: the real recordings, and small event arrays."""

from pathlib import Path

import numpy as np
import pytest

from bicode_lab.events import Events, make_events

RECORDINGS = Path(__file__).resolve().parents[1].parent / "shared" / "recordings"


@pytest.fixture(scope="session")
def real_recordings() -> Path:
    """The folder of real recordings beside the project; tests that need it are skipped where it is absent."""
    if not RECORDINGS.is_dir():
        pytest.skip("the real recordings are not here: put them in ../shared/recordings beside the project")
    return RECORDINGS


@pytest.fixture
def some_events() -> Events:
    """A thousand events all over a 640x480 sensor, 5.000 to 24.980 ms."""
    i = np.arange(1000)
    return make_events(i * 7 % 640, i * 3 % 480, i // 3 % 2, 5000 + 20 * i)
