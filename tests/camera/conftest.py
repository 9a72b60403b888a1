"""A first call compiles the kernels, and machines are busy: no example is judged by the clock."""

import sys
from pathlib import Path

from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent))  # for `plain_pixels`, the oracle

settings.register_profile("without a clock", deadline=None)
settings.load_profile("without a clock")
