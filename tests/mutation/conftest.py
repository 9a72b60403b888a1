"""Let the files of this folder find each other when their doctests are collected."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
