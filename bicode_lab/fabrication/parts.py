"""The circuit of the LED (III-A): its resistors, and the list of parts.

The transistor closes the circuit supply, resistor, LED, transistor. So ``R = (supply - forward voltage - transistor) /
current``; the nearest value of the E24 series is taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from bicode_lab import paper
from bicode_lab.marker import Marker

E24 = (10, 11, 12, 13, 15, 16, 18, 20, 22, 24, 27, 30, 33, 36, 39, 43, 47, 51, 56, 62, 68, 75, 82, 91)
TRANSISTOR_V = 0.1  # between collector and emitter of a small NPN transistor that is fully on; assumption
BASE_V, PIN_V = 0.7, 3.3  # of the transistor; of the RP2040's pin
MIN_GAIN = 20  # base current is at least collector current / this, so that it is fully on
MAX_BASE_OHM = 1000.0
USB_V = 5.0  # III-A: "powered at a voltage of 5 V"


@dataclass(frozen=True, kw_only=True)
class Led:
    """An LED of III-A.

    Parameters
    ----------
    name, part : str
        What it is, and its part number.
    forward_v : float
        Forward voltage at the current in use [V].
    forward_from : str
        Source of the forward voltage.
    max_ma : float
        Current that must not be exceeded [mA].
    max_from : str
        Source of the maximum current.
    office_ma : float
        Current with which the paper drives a 5 cm plate in its office [mA].
    """

    name: str
    part: str
    forward_v: float
    forward_from: str
    max_ma: float
    max_from: str
    office_ma: float


def leds() -> dict[str, Led]:
    """Return the paper's two LEDs.

    Their data sheets are not quoted. The limit is the highest current that the paper states for each LED, and the
    voltage is that of LEDs of the same colour from the same maker. Check both before you build.

    Returns
    -------
    dict of str to Led
        With the keys "red" and "ir".
    """
    most = "the most the paper states for this LED"
    return {
        "red": Led(
            name="red LED, 5 mm",
            part="OptoSupply OSR5CA5B61P",
            forward_v=2.1,
            forward_from="assumption: typical of the maker's red LEDs at 20 mA (OSRB0603C1C: 1.8 .. 2.6 V)",
            max_ma=max(paper.FIG_10_CURRENTS_MA),
            max_from=f"{most} (IV-C)",
            office_ma=10.7,
        ),
        "ir": Led(
            name="infrared LED, 940 nm, 5 mm",
            part="OptoSupply OSI5LA5A33A-B",
            forward_v=1.2,
            forward_from="assumption: typical of 940 nm emitters at 20 mA (OS25B10: up to 1.6 V)",
            max_ma=paper.FIG_11_CURRENT_MA,
            max_from=f"{most} (IV-D)",
            office_ma=paper.FIG_11_CURRENT_MA,
        ),
    }


@dataclass(frozen=True, kw_only=True)
class Driver:
    """The circuit of the LED.

    Parameters
    ----------
    led : Led
    current_ma : float
        Wanted current while the LED is on [mA].
    supply_v : float
        Supply of the LED [V].

    Raises
    ------
    ValueError
        If a value is impossible, the current exceeds the limit of the LED, or the supply is too low.

    Examples
    --------
    >>> driver = Driver(led=leds()["red"], current_ma=10.7)
    >>> round(driver.exact_ohm, 1), driver.resistor_ohm, round(driver.real_current_ma, 2)
    (261.7, 270.0, 10.37)
    """

    led: Led
    current_ma: float
    supply_v: float = USB_V

    def __post_init__(self) -> None:
        led = self.led
        if not 0 < self.current_ma < math.inf:
            raise ValueError(f"current_ma={self.current_ma:g} makes no light; choose more than 0 mA")
        if not self.current_ma <= led.max_ma:
            raise ValueError(
                f"current_ma={self.current_ma:g} is above {led.max_ma:g} mA, {led.max_from}; choose less, or read "
                f"the rated DC forward current in the data sheet of your LED and give it with --max-current-ma"
            )
        if not 0 < led.forward_v < math.inf:
            raise ValueError(f"led_forward_v={led.forward_v:g} is not an LED's; choose for example 2.1")
        if not led.forward_v + TRANSISTOR_V < self.supply_v < math.inf:
            raise ValueError(
                f"supply_v={self.supply_v:g} leaves nothing for the resistor: the LED takes {led.forward_v:g} V and "
                f"the transistor {TRANSISTOR_V} V; choose a supply above {led.forward_v + TRANSISTOR_V:g} V, say 5"
            )

    @property
    def across_resistor_v(self) -> float:
        """Voltage across the resistor while the LED is on [V]."""
        return self.supply_v - self.led.forward_v - TRANSISTOR_V

    @property
    def exact_ohm(self) -> float:
        """Resistance that gives exactly the wanted current [ohm]."""
        return self.across_resistor_v / (self.current_ma * 1e-3)

    @property
    def resistor_ohm(self) -> float:
        """The nearest E24 value [ohm], or the next one above it where the nearest would exceed the limit of the LED."""
        nearest = nearest_e24(self.exact_ohm)
        return nearest if self.current_with(nearest) <= self.led.max_ma else nearest_e24(nearest, above=True)

    def current_with(self, ohm: float) -> float:
        """Return the current that a resistor gives.

        Parameters
        ----------
        ohm : float
            Resistance [ohm].

        Returns
        -------
        float
            Current while the LED is on [mA].
        """
        return self.across_resistor_v / ohm * 1e3

    @property
    def real_current_ma(self) -> float:
        """Current that the E24 resistor gives [mA]."""
        return self.current_with(self.resistor_ohm)

    @property
    def resistor_mw(self) -> float:
        """Heat in the resistor while the LED is on [mW]; the average is at most half of it."""
        return self.across_resistor_v * self.real_current_ma

    @property
    def base_ohm(self) -> float:
        """The E24 resistor between the pin and the base of the transistor [ohm]."""
        most = (PIN_V - BASE_V) / (self.real_current_ma * 1e-3 / MIN_GAIN)
        return min(MAX_BASE_OHM, nearest_e24(most, below=True))


def nearest_e24(ohm: float, above: bool = False, below: bool = False) -> float:
    """Return the E24 value that is nearest to a resistance in ratio.

    Parameters
    ----------
    ohm : float
        Resistance, above 0 [ohm].
    above : bool
        Return the next value above `ohm` instead.
    below : bool
        Return the largest value that is not above `ohm` instead.

    Returns
    -------
    float
        [ohm]

    Examples
    --------
    >>> nearest_e24(261.7), nearest_e24(270, above=True), nearest_e24(269, below=True), nearest_e24(0.97)
    (270.0, 300.0, 240.0, 1.0)
    """
    decade = math.floor(math.log10(ohm))
    values = [float(f"{e}e{d - 1}") for d in (decade - 1, decade, decade + 1) for e in E24]
    if above:
        return next(value for value in values if value > ohm * (1 + 1e-9))
    if below:
        return [value for value in values if value <= ohm * (1 + 1e-9)][-1]
    return min(values, key=lambda value: abs(math.log(value / ohm)))


def parts_list(marker: Marker, driver: Driver, pin_name: str) -> str:
    """Return the list of parts of a marker as Markdown, with its circuit and the settings for the receiver.

    Parameters
    ----------
    marker : Marker
    driver : Driver
        The circuit of its LED.
    pin_name : str
        Name of the microcontroller's pin, as it is printed on the board.

    Returns
    -------
    str
    """
    led, board, packet = driver.led, marker.board, marker.packet_format
    table = "\n".join(f"| {count} | {what} | {whence} |" for count, what, whence in _rows(marker, driver))
    hot = "" if driver.resistor_mw <= 250 else " (more than 1/4 W: take a larger one)"
    return f"""# Parts of one Bicode marker

Blinked ID {marker.payload} (0x{marker.payload:X}), ArUco id {board.aruco_id} of {board.dictionary}, \
plate of {board.size_m * 1000:g} mm that glows in its {board.glow} cells.
Packet: {packet.start_bits} start + {packet.payload_bits} payload + {packet.checksum_bits} checksum bits \
({packet.checksum}) at {packet.f_id_hz:g} Hz = {packet.packet_us / 1000:g} ms, Manchester {packet.manchester}, \
{packet.bit_order} first.

| | part | from |
|---|---|---|
{table}

## The LED's resistor

    R = (supply - LED - transistor) / current = ({driver.supply_v:g} V - {led.forward_v:g} V - {TRANSISTOR_V} V) \
/ {driver.current_ma:.4g} mA = {driver.exact_ohm:.1f} ohm

Of the E24 series: **{ohms(driver.resistor_ohm)}**, which gives **{driver.real_current_ma:.2f} mA** \
and makes {driver.resistor_mw:.0f} mW of heat while on{hot}.

Check before you solder:

- LED voltage {led.forward_v:g} V: {led.forward_from}.
- LED limit {led.max_ma:g} mA: {led.max_from}.
- Transistor {TRANSISTOR_V} V: assumption, fully on at this current. A 2N3904 or BC547 has its own limit, too.
- The LED is {board.thickness_m * 1000:g} mm thick and up to 8.7 mm long: measure yours.

## Wiring

    {driver.supply_v:g} V --- {ohms(driver.resistor_ohm)} --- LED anode (long lead)
                        LED cathode --- collector
    {pin_name} --- {ohms(driver.base_ohm)} --- base
    GND ------------------ emitter; board and supply share GND

## The receiver must be told

In a shell: `bicode decode RECORDING --marker marker.toml`. In Python:

    ReceiverSettings(
        packet_format={packet!r},
        dictionary={board.dictionary!r}, glow={board.glow!r}, pattern_size_m={board.pattern_size_m:.6g},
    )
"""


def _rows(marker: Marker, driver: Driver) -> list[tuple[int, str, str]]:
    """Return the rows of the list: how many, which part, and where that is stated."""
    led, board = driver.led, marker.board
    size_mm, thick_mm = board.size_m * 1000, board.thickness_m * 1000
    paper_says, ours = "paper, III-A", "chosen here"
    rows = [
        (
            1,
            f"clear acrylic plate, {size_mm:g} x {size_mm:g} mm, {thick_mm:g} mm thick, engraved",
            paper_says,
        ),
        (1, "shading plate, black, and the cover of the LED: layer 4 of plate.svg", "paper names it, shape " + ours),
        (1, f"reflection tape round the plate's edges, {4 * size_mm:g} mm long", "paper names it, place " + ours),
        (1, f"{led.name}: {led.part}", paper_says),
        (1, "microcontroller: Seeed XIAO RP2040, with bicode_tx.py as main.py", paper_says),
        (1, "transistor: NPN, e.g. 2N3904 or BC547", '"transistor amplifier circuit"; type ' + ours),
        (1, f"LED resistor: {ohms(driver.resistor_ohm)}, 1/4 W", "computed below"),
        (1, f"base resistor: {ohms(driver.base_ohm)}, 1/4 W", ours),
        (1, f"supply: {driver.supply_v:g} V", "5 V: " + paper_says),
    ]
    if driver.led.name.startswith("infrared"):
        rows.append((1, "at the camera: FUJIFILM IR88 filter, lens at F2.0", "paper, III-A and III-B"))
    return rows


def ohms(ohm: float) -> str:
    """Return a resistance as it is written on a list.

    Parameters
    ----------
    ohm : float
        [ohm]

    Returns
    -------
    str

    Examples
    --------
    >>> ohms(270.0), ohms(4700.0), ohms(1e6), ohms(9.1)
    ('270 ohm', '4.7 kohm', '1 Mohm', '9.1 ohm')
    """
    for size, unit in ((1e6, "Mohm"), (1e3, "kohm")):
        if ohm >= size:
            return f"{ohm / size:g} {unit}"
    return f"{ohm:g} ohm"
