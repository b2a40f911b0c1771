"""The ``insenv`` command.

Bad input ends with one sentence on standard error and exit status 2; an interruption with status 130.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import click

from insenv import __version__
from insenv.core.errors import InputError


class Progress:
    """Says on standard error what is being done, once the work has lasted longer than two seconds."""

    def __init__(self) -> None:
        self._start = time.monotonic()

    def __call__(self, text: str) -> None:
        """Say ``text``."""
        elapsed = time.monotonic() - self._start
        if elapsed > 2:
            click.echo(f"[{elapsed:5.1f} s] {text}", err=True)


@click.group()
@click.version_option(__version__, prog_name="insenv")
def insenv() -> None:
    """Simulate inertial instruments, and trace measured errors to the effects that a model lacks."""


@insenv.command("close-loop")
@click.argument("manifest")
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write the findings as JSON.")
@click.option("--html", "html_path", type=click.Path(path_type=Path), help="Write a self-contained HTML report.")
@click.option("--effects", help="Try these effects only, separated by commas.")
@click.option("--alpha", default=0.01, show_default=True, help="Probability of a false discovery, per target.")
@click.option("--seed", default=0, show_default=True, help="Seed of the simulated noise that calibrates the search.")
def close_loop(
    manifest: str, json_path: Path | None, html_path: Path | None, effects: str | None, alpha: float, seed: int
) -> None:
    """Find the residual of the declared model and the effect that it lacks.

    MANIFEST is a TOML file, or the name of a recording of `insenv datasets`.
    """
    from insenv.close import close
    from insenv.report.html import write_html
    from insenv.report.json import write_json
    from insenv.report.text import summary

    for path in (json_path, html_path):
        _check_folder(path)
    found = close(manifest, effects.split(",") if effects else None, alpha, seed, Progress())
    click.echo(summary(found))
    if json_path is not None:
        write_json(found, json_path)
    if html_path is not None:
        write_html(found, html_path)
        click.echo(f"\nReport: {html_path.resolve()}")


def _check_folder(path: Path | None) -> None:
    """Refuse an output path before the work is done, not after."""
    if path is None:
        return
    if path.is_dir():
        raise InputError(f"{path}: is a folder; wanted the name of a file to write")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {str(path.parent)!r} does not exist; wanted one to write into")


@insenv.command()
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder for the recording and its manifest.")
@click.option("--seed", default=0, show_default=True, help="Seed of the run.")
def simulate(scenario: Path, out: Path, seed: int) -> None:
    """Simulate the recording that SCENARIO (a TOML file) describes, and write its manifest beside it."""
    from insenv.scenario import simulate as run

    say = Progress()
    click.echo(run(scenario, out, seed, lambda done, total: say(f"{done / total:4.0%} of {total} samples")))


@insenv.command()
@click.argument("names", nargs=-1)
@click.option("--fetch", is_flag=True, help="Fetch NAMES, or all, into the cache.")
def datasets(names: tuple[str, ...], fetch: bool) -> None:
    """List the published recordings that insenv knows, or fetch them."""
    from insenv import datasets as registry

    if fetch:
        for name in names or registry.names():
            click.echo(registry.fetch(name))
    else:
        click.echo(registry.table())


def main() -> None:
    """Entry point of the command."""
    try:
        insenv(standalone_mode=False)
    except InputError as error:
        click.echo(f"insenv: {error}", err=True)
        sys.exit(2)
    except click.ClickException as error:
        click.echo(f"insenv: {error.format_message()}", err=True)
        sys.exit(2)
    except (click.Abort, KeyboardInterrupt):
        click.echo("insenv: interrupted; nothing was written", err=True)
        sys.exit(130)


if __name__ == "__main__":
    main()
