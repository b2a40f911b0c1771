"""The page of a session, with its script and the one stylesheet of all pages inside."""

from __future__ import annotations

from importlib.resources import files

from insenv.report.page import rendered


def page(environment: str) -> str:
    """HTML; it asks nothing but its own server.

    Parameters
    ----------
    environment : str
        Name of the system.
    """
    script = files("insenv.play").joinpath("play.js").read_text("utf-8")
    return rendered("play.html.j2", scripts=(script,), connect=True, title=environment, what=environment)
