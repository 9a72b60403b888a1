"""The what-if page: sliders for one choice, with the pictures and numbers that follow from it.

It is the last figure of notebook 15, and all of the page that ``bicode what-if`` serves. When a slider is moved, the
remarks on the choice appear below the sliders they concern. If the choice is possible, a recording is simulated and
read, and the pictures and numbers follow. The link budget comes last, because it takes longest.
"""

from __future__ import annotations

import html
from collections.abc import Iterable
from dataclasses import fields
from functools import lru_cache
from importlib import resources
from typing import Any

import ipywidgets as widgets

from bicode_studies.link_budget.budget import LinkBudget, budget_of
from bicode_studies.what_if.ask import WhatIfResult, ask
from bicode_studies.what_if.choice import Choice, Remark, list_remarks
from bicode_studies.what_if.packet_view import PacketView, view_packet
from bicode_studies.what_if.page_pictures import frame_picture, packet_picture

Options = list[tuple[str, float]]


def _with_unit(values: Iterable[float], unit: str, scale: float = 1.0) -> Options:
    """Return the options of a slider: each value times `scale`, labelled with the value and its unit."""
    return [(f"{value:g} {unit}", round(value * scale, 9)) for value in values]


SLIDERS: dict[str, dict[str, tuple[str, Options]]] = {
    "Marker": {
        "f_id_hz": (
            "bit rate f_ID",
            _with_unit((250, 300, 350, 400, 450, 500, 600, 700, 850, 1000, 1250, 1500, 2000, 2500, 3000, 4000, 5000,
                        7000, 10_000), "Hz"),
        ),
        "payload_bits": ("payload", _with_unit(range(4, 17), "bit")),
        "start_bits": ("start", _with_unit(range(2, 9), "bit")),
        "size_m": ("size", _with_unit((2.5, 5, 7.5, 10), "cm", 0.01)),
        "current_ma": ("LED current", _with_unit((1, 2.7, 5.5, 7.5, 10.7, 15, 21.3, 30, 40.9), "mA")),
    },
    "Scene": {
        "distance_m": (
            "distance",
            _with_unit((0.5, 1, 1.5, 2, 2.5, 3.5, 5, 7.5, 10, 12.5, 15, 17.5, 20, 22.5, 25, 27.5, 30, 35, 40, 50), "m"),
        ),
        "illuminance_lux": (
            "illuminance",
            _with_unit((50, 100, 200, 350, 500, 1000, 2000, 5000, 10_000, 50_000), "lx"),
        ),
    },
    "Receiver": {
        "delta_t_id_us": (
            "delta_t_ID",
            _with_unit((25, 50, 75, 100, 125, 150, 200, 250, 300, 350, 400, 450, 500, 600, 750, 1000), "us"),
        ),
        "delta_t_blinker_us": ("delta_t_blinker", _with_unit((0.25, 0.5, 1, 1.5, 2, 3, 4, 6, 8, 16), "ms", 1000)),
        "delta_t_2d_us": ("delta_t_2D", _with_unit((0.5, 1, 2, 4, 8, 13.2, 20, 33, 50), "ms", 1000)),
        "delta_t_whole_us": (
            "delta_t_whole",
            _with_unit((5, 10, 14, 17, 20, 25, 28, 30, 33, 40, 50, 66, 100), "ms", 1000),
        ),
    },
}  # fmt: skip
TITLE = (
    "<h2>What if? One Bicode marker, simulated and read</h2><p>Move a slider: the camera's events are simulated, and "
    "the paper's receiver reads them. The red line is the light that was sent; black and grey count ON and OFF "
    "events.</p>"
)
REASONS = {
    "no_events": "there are no events in the region",
    "no_start": "no start of a packet is found",
    "cut": "the period ends inside the packet",
    "manchester": "some bits have no transition, because edges are missed or merge with each other",
    "checksum": "the checksum is wrong",
    "conflict": "two packets of the period give different IDs",
    "no region found": "no blinking region is found",
}
CHECKSUMS = {"sum": "number of ones, modulo 8", "crc3": "remainder of a division by x^3 + x + 1"}


class WhatIfPage:
    """Sliders, pictures and numbers of one choice.

    Parameters
    ----------
    choice : Choice, optional
        The first choice; each slider starts at the option nearest to its value. None takes the paper's choice.
    seed : int
        Seed of the first recording.

    Attributes
    ----------
    widget : ipywidgets.Widget
        The whole page.
    """

    def __init__(self, choice: Choice | None = None, seed: int = 0) -> None:
        self.seed = seed
        first = choice or Choice()
        self.sliders: dict[str, widgets.SelectionSlider] = {}
        self.words = {field.name: widgets.HTML() for field in fields(Choice)}
        self.checksum = widgets.ToggleButtons(
            options=list(CHECKSUMS), value=first.checksum, tooltips=list(CHECKSUMS.values())
        )
        self.verdict = widgets.HTML()
        self.packet, self.frame = widgets.Image(format="png"), widgets.Image(format="png")
        self.budget = widgets.HTML()
        self.reset = widgets.Button(description="the paper's choice", icon="undo")
        self.again = widgets.Button(description="another recording", icon="refresh")
        self.reset.on_click(lambda _: self._show(Choice()))
        self.again.on_click(lambda _: self._record_again())
        self.widget = self._lay_out(first)
        for control in (*self.sliders.values(), self.checksum):
            control.observe(lambda _: self._update(), names="value")
        self._is_quiet = False
        self._update()

    @property
    def choice(self) -> Choice:
        """The choice that the sliders show."""
        values: dict[str, Any] = {name: slider.value for name, slider in self.sliders.items()}
        whole = {name: int(value) for name, value in values.items() if name.endswith(("_us", "_bits"))}
        return Choice(**{**values, **whole}, checksum=self.checksum.value)

    def _lay_out(self, first: Choice) -> widgets.Widget:
        """Make the sliders and put all parts in their places on the page."""
        groups: list[widgets.Widget] = []
        for title, sliders in SLIDERS.items():
            groups.append(widgets.HTML(f"<h3>{title}</h3>"))
            for name, (label, options) in sliders.items():
                nearest = _nearest([value for _, value in options], getattr(first, name))
                slider = widgets.SelectionSlider(
                    options=options, value=nearest, description=label, continuous_update=False
                )
                slider.add_class(f"bicode-{name.replace('_', '-')}")
                self.sliders[name] = slider
                groups += [slider, self._place_of_words(name)]
            if title == "Marker":
                groups += [widgets.HBox([widgets.Label("checksum"), self.checksum]), self._place_of_words("checksum")]
        buttons = widgets.HBox([self.reset, self.again])
        parts = {
            "title": widgets.HTML(TITLE),
            "verdict": self.verdict,
            "controls": widgets.VBox([buttons, *groups]),
            "packet": self.packet,
            "frame": self.frame,
            "budget": self.budget,
        }
        for name, part in parts.items():
            part.add_class(f"bicode-{name}")
        page = widgets.Box([widgets.HTML(f"<style>\n{_read_style()}</style>"), *parts.values()])
        page.add_class("bicode-page")
        return page

    def _place_of_words(self, name: str) -> widgets.HTML:
        """Return the widget that shows the remarks on one setting."""
        self.words[name].add_class("bicode-words")
        return self.words[name]

    def _show(self, choice: Choice) -> None:
        """Move all sliders at once."""
        self._is_quiet = True
        for name, slider in self.sliders.items():
            slider.value = getattr(choice, name)
        self.checksum.value = choice.checksum
        self._is_quiet = False
        self._update()

    def _record_again(self) -> None:
        """Record the same choice with another seed."""
        self.seed += 1
        self._update()

    def _update(self) -> None:
        """Bring remarks, pictures and numbers up to date with the sliders."""
        if self._is_quiet:
            return
        choice = self.choice
        remarks = list_remarks(choice)
        for name, place in self.words.items():
            place.value = "".join(_remark(remark) for remark in remarks if remark.setting == name)
        obstacles = [remark for remark in remarks if remark.impossible]
        for picture in (self.packet, self.frame, self.budget):
            picture.add_class("bicode-stale")
        if obstacles:
            self.verdict.value = _refusal(obstacles)
            return
        result = ask(choice, self.seed, detect_2d=True)
        packet_view = view_packet(result)
        self.verdict.value = _verdict(result, packet_view)
        self.packet.value = packet_picture(packet_view, choice)
        self.frame.value = frame_picture(packet_view, choice)
        for picture in (self.packet, self.frame):
            picture.remove_class("bicode-stale")
        self.budget.value = _table(budget(choice))
        self.budget.remove_class("bicode-stale")


def _nearest(values: list[float], wanted: float) -> float:
    """Return the value nearest to the wanted one."""
    return min(values, key=lambda value: abs(value - wanted))


def what_if_page(choice: Choice | None = None, seed: int = 0) -> widgets.Widget:
    """Make the what-if page: sliders, pictures and numbers.

    Parameters
    ----------
    choice : Choice, optional
        The first choice; None takes the paper's.
    seed : int
        Seed of the first recording.

    Returns
    -------
    ipywidgets.Widget
    """
    return WhatIfPage(choice, seed).widget


@lru_cache(maxsize=64)
def budget(choice: Choice) -> LinkBudget:
    """Compute the link budget of a choice; the last 64 choices are remembered.

    Parameters
    ----------
    choice : Choice

    Returns
    -------
    LinkBudget
    """
    return budget_of(choice.scene(0), choice.receiver())


def _read_style() -> str:
    """Return the style sheet of the page."""
    return (resources.files("bicode_studies.what_if") / "page.css").read_text(encoding="utf-8")


def _remark(remark: Remark) -> str:
    """Format a remark as a paragraph."""
    kind = "impossible" if remark.impossible else "note"
    return f'<p class="{kind}">{html.escape(remark.words)}</p>'


def _refusal(obstacles: list[Remark]) -> str:
    """Format what makes a choice impossible; it is shown in place of the numbers."""
    labels = {name: label for group in SLIDERS.values() for name, (label, _) in group.items()}
    paragraphs = "".join(f"<p><b>{labels.get(r.setting, r.setting)}</b>: {html.escape(r.words)}</p>" for r in obstacles)
    return f'<div class="refusal"><h2>This choice is impossible</h2>{paragraphs}</div>'


def _verdict(result: WhatIfResult, packet_view: PacketView) -> str:
    """Format how well the marker is read, as four numbers and a sentence."""
    share, low, high = result.accuracy
    f = result.choice.packet_format
    sent, packet = result.scene.markers[0].marker.payload, packet_view.packet
    cards = (
        (
            "ID right",
            f"{share:.0%}",
            f"{result.right} of {result.periods} periods (95 % interval: {low:.0%} to {high:.0%})",
        ),
        ("goodput", f"{result.goodput_bps:.0f} bit/s", f"of {f.payload_rate_bps:.0f} bit/s sent"),
        (
            "pattern right",
            f"{(result.right_2d or 0) / result.periods:.0%}",
            f"its side is {result.choice.side_px:.1f} px",
        ),
        ("packet", f"{f.packet_us / 1000:.3g} ms", f"{f.packet_bits} bits, {2**f.payload_bits} IDs"),
    )
    card = "<div><small>{}</small><b>{}</b><small>{}</small></div>"
    boxes = "".join(card.format(*texts) for texts in cards)
    if packet is not None and packet.payload is not None and packet.checksum_ok:
        comparison = "as sent" if packet.payload == sent else f"but {sent} was sent"
        sentence = f"The receiver reads {packet.payload:0{f.payload_bits}b}: ID {packet.payload}, {comparison}."
    else:
        reasons = result.reasons or {packet_view.reason or "no region found": 0}
        commonest = max(reasons, key=lambda reason: reasons[reason])
        sentence = f"The receiver reads no ID: {REASONS[commonest]}."
    return f'<div class="cards">{boxes}</div><p class="said">{sentence}</p>'


def _table(b: LinkBudget) -> str:
    """Format the link budget as a table."""
    rows = (
        ("side of the marker", f"{b.side_px:.1f} px"),
        ("contrast (log of lit over dark signal)", f"{b.contrast:.2f}"),
        ("events per ON edge, per OFF edge", f"{b.events_on:.3g}, {b.events_off:.3g}"),
        ("probability that an ON edge, an OFF edge is detected", f"{b.edge_on:.1%}, {b.edge_off:.1%}"),
        ("probability that a whole packet is read", f"{b.packet:.1%}"),
        ("expected share of periods with the right ID", f"{b.accuracy:.1%}"),
    )
    cells = "".join(f"<tr><td>{name}</td><td>{value}</td></tr>" for name, value in rows)
    note = "These numbers are computed: they are what to expect on average over many recordings."
    return f"<h3>Link budget</h3><table>{cells}</table><p>{note}</p>"
