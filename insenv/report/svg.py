"""A matplotlib figure as an ``<svg>`` element that can stand inside an HTML page."""

from __future__ import annotations

import re
from html import escape
from io import StringIO

from matplotlib.figure import Figure

from insenv.report.drawing import style

#: Pixels per inch of what is drawn as pixels.
_DPI = 120


def inline(figure: Figure, prefix: str, description: str) -> str:
    """``figure`` as one ``<svg>`` element that fills the width it is given.

    Ids get ``prefix``, which must differ between the pictures of a page; ``description`` is read out by
    screen readers. Name spaces, metadata and comments are left out: HTML needs none, and a page that fetches
    nothing should hold no address.
    """
    buffer = StringIO()
    with style():
        figure.savefig(buffer, format="svg", dpi=_DPI, metadata={"Date": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :].rstrip()
    text = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r"""\s+xmlns(:\w+)?="[^"]*\"""", "", text)
    text = re.sub(r"""(\bid="|href="#|url\(#)""", rf"\g<1>{prefix}-", text)
    size = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', text)
    box = size.group(0) if size else ""
    return re.sub(r"<svg[^>]*>", f'<svg role="img" aria-label="{escape(description)}" {box}>', text, count=1)
