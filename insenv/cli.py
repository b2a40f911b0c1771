"""The ``insenv`` command.

Bad input ends with one sentence on standard error and exit status 2; an interruption with status 130.
"""

from __future__ import annotations

import sys
import time
from io import TextIOWrapper
from pathlib import Path
from typing import NoReturn

import click

from insenv import __version__
from insenv.core.errors import InputError


class Progress:
    """Says on standard error what is being done, once the work has lasted longer than two seconds.

    Nothing is said within ``pause`` seconds of what was said before.
    """

    def __init__(self, pause: float = 0.0) -> None:
        self._start = self._said = time.monotonic()
        self._pause = pause

    def __call__(self, text: str) -> None:
        """Say ``text``."""
        now = time.monotonic()
        elapsed = now - self._start
        if elapsed > 2 and now - self._said >= self._pause:
            self._said = now
            click.echo(f"[{elapsed:5.1f} s] {text}", err=True)


@click.group(invoke_without_command=True)
@click.version_option(__version__, prog_name="insenv")
@click.pass_context
def insenv(context: click.Context) -> None:
    """Simulate inertial instruments, and trace measured errors to the effects that a model lacks."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@insenv.command("close-loop")
@click.argument("manifest")
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write the findings as JSON.")
@click.option("--html", "html_path", type=click.Path(path_type=Path), help="Write an HTML report in one file.")
@click.option("--effects", help="Try these effects only, separated by commas.")
@click.option("--alpha", default=0.01, show_default=True, help="Probability of a false discovery, per target.")
@click.option("--seed", default=0, show_default=True, help="Seed of the noise that calibrates the search.")
def close_loop(
    manifest: str,
    json_path: Path | None,
    html_path: Path | None,
    effects: str | None,
    alpha: float,
    seed: int,
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
    if json_path is not None and html_path is not None and json_path.resolve() == html_path.resolve():
        raise InputError(f"{json_path}: named for the JSON and for the HTML; wanted two files")
    found = close(manifest, None if effects is None else effects.split(","), alpha, seed, Progress())
    # Files first, and of them the one that takes time: a pipe that breaks or Ctrl-C then costs neither half.
    if html_path is not None:
        write_html(found, html_path)
    if json_path is not None:
        write_json(found, json_path)
    click.echo(summary(found))
    if html_path is not None:
        click.echo(f"\nReport: {html_path.resolve()}")


@insenv.command("rate-test")
@click.argument("manifests", nargs=-1, required=True, metavar="MANIFEST...")
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write the results as JSON.")
@click.option("--html", "html_path", type=click.Path(path_type=Path), help="Write a test report in one HTML file.")
@click.option(
    "--zeros",
    default="auto",
    show_default=True,
    help="Static output to take off: auto, ends, interleaved, none.",
)
@click.option("--warm-up", default="0 s", show_default=True, help="Time after each power-up that the bias leaves out.")
@click.option("--averaging", help="Averaging times of the bias stability, separated by commas: '10 ms, 1 s, 100 s'.")
def rate_test(
    manifests: tuple[str, ...],
    json_path: Path | None,
    html_path: Path | None,
    zeros: str,
    warm_up: str,
    averaging: str | None,
) -> None:
    """Evaluate rate tests: scale factor, nonlinearity, bias and its stability, several instruments side by side.

    Each MANIFEST is a TOML file with the test of one gyro.
    """
    from insenv.core.units import quantity
    from insenv.rate_test import rate_test as run
    from insenv.report.rate_test import summary, write_html, write_json

    for path in (json_path, html_path):
        _check_folder(path)
    if json_path is not None and html_path is not None and json_path.resolve() == html_path.resolve():
        raise InputError(f"{json_path}: named for the JSON and for the HTML; wanted two files")
    left_out = quantity(warm_up, "time", "--warm-up")
    times = None if averaging is None else tuple(quantity(t, "time", "--averaging") for t in averaging.split(","))
    say = Progress(2.0)
    found = [run(m, zeros=zeros, warm_up=left_out, averaging=times, progress=say) for m in manifests]
    if html_path is not None:
        say("writing the report")
        write_html(found, html_path)
    if json_path is not None:
        write_json(found, json_path)
    click.echo(summary(found))
    if html_path is not None:
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
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder to write into.")
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

    if names and not fetch:
        raise InputError(f"datasets {' '.join(names)}: only --fetch takes names; wanted it with them")
    if fetch:
        for name in names or registry.names():
            click.echo(registry.fetch(name))
    else:
        click.echo(registry.table())


def main() -> None:
    """Entry point of the command."""
    if isinstance(sys.stdout, TextIOWrapper):
        # A terminal or pipe that has no root sign or minus sign gets its escape, not a traceback.
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        insenv(standalone_mode=False)
    except InputError as error:
        _end(str(error), 2)
    except click.ClickException as error:
        _end(error.format_message(), 2)
    except (click.Abort, KeyboardInterrupt):
        _end("interrupted; nothing was written", 130)


def _end(sentence: str, status: int) -> NoReturn:
    """One line on standard error, whatever a file's name holds, and the exit status."""
    line = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in sentence)
    click.echo(f"insenv: {line}", err=True)
    sys.exit(status)


if __name__ == "__main__":
    main()
