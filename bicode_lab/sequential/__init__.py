"""The sequential receiver: it weighs all evidence of a track from its first packet on; beyond the paper.

- `lattice` finds regions whose events keep the clock of a marker; `tracks` follows them.
- `fold` puts the events of a region on the transmitter's chips; `levels` learns how many events each part of a chip
  makes; `paths` finds the most likely path of the line code.
- `rivals` says what else the events could be; `reading` has the limits that a reading must pass.
- `repeated` reads a packet that is sent again and again, `frames` each packet for itself, both with `judge`.
- `evidence` decides, track by track and period by period; `receiver` puts all this together.
"""

from bicode_lab.sequential.frames import read_frames
from bicode_lab.sequential.receiver import SequentialReceiver, SequentialSettings, SequentialSighting
from bicode_lab.sequential.repeated import read_repeated

__all__ = ["SequentialReceiver", "SequentialSettings", "SequentialSighting", "read_frames", "read_repeated"]
