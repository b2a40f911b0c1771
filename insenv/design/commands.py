"""``insenv design``."""

from __future__ import annotations

from pathlib import Path

import click

from insenv.core.console.progress import Progress, allow_code_option, check_reports, tell, verbosity_options
from insenv.core.console.terminal import OneOf, examples
from insenv.core.errors import InputError

#: Time between two sentences of what is being done [s].
_PAUSE = 2.0
#: Name of the scenario file that is written.
DESIGNED_FILE = "designed.toml"


@click.command("design", epilog=examples('insenv design north_finder/realistic --time "300 s" --html best.html'))
@allow_code_option
@verbosity_options
@click.argument("scenario")
@click.option("--demanded", help="Deviation to reach in the least time, '30 arcsec'; or 'published'.")
@click.option("--time", "time_", help="Time in which to reach the least deviation: '300 s'.")
@click.option("--quantity", help="What is sought, where a task has more than one: heading, installation_angle.")
@click.option("--estimator", help="Plug-in that the procedures are played with; the best documented one of the task.")
@click.option("--seeds", default=64, show_default=True, help="Runs that each procedure is played for.")
@click.option("--no-verify", is_flag=True, help="Search alone: nothing is played.")
@click.option(
    "--search",
    default="auto",
    show_default=True,
    type=OneOf(["auto", "grid", "simplex", "cma"]),
    help="How the best is searched for.",
)
@click.option("--search-seed", default=0, show_default=True, help="Seed of the search.")
@click.option("--jobs", default=1, show_default=True, help="Processes at a time.")
@click.option("--out", type=click.Path(path_type=Path), help=f"Folder for {DESIGNED_FILE}, made where it is missing.")
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write the results as JSON.")
@click.option("--html", "html_path", type=click.Path(path_type=Path), help="Write a page with figures.")
def design(  # noqa: PLR0913 -- an argument for each option
    scenario: str,
    demanded: str | None,
    time_: str | None,
    quantity: str | None,
    estimator: str | None,
    seeds: int,
    no_verify: bool,
    search: str,
    search_seed: int,
    jobs: int,
    out: Path | None,
    json_path: Path | None,
    html_path: Path | None,
) -> None:
    """Find the best procedure for SCENARIO: its time against its accuracy, as a file that runs, and proven by playing.

    SCENARIO is a TOML file with a [task], or the name of a packaged one such as north_finder/realistic; its [design]
    says what is free. Without --demanded and --time it is the least time to what the task demands.
    """
    from insenv.design import words
    from insenv.design.designing import Asked
    from insenv.design.designing import design as run

    check_reports(json_path, html_path)
    if seeds < 2 and not no_verify:
        raise InputError(f"--seeds {seeds} given; wanted two or more, or --no-verify")
    if search_seed < 0:
        raise InputError(f"--search-seed {search_seed} given; wanted zero or more")
    folder = _folder(out)
    asked = Asked(demanded, time_, estimator, quantity, search, search_seed)
    found = run(scenario, asked, range(0 if no_verify else seeds), jobs, Progress(_PAUSE))
    if folder is not None:
        from insenv.design.written import write_scenario

        changes = dict(found.chosen.plan.changes) | ({} if quantity is None else {"design.quantity": quantity})
        write_scenario(scenario, changes, words.promise(found), folder / DESIGNED_FILE)
    if html_path is not None:
        from insenv.design.page import write_html

        write_html(found, html_path)
    if json_path is not None:
        words.write_json(found, json_path)
    tell(words.summary(found), html_path, json_path)
    if folder is not None:
        click.echo(folder / DESIGNED_FILE)


def _folder(out: Path | None) -> Path | None:
    """The folder to write into, made before any work is done."""
    if out is None:
        return None
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{out}: cannot be made a folder ({error.strerror or error})") from None
    return out
