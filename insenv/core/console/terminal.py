"""The terminal: is there one, how wide is it, does it want colour.

Colour is for terminals alone, and not where NO_COLOR is set (https://no-color.org) or TERM is "dumb"; FORCE_COLOR asks
for it elsewhere, as where a log is shown in colour.
"""

from __future__ import annotations

import os
import sys
from typing import Any

import click

from insenv.core.errors import nearest


class OneOf(click.Choice):
    """One of a few words, which help and shell show; another one is answered with the nearest."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The word."""
        if value not in self.choices:
            self.fail(f"{value!r} given; {nearest(str(value), self.choices)}", param, ctx)
        return str(value)


def is_terminal() -> bool:
    """Whether somebody can be asked: standard input and standard error are a terminal."""
    return sys.stdin is not None and sys.stdin.isatty() and sys.stderr.isatty()


def forced() -> bool:
    """Whether colours are wanted wherever the text goes."""
    return bool(os.environ.get("FORCE_COLOR")) and not os.environ.get("NO_COLOR")


def coloured(err: bool = False) -> bool:
    """Whether standard output (or, with ``err``, standard error) is to be coloured."""
    if os.environ.get("NO_COLOR"):
        return False
    if forced():
        return True
    stream = sys.stderr if err else sys.stdout
    return stream.isatty() and os.environ.get("TERM") != "dumb"


def paint(text: str, colour: str | None = None, bold: bool | None = None, err: bool = False) -> str:
    """``text`` in a colour, where colours are wanted."""
    return click.style(text, fg=colour, bold=bold) if coloured(err) and (colour or bold) else text


def width(most: int = 120) -> int:
    """Columns of the terminal, at most ``most``; 80 or what COLUMNS says where there is none."""
    import shutil

    return min(most, shutil.get_terminal_size((80, 24)).columns)


def shortened(text: str, size: int) -> str:
    """``text`` in at most ``size`` characters."""
    return text if len(text) <= size else f"{text[: max(0, size - 1)]}…"


def wrapped(text: str, indent: str) -> str:
    """``text`` in lines as wide as the terminal, each behind ``indent``."""
    import textwrap

    return textwrap.fill(text, width(), initial_indent=indent, subsequent_indent=" " * len(indent))


def examples(*lines: str) -> str:
    """End of a command's help: how it is called; click leaves a paragraph behind a backspace as it is."""
    return "\b\n" + "\n".join(["Example:", *(f"  {line}" for line in lines)])
