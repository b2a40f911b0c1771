"""Sphinx settings. The site is built offline and loads nothing from other hosts."""

import sys
from html import escape
from pathlib import Path
from typing import Any

from docutils.nodes import SkipNode
from latex2mathml.converter import convert

project = "insenv"
author = "insenv contributors"
copyright = "insenv contributors"

sys.path.insert(0, str(Path(__file__).parent))

extensions = ["myst_parser", "fromcode"]
myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3
root_doc = "contents"  # the table of contents of the site; index.md is a page for people
exclude_patterns = ["_build"]

html_theme = "furo"
html_title = "insenv"
html_static_path = ["static"]
html_css_files = ["gallery.css"]
html_show_sourcelink = False
html_math_renderer = "mathml"


def visit_inline_math(translator: Any, node: Any) -> None:
    translator.body.append(convert(node.astext()))
    raise SkipNode


def visit_block_math(translator: Any, node: Any) -> None:
    number = f'<span class="eqno">({escape(str(node["number"]))})</span>' if node.get("number") else ""
    formula = convert(node.astext(), display="block")
    # The theme makes formulas scroll sideways; a bar for a pixel of height would stand beside each of them.
    translator.body.append(f'<div class="math" style="overflow-y: hidden">{number}{formula}</div>')
    raise SkipNode


def setup(app: Any) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (visit_inline_math, None), (visit_block_math, None))
    return {"parallel_read_safe": True}
