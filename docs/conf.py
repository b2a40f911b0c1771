"""Sphinx settings. The site is built offline and loads nothing from other hosts."""

from html import escape
from typing import Any

from docutils.nodes import SkipNode
from latex2mathml.converter import convert

project = "insenv"
author = "insenv contributors"
copyright = "insenv contributors"

extensions = ["myst_parser"]
myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]

html_theme = "furo"
html_title = "insenv"
html_show_sourcelink = False
html_math_renderer = "mathml"


def visit_inline_math(translator: Any, node: Any) -> None:
    translator.body.append(convert(node.astext()))
    raise SkipNode


def visit_block_math(translator: Any, node: Any) -> None:
    number = f'<span class="eqno">({escape(str(node["number"]))})</span>' if node.get("number") else ""
    translator.body.append(f'<div class="math">{number}{convert(node.astext(), display="block")}</div>')
    raise SkipNode


def setup(app: Any) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (visit_inline_math, None), (visit_block_math, None))
    return {"parallel_read_safe": True}
