"""A report's page from its template."""

from __future__ import annotations

from typing import Any


def rendered(template: str, **content: Any) -> str:
    """One self-contained HTML page from a template of this package; every text from a file is escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("insenv.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(**content)
