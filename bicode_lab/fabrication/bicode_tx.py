"""Bicode transmitter: an RP2040 that sends one packet again and again with an LED (III-A of the paper).

It runs under MicroPython on a Seeed XIAO RP2040 or any other RP2040 board and needs nothing else. Copy it to the board
as main.py (see docs/build.md); then the LED blinks whenever the board has power.

A state machine of the PIO, which does nothing else, times every edge. Python only fills its queue, 256 chips ahead, so
a pause of Python delays no edge.
"""

from array import array

import machine
import rp2

# ---- settings: the receiver must be told the same ------------------------------------

ID = 37  # what is sent, 0 .. 2**PAYLOAD_BITS - 1
PIN = 26  # GPIO number of the LED driver; 26 is the pin marked D0 on the XIAO RP2040
F_ID_HZ = 1000  # bits per second; a chip (half a bit) lasts 1 / (2 F_ID_HZ)
START_BITS = 3  # how long the LED stays off before each packet, in bits
PAYLOAD_BITS = 8  # width of the ID
CHECKSUM = "sum"  # "sum": number of ones in the ID; "crc3": CRC-3, x^3 + x + 1
CHECKSUM_BITS = 3  # width of the checksum; 3 for "crc3"
MANCHESTER = "ieee"  # a 1 is "ieee": off then on, "thomas": on then off
BIT_ORDER = "msb"  # which end of ID and checksum goes first, "msb" or "lsb"
CODE = "bicode"  # "interval", "uart" and "frequency" are other ways to blink at F_ID_HZ, see below
TEXT = "HELLO"  # what "uart" sends

# ---- from the ID to chips (half bits): 0 LED off, 1 LED on ----------------------------


def number_to_bits(number, width):
    """Return the bits of a number in the order in which they are sent."""
    bits = [number >> place & 1 for place in range(width)]  # the lowest bit first
    if BIT_ORDER == "msb":
        bits.reverse()
    return bits


def checksum(payload):
    """Return the checksum of an ID."""
    if CHECKSUM == "sum":
        return sum(number_to_bits(payload, PAYLOAD_BITS)) % 2**CHECKSUM_BITS
    remainder = payload << 3
    for shift in range(PAYLOAD_BITS - 1, -1, -1):
        if remainder >> (shift + 3) & 1:
            remainder ^= 0b1011 << shift
    return remainder ^ 0b111


def packet_chips():
    """Return the chips of one packet: start, ID, checksum."""
    chips = [0] * (2 * START_BITS)
    for bit in number_to_bits(ID, PAYLOAD_BITS) + number_to_bits(checksum(ID), CHECKSUM_BITS):
        second = bit if MANCHESTER == "ieee" else 1 - bit
        chips += [1 - second, second]
    return chips


def interval_chips():
    """Return a word of the interval code: rises 4 chips apart (start), then 2 for each 0 and 3 for each 1 of the ID."""
    chips = [1, 0, 0, 0]
    for place in range(PAYLOAD_BITS - 1, -1, -1):
        chips += [1, 0, 0] if ID >> place & 1 else [1, 0]
    return chips


def uart_chips():
    """Return the letters of TEXT: start 0, 7 bits with the highest first, even parity, two stop bits 1."""
    chips = []
    for letter in TEXT:
        bits = [ord(letter) >> place & 1 for place in range(6, -1, -1)]
        chips += [0] + bits + [sum(bits) % 2, 1, 1]
    return chips


def sent_chips():
    """Return what is sent again and again, and how many chips each cycle of F_ID_HZ has."""
    if CODE == "interval":
        return interval_chips(), 1  # F_ID_HZ is base periods per second
    if CODE == "uart":
        return uart_chips(), 1  # F_ID_HZ is the baud rate
    if CODE == "frequency":
        return [1, 0], 2  # F_ID_HZ is the frequency
    return packet_chips(), 2


# ---- from chips to the pin -----------------------------------------------------------

STEPS_PER_CHIP = 500  # of the program below: 4 + 16 + 15 * 32


@rp2.asm_pio(
    out_init=rp2.PIO.OUT_LOW,
    out_shiftdir=rp2.PIO.SHIFT_LEFT,
    autopull=True,
    pull_thresh=32,
    fifo_join=rp2.PIO.JOIN_TX,
)
def send_chips():
    """Run on the PIO: put the next chip on the pin, wait, repeat; [n] adds n steps."""
    out(pins, 1)[3]
    set(x, 14)[15]
    label("wait")
    jmp(x_dec, "wait")[31]


def words_of(chips):
    """Return chips, a multiple of 32 of them, as words of 32 bits for the queue of the PIO."""
    words = array("I")
    for first in range(0, len(chips), 32):
        word = 0
        for chip in chips[first : first + 32]:
            word = word << 1 | chip
        words.append(word)
    return words


def check_settings():
    """Raise ValueError if the settings cannot be sent."""
    if not 0 <= ID < 2**PAYLOAD_BITS:
        raise ValueError("ID=%d does not fit PAYLOAD_BITS=%d; choose 0 .. %d" % (ID, PAYLOAD_BITS, 2**PAYLOAD_BITS - 1))
    if CHECKSUM not in ("sum", "crc3") or (CHECKSUM == "crc3" and CHECKSUM_BITS != 3):
        raise ValueError('CHECKSUM is "sum", or "crc3" with CHECKSUM_BITS = 3')
    if MANCHESTER not in ("ieee", "thomas") or BIT_ORDER not in ("msb", "lsb"):
        raise ValueError('MANCHESTER is "ieee" or "thomas", BIT_ORDER is "msb" or "lsb"')
    if CODE not in ("bicode", "interval", "uart", "frequency"):
        raise ValueError('CODE is "bicode", "interval", "uart" or "frequency"')
    if CODE == "uart" and (not TEXT or max(ord(letter) for letter in TEXT) > 127):
        raise ValueError("TEXT is one letter or more, each of 7 bits")
    chips = sent_chips()[1]
    slowest_hz, fastest_hz = (machine.freq() / part / (chips * STEPS_PER_CHIP) for part in (65536, 1))
    if not slowest_hz < F_ID_HZ <= fastest_hz:
        raise ValueError("F_ID_HZ=%s is not in %.2f .. %.0f" % (F_ID_HZ, slowest_hz, fastest_hz))


def send():
    """Blink until the power is switched off or Ctrl-C is pressed."""
    check_settings()
    chips, chips_per_cycle = sent_chips()
    words = words_of(chips * (32 if len(chips) % 2 else 16))  # always whole words
    steps_hz = round(F_ID_HZ * chips_per_cycle * STEPS_PER_CHIP)
    blinker = rp2.StateMachine(0, send_chips, freq=steps_hz, out_base=machine.Pin(PIN))
    blinker.active(1)
    try:
        while True:
            blinker.put(words)  # waits while the queue is full
    finally:
        blinker.active(0)
        machine.Pin(PIN, machine.Pin.OUT, value=0)  # never leave the LED on


if __name__ == "__main__":
    send()
