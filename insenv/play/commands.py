"""``insenv play``."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from insenv.core.console.progress import allow_code_option, verbosity_options
from insenv.core.console.terminal import examples
from insenv.core.errors import InputError


@click.command(
    "play",
    epilog=examples(
        "insenv play                               turn the table of a north finder, and watch north appear",
        "insenv play RateTable --policy optimal_ladder",
    ),
)
@allow_code_option
@verbosity_options
@click.argument("env", required=False)
@click.option("--scenario", help="Name of a packaged scenario, or a TOML file; the usual one of ENV by default.")
@click.option("--estimator", help="Plug-in whose belief is shown; the usual one of the task.")
@click.option("--policy", help="Plug-in that drives at first; you by default.")
@click.option("--seed", default=1, show_default=True, help="Seed of the run.")
@click.option("--step", help="Length of a step, '0.1 s'; as in the scenario by default.")
@click.option("--out", default="played", show_default=True, type=click.Path(path_type=Path), help="Folder for runs.")
@click.option("--port", default=0, help="Of 127.0.0.1; any that is free by default.")
@click.option("--browser/--no-browser", default=True, show_default=True, help="Open the page in your browser.")
def play(  # noqa: PLR0913 -- an argument for each option
    env: str | None,
    scenario: str | None,
    estimator: str | None,
    policy: str | None,
    seed: int,
    step: str | None,
    out: Path,
    port: int,
    browser: bool,
) -> None:
    """Play an environment in the browser: turn the table or the vehicle, and watch the belief shrink.

    ENV is one of insenv list environments, NorthFinder by default. The page is served to this machine alone. It ends
    with Ctrl-C, or when the last tab is closed.
    """
    from insenv.core.units import quantity
    from insenv.play.page import page
    from insenv.play.server import Server
    from insenv.play.session import Session, game

    if out.exists() and not out.is_dir():
        raise InputError(f"--out {out}: is a file; wanted a folder")
    if seed < 0:
        raise InputError(f"--seed {seed} given; wanted zero or more")
    with Server(port) as server:
        played = game(env, scenario, estimator, None if step is None else quantity(step, "time", "--step"))
        session = Session(played, seed, policy, out)
        click.echo(f"{played.system.name} is played at\n\n    {server.url}\n\nEnd it with Ctrl-C, or close the tab.")
        sys.stdout.flush()
        if browser and _has_screen():
            import webbrowser

            webbrowser.open(server.url)
        try:
            server.play(session, page(played.system.name))
        except KeyboardInterrupt:
            click.echo()
    for path in session.saved:
        click.echo(f"Saved: {path}")


def _has_screen() -> bool:
    """Whether a browser has a window to open: one in the terminal would take the terminal away."""
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))
