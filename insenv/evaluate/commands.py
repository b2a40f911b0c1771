"""``insenv check-plugin`` and ``insenv evaluate``.

Exit status 1: a plug-in does not keep its contract, or gave no result.
"""

from __future__ import annotations

import sys
from pathlib import Path

import click

from insenv.core.console.progress import Progress, allow_code_option, check_reports, tell, verbosity_options
from insenv.core.console.terminal import examples

#: Time between two sentences of what is being done [s].
_PAUSE = 2.0


@click.command("check-plugin", epilog=examples("insenv check-plugin north_gls --env NorthFinder"))
@verbosity_options
@click.argument("name")
@click.option("--env", help="Environments to try it on, separated by commas; all by default.")
@click.option("--limit", default="60 s", show_default=True, help="Longest time of one call.")
def check_plugin(name: str, env: str | None, limit: str) -> None:
    """Check that an estimator, a policy or an effect keeps its contract.

    NAME is that of an entry point, or module:Name. Exit status 1 if it does not.
    """
    from insenv.core.units import quantity
    from insenv.evaluate.check.plugin import check_plugin as run
    from insenv.evaluate.words import named

    where = None if env is None else named(env, "env")
    found = run(name, where, quantity(limit, "time", "--limit"), Progress(_PAUSE))
    click.echo(str(found))
    if not found.kept:
        sys.exit(1)


@click.command(
    "evaluate",
    epilog=examples("insenv evaluate --env NorthFinder --estimator revolution,north_gls --policy constant_rate"),
)
@allow_code_option
@verbosity_options
@click.option("--env", required=True, help="One of insenv list environments.")
@click.option("--estimator", required=True, help="Names of estimators, or module:Name, separated by commas.")
@click.option("--policy", required=True, help="Names of policies, or module:Name, separated by commas.")
@click.option("--seeds", default=400, show_default=True, help="Number of runs, a seed each.")
@click.option("--first", default=0, show_default=True, help="Seed of the first run.")
@click.option("--scenario", help="Name of a packaged scenario, or a TOML file; that of the published paper by default.")
@click.option("--jobs", default=1, show_default=True, help="Processes at a time.")
@click.option("--every", default=1, show_default=True, help="Steps after which the estimators are asked.")
@click.option("--limit", default="60 s", show_default=True, help="Longest time of one step of the runs.")
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write the results as JSON.")
@click.option("--html", "html_path", type=click.Path(path_type=Path), help="Write a page with figures.")
def evaluate(  # noqa: PLR0913 -- an argument for each option
    env: str,
    estimator: str,
    policy: str,
    seeds: int,
    first: int,
    scenario: str | None,
    jobs: int,
    every: int,
    limit: str,
    json_path: Path | None,
    html_path: Path | None,
) -> None:
    """Judge estimators under policies: the same runs for all, errors with their intervals, and the bound.

    Exit status 1 if a plug-in gave no result; the others are shown.
    """
    from insenv.core.units import quantity
    from insenv.evaluate import words
    from insenv.evaluate.evaluation import evaluate as run

    check_reports(json_path, html_path)
    found = run(
        env,
        words.named(estimator, "estimator"),
        words.named(policy, "policy"),
        range(first, first + seeds),
        scenario,
        jobs,
        quantity(limit, "time", "--limit"),
        every,
        say=Progress(_PAUSE),
    )
    if html_path is not None:
        from insenv.evaluate.page import write_html

        write_html(found, html_path)
    if json_path is not None:
        words.write_json(found, json_path)
    tell(words.summary(found), html_path, json_path)
    if found.faults:
        sys.exit(1)
