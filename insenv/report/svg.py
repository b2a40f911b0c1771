"""A matplotlib figure as an ``<svg>`` element that can stand inside an HTML page and follows its stylesheet."""

from __future__ import annotations

import re
from html import escape
from io import StringIO
from typing import Any

from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from insenv.report.drawing import PALETTE, style

#: Points in an inch, which are the dots of a vector picture.
POINTS = 72
#: Decimals of a coordinate [pt].
_DECIMALS = 1
_POINT = re.compile(r"([ML])(-?[\d.]+) (-?[\d.]+)(h0)?")
_POINTS = re.compile(f"(?:{_POINT.pattern}){{3,}}")
#: What need not be said, because it is so anyway, or as the page has it.
_USUAL = {
    "stroke-dashoffset": "0", "stroke-linecap": "butt", "stroke-linejoin": "round", "stroke-opacity": "1",
    "text-anchor": "start",
}  # fmt: skip
_LEFT_OUT = ("font-family", "image-rendering")
#: What matplotlib states once for all elements of a picture.
_WHOLE = 'stroke-linejoin="round" stroke-linecap="butt"'


def inline(figure: Figure, prefix: str, description: str) -> str:
    """``figure`` as one ``<svg>`` element that fills the width it is given.

    Ids get ``prefix``, which must differ between the pictures of a page; ``description`` is read out by
    screen readers. Name spaces, metadata and comments are left out: HTML needs none, and a page that fetches
    nothing should hold no address. Styles become attributes, which no Content-Security-Policy forbids, colours of
    the palette variables of the stylesheet, so that the picture is dark where the page is, and text stays text.
    """
    buffer, dpi = StringIO(), figure.dpi
    with style():
        _lay_out(figure)
        figure.savefig(buffer, format="svg", metadata={"Date": None}, facecolor="none", dpi=dpi)
    text = buffer.getvalue()
    text = text[text.index("<svg") :].rstrip()
    text = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->|<style.*?</style>", "", text, flags=re.DOTALL)
    text = re.sub(r"""\s+xmlns(:\w+)?="[^"]*\"""", "", text)
    text = re.sub(r"""(\bid="|href="#|url\(#)""", rf"\g<1>{prefix}-", text.replace("xlink:href", "href"))
    text = re.sub(r'\s*style="([^"]*)"', _attributes, text)
    text = _joined(_rounded(text))
    size = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', text)
    box = size.group(0) if size else ""
    return re.sub(r"<svg[^>]*>", f'<svg role="img" aria-label="{escape(description)}" {_WHOLE} {box}>', text, count=1)


def _lay_out(figure: Figure) -> None:
    """Give everything its place, as saving does, which draws all of it once more for that.

    Small ticks bear no letters and so take no room: without them, which are most ticks, it takes half the time.
    """
    engine = figure.get_layout_engine()
    if engine is not None:
        FigureCanvasSVG(figure)
        figure.set_dpi(POINTS)
        # Axes that share a scale share what places their ticks.
        small: dict[int, Any] = {id(axis.minor): axis.minor for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)}
        placed = [minor.locator for minor in small.values()]
        for minor in small.values():
            minor.locator = NullLocator()
        engine.execute(figure)
        for minor, locator in zip(small.values(), placed, strict=True):
            minor.locator = locator
        figure.set_layout_engine(None)


def _attributes(found: re.Match[str]) -> str:
    """Attributes for a style; the last of those that say the same holds, as in a style."""
    pairs = (part.partition(":") for part in found[1].split(";") if part.strip())
    said = {name.strip(): _themed(value.strip()) for name, _, value in pairs}
    told = (f' {n}="{v}"' for n, v in said.items() if _USUAL.get(n) != v and n not in _LEFT_OUT)
    return "".join(told)


def _themed(value: str) -> str:
    return next((f"var(--{name})" for name, colour in PALETTE.items() if colour == value), value)


def _rounded(text: str) -> str:
    """The same with few decimals, and strokes without length as such."""

    def few(number: re.Match[str]) -> str:
        return f"{float(number[0]):.{_DECIMALS}f}".removesuffix(".0").replace("-0", "0", number[0] == "-0.0")

    def path(found: re.Match[str]) -> str:
        data = re.sub(r"-?\d+\.\d+", few, found[1])
        data = re.sub(r"M (\S+ \S+)\s+L \1(?=\s|$)", r"M\1h0", data)
        data = re.sub(r"\s*([A-Za-z])\s*", r"\1", data)
        return f'd="{_relative(" ".join(data.split()))}"'

    text = re.sub(r'\bd="([^"]*)"', path, text)
    text = re.sub(r'\b(x|y|font-size|stroke-width)="(-?\d+\.\d\d)\d*"', r'\1="\2"', text)
    return re.sub(r' transform="rotate\(-0 [^"]*\)"', "", text)


def _relative(data: str) -> str:
    """A path of moves and lines with each point as the way from the one before, which takes fewer digits."""
    if not _POINTS.fullmatch(data):
        return data
    scale, at, parts = 10**_DECIMALS, (0, 0), []
    for i, (command, x, y, dot) in enumerate(_POINT.findall(data)):
        to = round(float(x) * scale), round(float(y) * scale)
        away = to if i == 0 else (to[0] - at[0], to[1] - at[1])
        across, down = (f"{one / scale:g}".replace("0.", ".", abs(one) < scale) for one in away)
        between = "" if down.startswith("-") else " "
        parts.append(f"{command if i == 0 else command.lower()}{across}{between}{down}{dot}")
        at = to
    return "".join(parts)


def _joined(text: str) -> str:
    """The same without groups of one, and what is alike said once of all that stand beside each other."""
    text = re.sub(r'<g id="[^"]*"', "<g", re.sub(r">\s+<", "><", text))
    for _ in range(3):
        text = re.sub(r"<g>(<(?:path|use)[^>]*/>|<text[^>]*>[^<]*</text>|)</g>", r"\1", text)
    once = r'<use href="([^"]*)" x="([^"]*)" y="([^"]*)"([^>]*)/>'

    def marks(found: re.Match[str]) -> str:
        each = re.findall(once, found[0])
        inner = "".join(f'<use href="{h}" x="{x}" y="{y}"/>' for h, x, y, _ in each)
        return f"<g{each[0][3]}>{inner}</g>"

    text = re.sub(rf'{once}(?:<use href="\1" x="[^"]*" y="[^"]*"\4/>)+', marks, text)
    # Strokes that are alike: bars of errors, lines of a grid.
    alike = r'<path d="([^"]*)"((?: clip-path="[^"]*")? fill="none"(?! opacity)[^>]*)/>'
    return re.sub(rf'{alike}(?:<path d="[^"]*"\2/>)+', _strokes, text)


def _strokes(found: re.Match[str]) -> str:
    data = "".join(re.findall(r' d="([^"]*)"', found[0]))
    rest = re.match(r'<path d="[^"]*"([^>]*)/>', found[0])
    assert rest is not None
    return f'<path d="{data}"{rest[1]}/>'
