"""A receiver beyond the paper that takes soft decisions: it weighs all evidence instead of deciding bin by bin.

- `line_code` says what a light may send: Bicode's packet, or UART characters; `nodes` adds a memory to its states.
- `clock` and `levels` learn the transmitter's clock and the probabilities of the marks from the data.
- `viterbi` finds the most likely path through the states.
- `places` and `repeated_packets` read one packet from many repetitions of it.
- `faint_regions` finds markers that are too faint for the regions of a single period.
- `receiver` puts all this together, period after period.
- `uart` reads a text instead of an ID; the folder `text` holds what it needs for it.
"""

from bicode_lab.soft_receiver.clock import find_chips, lead_marks
from bicode_lab.soft_receiver.faint_regions import find_faint_regions
from bicode_lab.soft_receiver.line_code import BicodeLine, LineCode, UartLine
from bicode_lab.soft_receiver.receiver import SoftReceiver, SoftSettings
from bicode_lab.soft_receiver.repeated_packets import Reading, doubt, read_repeated_packets
from bicode_lab.soft_receiver.text.check import TextCheck
from bicode_lab.soft_receiver.uart import TextReading, UartCharacter, read_text, read_uart

__all__ = [
    "BicodeLine",
    "LineCode",
    "Reading",
    "SoftReceiver",
    "SoftSettings",
    "TextCheck",
    "TextReading",
    "UartCharacter",
    "UartLine",
    "doubt",
    "find_chips",
    "find_faint_regions",
    "lead_marks",
    "read_repeated_packets",
    "read_text",
    "read_uart",
]
