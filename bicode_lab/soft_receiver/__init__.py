"""Beyond the paper: a receiver that weighs evidence.   events -> sightings, events -> letters

line_code           what a light may say: Bicode's packet, UART letters
clock, levels       the transmitter's chips, and what they look like, learned from the data
walk                the likeliest walk through a line code's states
repeats             packets laid over each other -> one ID
faint_regions       where something too faint for a period's frames keeps a marker's clock
receive             all of it, period after period
letters, beacon     a text instead of an ID, and the public beacons' files
"""

from bicode_lab.soft_receiver.clock import find_chips, lead_marks
from bicode_lab.soft_receiver.faint_regions import find_faint_regions
from bicode_lab.soft_receiver.line_code import BicodeLine, LineCode, UartLine
from bicode_lab.soft_receiver.receiver import SoftReceiver, SoftSettings
from bicode_lab.soft_receiver.repeated_packets import Limits, Reading, read_repeated_packets
from bicode_lab.soft_receiver.uart import UartCharacter, read_uart

__all__ = [
    "BicodeLine",
    "Limits",
    "LineCode",
    "Reading",
    "SoftReceiver",
    "SoftSettings",
    "UartCharacter",
    "UartLine",
    "find_chips",
    "find_faint_regions",
    "lead_marks",
    "read_repeated_packets",
    "read_uart",
]
