"""A report's page from its template: one stylesheet, one skeleton, one policy of what it may load, which is nothing.

    base.html.j2 (head, filing, foot) + style.css -> every page

A page runs no script but its own, of which its Content-Security-Policy has the SHA-256, and fetches nothing.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from typing import Any

from insenv.core.filing import Filing, command
from insenv.core.version import VERSION


def rendered(
    template: str,
    filing: Filing | None = None,
    scripts: tuple[str, ...] = (),
    more_style: str = "",
    connect: bool = False,
    **content: Any,
) -> str:
    """One self-contained HTML page from a template of this package; every text from a file is escaped.

    Parameters
    ----------
    template : str
    filing : Filing, optional
        What the head says of the recording.
    scripts : tuple of str
        Texts of the scripts that the page has inline, each as it stands between its tags.
    more_style : str
        What they bring for the stylesheet.
    connect : bool
        Whether the page asks the server that it came from; else it asks nobody.
    **content
        What the template shows.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=PackageLoader("insenv.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    style = stylesheet() + more_style
    return environment.get_template(template).render(
        style=Markup(style),
        policy=policy(style, scripts, connect),
        scripts=[Markup(script) for script in scripts],
        filing=head(filing),
        version=VERSION,
        **content,
    )


@cache
def script(name: str) -> str:
    """The text of a script of this package: "sort.js"."""
    return files("insenv.report").joinpath("templates", name).read_text("utf-8")


@cache
def stylesheet() -> str:
    """The one stylesheet of all pages."""
    return files("insenv.report").joinpath("templates/style.css").read_text("utf-8")


def policy(style: str, scripts: Iterable[str] = (), connect: bool = False) -> str:
    """A Content-Security-Policy under which a page has this style and these scripts, and loads nothing."""
    run = " ".join(_hash(script) for script in scripts) or "'none'"
    asked = "connect-src 'self'; " if connect else ""
    return (
        f"default-src 'none'; style-src {_hash(style)}; script-src {run}; img-src data:; {asked}"
        "base-uri 'none'; form-action 'none'"
    )


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def head(filing: Filing | None) -> list[tuple[str, str]]:
    """Rows of the head of a page: what ``[report]`` says, the data files, version and command."""
    rows = []
    if filing is not None:
        said = (filing.operator, filing.serial_number, filing.place, filing.date)
        rows = [(n, v) for n, v in zip(("Operator", "Serial number", "Place", "Date"), said, strict=True) if v]
        rows += [("Data", f"{one.name} (sha256 {one.sha256})") for one in filing.files]
    rows.append(("Software", f"insenv {VERSION}"))
    if command():
        rows.append(("Command", command()))
    return rows
