"""Run the tests of the camera without time limits, because a first call compiles the kernels."""

import sys
from pathlib import Path

from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent))  # for `plain_pixels`, the oracle

settings.register_profile("without a clock", deadline=None)
settings.load_profile("without a clock")
