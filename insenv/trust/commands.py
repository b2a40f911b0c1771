"""``insenv trust``."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from insenv.core.console.progress import Progress, allow_code_option, check_reports, tell, verbosity, verbosity_options
from insenv.core.console.terminal import examples
from insenv.core.errors import InputError


@click.command(
    "trust",
    epilog=examples("insenv trust my_gyro.toml --jobs 2 --store trust", "insenv trust my_gyro.toml --json trust.json"),
)
@allow_code_option
@verbosity_options
@click.argument("manifest")
@click.option("--copies", default=200, show_default=True, help="Copies, half of them with an effect more.")
@click.option("--alpha", default=0.01, show_default=True, help="Probability of a false discovery, per target.")
@click.option("--seed", default=0, show_default=True, help="Seed of what is drawn.")
@click.option("--jobs", default=1, show_default=True, help="Processes on this machine.")
@click.option("--store", type=click.Path(path_type=Path), help="Folder for the copies that are done.")
@click.option("--resume", is_flag=True, help="Go on with what --store holds.")
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write the rates as JSON.")
@click.option("--html", "html_path", type=click.Path(path_type=Path), help="Write a page with a figure.")
def trust(  # noqa: PLR0913 -- an argument for each option
    manifest: str,
    copies: int,
    alpha: float,
    seed: int,
    jobs: int,
    store: Path | None,
    resume: bool,
    json_path: Path | None,
    html_path: Path | None,
) -> None:
    """Say how far close-loop can be trusted on a recording: how often right and how often wrong on copies of it.

    MANIFEST is as of close-loop. In half of the copies there is nothing to find: what is named there is wrong. In the
    others there is one effect more, of a known size. A copy takes as long as close-loop itself.
    """
    from insenv.sweep import LostError, backend
    from insenv.trust.run import Kept, trust_of
    from insenv.trust.words import summary, verdict, write_json

    check_reports(json_path, html_path)
    if resume and store is None:
        raise InputError("--resume given without --store; wanted the folder to go on with")
    try:
        kept = None if store is None else Kept(store, resume)
        found = trust_of(manifest, copies, alpha, seed, backend(jobs), kept, Progress(), verbosity() >= 0)
    except (KeyboardInterrupt, LostError) as error:
        rest = "nothing was kept" if store is None else f"the copies that are done are in {store}; --resume goes on"
        click.echo(f"insenv: {str(error) or 'interrupted'}; {rest}", err=True)
        sys.exit(2 if isinstance(error, LostError) else 130)
    if html_path is not None:
        from insenv.trust.page import write_html

        write_html(found, html_path)
    if json_path is not None:
        write_json(found, json_path)
    tell(summary(found), html_path, json_path, verdict=verdict(found))
