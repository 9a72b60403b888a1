"""What if, with sliders: the last figure of notebook 15, and all of the page that ``bicode what-if`` serves.

One `Choice` is held by the sliders. When one is moved, `remarks` go below the sliders they are
about; if the choice is possible, a recording is made and read, and the pictures and numbers
follow. The link budget comes last, because it takes longest.
"""

from __future__ import annotations

import html
from collections.abc import Iterable
from dataclasses import fields
from functools import lru_cache
from typing import Any

import ipywidgets as widgets

from bicode_studies.link_budget.budget import LinkBudget, budget_of
from bicode_studies.what_if.ask import Answer, ask
from bicode_studies.what_if.choice import Choice, Remark, remarks
from bicode_studies.what_if.packet_view import View, view
from bicode_studies.what_if.page_pictures import frame_picture, packet_picture
from bicode_studies.what_if.page_style import STYLE

Options = list[tuple[str, float]]


def _with_unit(values: Iterable[float], unit: str, scale: float = 1.0) -> Options:
    """Numbers and what to write behind them in, a slider's options out."""
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
        "illuminance_lux": ("light", _with_unit((50, 100, 200, 350, 500, 1000, 2000, 5000, 10_000, 50_000), "lx")),
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
    "<h2>What if? One Bicode marker, simulated and read</h2><p>Move a slider: events are made, and read by the paper's "
    "receiver. Red is the light that was sent, black and grey are the pixels that say on and off.</p>"
)
REASONS = {
    "no_events": "nothing switches in the region",
    "no_start": "no quiet start is found",
    "cut": "the period ends inside the packet",
    "manchester": "bits without their switch: edges are lost, or melt into each other",
    "checksum": "the checksum does not hold",
    "conflict": "two readings differ",
    "no region found": "nothing blinks clearly enough to be found",
}


class WhatIfPage:
    """Sliders, pictures and numbers of one choice.

    Parameters
    ----------
    choice : Choice, optional
        Where the sliders stand at first; a number between two marks goes to the nearer. None takes the paper's.
    seed : int

    Attributes
    ----------
    widget : ipywidgets.Widget
        All of it.
    """

    def __init__(self, choice: Choice | None = None, seed: int = 0) -> None:
        self.seed = seed
        first = choice or Choice()
        self.sliders: dict[str, widgets.SelectionSlider] = {}
        self.words = {field.name: widgets.HTML() for field in fields(Choice)}
        self.checksum = widgets.ToggleButtons(options=["sum", "crc3"], value=first.checksum, tooltips=_CHECKSUMS)
        self.verdict = widgets.HTML()
        self.packet, self.frame = widgets.Image(format="png"), widgets.Image(format="png")
        self.budget = widgets.HTML()
        self.reset = widgets.Button(description="the paper's choice", icon="undo")
        self.again = widgets.Button(description="another recording", icon="refresh")
        self.reset.on_click(lambda _: self._show(Choice()))
        self.again.on_click(lambda _: self._another())
        self.widget = self._laid_out(first)
        for control in (*self.sliders.values(), self.checksum):
            control.observe(lambda _: self._update(), names="value")
        self._is_quiet = False
        self._update()

    @property
    def choice(self) -> Choice:
        """What the sliders say."""
        values: dict[str, Any] = {name: slider.value for name, slider in self.sliders.items()}
        whole = {name: int(value) for name, value in values.items() if name.endswith(("_us", "_bits"))}
        return Choice(**{**values, **whole}, checksum=self.checksum.value)

    def _laid_out(self, first: Choice) -> widgets.Widget:
        """Make the sliders and put everything in its place."""
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
                groups += [slider, self._words_of(name)]
            if title == "Marker":
                groups += [widgets.HBox([widgets.Label("checksum"), self.checksum]), self._words_of("checksum")]
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
        page = widgets.Box([widgets.HTML(STYLE), *parts.values()])
        page.add_class("bicode-page")
        return page

    def _words_of(self, name: str) -> widgets.HTML:
        """Where remarks about one setting go."""
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

    def _another(self) -> None:
        """The same choice with other chance."""
        self.seed += 1
        self._update()

    def _update(self) -> None:
        """What the sliders say in, words, pictures and numbers out."""
        if self._is_quiet:
            return
        choice = self.choice
        told = remarks(choice)
        for name, place in self.words.items():
            place.value = "".join(_remark(remark) for remark in told if remark.setting == name)
        wrong = [remark for remark in told if remark.impossible]
        for picture in (self.packet, self.frame, self.budget):
            picture.add_class("bicode-stale")
        if wrong:
            self.verdict.value = _refusal(wrong)
            return
        answer = ask(choice, self.seed, detect_2d=True)
        seen = view(answer)
        self.verdict.value = _verdict(answer, seen)
        self.packet.value = packet_picture(seen, choice)
        self.frame.value = frame_picture(seen, choice)
        for picture in (self.packet, self.frame):
            picture.remove_class("bicode-stale")
        self.budget.value = _table(choice, budget(choice))
        self.budget.remove_class("bicode-stale")


def _nearest(values: list[float], wanted: float) -> float:
    """Numbers and a wish in, the number nearest to it out."""
    return min(values, key=lambda value: abs(value - wanted))


_CHECKSUMS = ["number of ones, modulo 8", "remainder by x^3 + x + 1"]


def what_if_page(choice: Choice | None = None, seed: int = 0) -> widgets.Widget:
    """A first choice in, a widget with sliders, pictures and numbers out."""
    return WhatIfPage(choice, seed).widget


@lru_cache(maxsize=64)
def budget(choice: Choice) -> LinkBudget:
    """A choice in, its link budget out."""
    return budget_of(choice.scene(0), choice.receiver())


def _remark(remark: Remark) -> str:
    """A remark as a paragraph."""
    kind = "impossible" if remark.impossible else "mind"
    return f'<p class="{kind}">{html.escape(remark.words)}</p>'


def _refusal(wrong: list[Remark]) -> str:
    """The impossible in words, in place of the numbers."""
    labels = {name: label for group in SLIDERS.values() for name, (label, _) in group.items()}
    said = "".join(f"<p><b>{labels.get(r.setting, r.setting)}</b>: {html.escape(r.words)}</p>" for r in wrong)
    return f'<div class="refusal"><h2>This choice is impossible</h2>{said}</div>'


def _verdict(answer: Answer, seen: View) -> str:
    """How well it is read, as four numbers and a sentence."""
    share, low, high = answer.accuracy
    f = answer.choice.packet_format
    sent = answer.scene.markers[0].marker.payload
    cards = (
        ("ID right", f"{share:.0%}", f"{answer.right} of {answer.periods} periods; {low:.0%} to {high:.0%}"),
        ("goodput", f"{answer.goodput_bps:.0f} bit/s", f"of {f.payload_rate_bps:.0f} bit/s sent"),
        ("pattern", f"{(answer.right_2d or 0) / answer.periods:.0%}", f"{answer.choice.side_px:.1f} px a side"),
        ("packet", f"{f.packet_us / 1000:.3g} ms", f"{f.packet_bits} bits, {2**f.payload_bits} IDs"),
    )
    card = "<div><small>{}</small><b>{}</b><small>{}</small></div>"
    boxes = "".join(card.format(*texts) for texts in cards)
    if seen.packet is not None and seen.packet.payload is not None and seen.packet.checksum_ok:
        right = "as sent" if seen.packet.payload == sent else f"but {sent} was sent"
        said = f"reads {seen.packet.payload:0{f.payload_bits}b}, ID {seen.packet.payload}, {right}"
    else:
        reasons = answer.reasons or {seen.reason or "no region found": 0}
        worst = max(reasons, key=lambda reason: reasons[reason])
        said = f"reads no ID: {REASONS[worst]}"
    return f'<div class="cards">{boxes}</div><p class="said">{said}</p>'


def _table(choice: Choice, b: LinkBudget) -> str:
    """The link budget as a table."""
    rows = (
        ("marker's side", f"{b.side_px:.1f} px"),
        ("contrast (log of lit over dark)", f"{b.contrast:.2f}"),
        ("events an ON, an OFF edge", f"{b.events_on:.3g}, {b.events_off:.3g}"),
        ("chance that an ON, an OFF edge is seen", f"{b.edge_on:.1%}, {b.edge_off:.1%}"),
        ("chance that a whole packet is read", f"{b.packet:.1%}"),
        ("expected share of periods with the ID", f"{b.accuracy:.1%}"),
    )
    cells = "".join(f"<tr><td>{name}</td><td>{value}</td></tr>" for name, value in rows)
    return f"<h3>Link budget</h3><table>{cells}</table><p>Computed, not counted: what to expect of many recordings.</p>"
