import sys
from pathlib import Path

from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent))  # for `blinker`, the test double

settings.register_profile("receiver", deadline=None)  # the first call of a kernel compiles it
settings.load_profile("receiver")
