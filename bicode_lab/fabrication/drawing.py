"""Drawings in millimetres, written as SVG and PDF.

Both formats hold vectors at true size in the same named layers: Inkscape's layers in the SVG, optional content in the
PDF. The files do not depend on the date or the machine.
"""

from __future__ import annotations

import html
from dataclasses import dataclass

Point = tuple[float, float]

POINTS_PER_MM = 72 / 25.4
BASELINE_TO_MIDDLE = 0.36  # of the font's size: half a capital's height
# Widths of Helvetica's characters, of the font's size, where they are not near 0.556.
NARROW, WIDE = dict.fromkeys(" .,:;/!ijl|I'ft()[]-r", 0.29), dict.fromkeys("mwMW%@", 0.86)


@dataclass(frozen=True, kw_only=True)
class Polyline:
    """Straight lines through points [mm], x to the right, y down.

    Parameters
    ----------
    loops : tuple of tuples of (x, y)
        One or more lists of points; a filled polyline is filled by the even-odd rule.
    closed : bool
        Whether each list returns to its first point.
    """

    loops: tuple[tuple[Point, ...], ...]
    closed: bool = True


@dataclass(frozen=True, kw_only=True)
class Text:
    """One line of text.

    Parameters
    ----------
    at : tuple of (x, y)
        Left end of the line, or its middle where it is centred, on the baseline [mm].
    words : str
    size_mm : float
        Font size [mm].
    centred : bool
    upright : bool
        True for text that runs from the bottom to the top.
    """

    at: Point
    words: str
    size_mm: float = 3.0
    centred: bool = False
    upright: bool = False

    @property
    def width_mm(self) -> float:
        """Approximate length of the line [mm]."""
        return self.size_mm * sum(NARROW.get(c, WIDE.get(c, 0.556)) for c in self.words)


@dataclass(frozen=True, kw_only=True)
class Layer:
    """A group of shapes that one step of the work needs, all filled or all drawn as lines, in one colour.

    Parameters
    ----------
    name : str
    colour : str
        "#rrggbb".
    filled : bool
        True where shapes are filled, False where they are lines.
    line_mm : float
        Width of lines [mm].
    paths : tuple of Polyline
    texts : tuple of Text
    """

    name: str
    colour: str
    filled: bool = False
    line_mm: float = 0.1
    paths: tuple[Polyline, ...] = ()
    texts: tuple[Text, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """A sheet and its layers.

    Parameters
    ----------
    title : str
    width_mm, height_mm : float
        Size of the sheet [mm].
    layers : tuple of Layer
        The first one is at the bottom.
    """

    title: str
    width_mm: float
    height_mm: float
    layers: tuple[Layer, ...]


def to_svg(drawing: Drawing) -> str:
    """Write a drawing as SVG, with one group per layer.

    Parameters
    ----------
    drawing : Drawing

    Returns
    -------
    str
        Text of the file; its unit is the millimetre.

    Examples
    --------
    >>> square = Polyline(loops=(((1, 1), (3, 1), (3, 3), (1, 3)),))
    >>> cut = Layer(name="cut", colour="#ff0000", paths=(square,))
    >>> print(to_svg(Drawing(title="a square", width_mm=4, height_mm=4, layers=(cut,))))
    <?xml version="1.0" encoding="UTF-8"?>
    <svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"
         width="4mm" height="4mm" viewBox="0 0 4 4">
    <title>a square</title>
    <g id="layer1" inkscape:groupmode="layer" inkscape:label="cut" fill="none" stroke="#ff0000" stroke-width="0.1">
    <path d="M1 1 L3 1 L3 3 L1 3 Z"/>
    </g>
    </svg>
    """
    width, height = number(drawing.width_mm), number(drawing.height_mm)
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"',
        f'     width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}">',
        f"<title>{html.escape(drawing.title)}</title>",
    ]
    for count, layer in enumerate(drawing.layers, 1):
        paint = (
            f'fill="{layer.colour}" fill-rule="evenodd" stroke="none"'
            if layer.filled
            else f'fill="none" stroke="{layer.colour}" stroke-width="{number(layer.line_mm)}"'
        )
        label = html.escape(layer.name)
        lines.append(f'<g id="layer{count}" inkscape:groupmode="layer" inkscape:label="{label}" {paint}>')
        for path in layer.paths:
            loops = (" L".join(f"{number(x)} {number(y)}" for x, y in loop) for loop in path.loops)
            end = " Z" if path.closed else ""
            lines.append('<path d="' + " ".join(f"M{loop}{end}" for loop in loops) + '"/>')
        lines += [_svg_text(text, layer.colour) for text in layer.texts]
        lines.append("</g>")
    return "\n".join([*lines, "</svg>"])


def _svg_text(text: Text, colour: str) -> str:
    """Return the SVG element of a line of text."""
    x, y = number(text.at[0]), number(text.at[1])
    turn = f' transform="rotate(-90 {x} {y})"' if text.upright else ""
    anchor = ' text-anchor="middle"' if text.centred else ""
    font = f'font-family="Helvetica, Arial, sans-serif" font-size="{number(text.size_mm)}"'
    words = html.escape(text.words)
    return f'<text x="{x}" y="{y}" {font} fill="{colour}" stroke="none"{anchor}{turn}>{words}</text>'


def to_pdf(drawing: Drawing) -> bytes:
    """Write a drawing as a PDF of one page at true size; a viewer can show and hide each layer by its name.

    Parameters
    ----------
    drawing : Drawing

    Returns
    -------
    bytes
        Contents of the file.
    """
    scale = number(POINTS_PER_MM, 8)
    content = [f"{scale} 0 0 -{scale} 0 {number(drawing.height_mm * POINTS_PER_MM)} cm"]
    for count, layer in enumerate(drawing.layers):
        content += [f"/OC /L{count} BDC", *_pdf_layer(layer), "EMC"]
    stream = "\n".join(content)
    first = 6  # number of the first layer's object
    ids = [f"{first + count} 0 R" for count in range(len(drawing.layers))]
    named = " ".join(f"/L{count} {each}" for count, each in enumerate(ids))
    size = f"{number(drawing.width_mm * POINTS_PER_MM)} {number(drawing.height_mm * POINTS_PER_MM)}"
    listed = " ".join(ids)
    objects = [
        f"<< /Type /Catalog /Pages 2 0 R /OCProperties << /OCGs [{listed}] /D << /Order [{listed}] /ON [{listed}] >> >>"
        " /ViewerPreferences << /PrintScaling /None /DisplayDocTitle true >> >>",
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {size}] /Contents 4 0 R "
        f"/Resources << /Font << /F1 5 0 R >> /Properties << {named} >> >> >>",
        f"<< /Length {len(stream)} >>\nstream\n{stream}\nendstream",
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
        *(f"<< /Type /OCG /Name {_pdf_string(layer.name)} >>" for layer in drawing.layers),
        f"<< /Title {_pdf_string(drawing.title)} >>",
    ]
    out, places = "%PDF-1.5\n", []
    for count, each in enumerate(objects, 1):
        places.append(len(out))
        out += f"{count} 0 obj\n{each}\nendobj\n"
    table = "".join(f"{place:010d} 00000 n \n" for place in places)
    count = len(objects) + 1
    head = f"xref\n0 {count}\n0000000000 65535 f \n"
    tail = f"trailer\n<< /Size {count} /Root 1 0 R /Info {count - 1} 0 R >>\nstartxref\n{len(out)}\n%%EOF\n"
    return f"{out}{head}{table}{tail}".encode("latin-1")


def _pdf_layer(layer: Layer) -> list[str]:
    """Return the PDF operators that draw a layer."""
    rgb = " ".join(number(int(layer.colour[i : i + 2], 16) / 255) for i in (1, 3, 5))
    words = [f"{rgb} rg {rgb} RG {number(layer.line_mm)} w"]
    for path in layer.paths:
        for loop in path.loops:
            points = [f"{number(x)} {number(y)}" for x, y in loop]
            words.append(f"{points[0]} m " + " ".join(f"{p} l" for p in points[1:]) + " h" * path.closed)
        words.append("f*" if layer.filled else "S")
    for text in layer.texts:
        back = text.width_mm / 2 if text.centred else 0.0
        x, y = (text.at[0], text.at[1] + back) if text.upright else (text.at[0] - back, text.at[1])
        turn = "0 -1 -1 0" if text.upright else "1 0 0 -1"
        size = number(text.size_mm)
        words.append(f"BT /F1 {size} Tf {turn} {number(x)} {number(y)} Tm {_pdf_string(text.words)} Tj ET")
    return words


def _pdf_string(words: str) -> str:
    """Return a text as a PDF string."""
    for sign in "\\()":
        words = words.replace(sign, "\\" + sign)
    return f"({words})"


def number(value: float, digits: int = 4) -> str:
    """Return the shortest text of a number with up to `digits` decimals.

    Parameters
    ----------
    value : float
    digits : int

    Returns
    -------
    str

    Examples
    --------
    >>> number(5.0), number(25 / 3), number(-0.00001)
    ('5', '8.3333', '0')
    """
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
