"""What a command says while it works, and what it looks at before."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from insenv.core.console.terminal import paint
from insenv.core.errors import InputError
from insenv.core.names import CODE_ALLOWED, is_standard_output

#: Where a command keeps how much it is to say: -1 nothing but the verdict, 1 everything from the start.
_VERBOSITY = "insenv.verbosity"
#: Colours of verdicts.
_COLOURS = {
    "nothing-significant": "green",
    "effects-found": "green",
    "effects-found-incomplete": "yellow",
    "confounded": "yellow",
    "generic-only": "yellow",
    "unexplained-structure": "red",
}
_SHARE = re.compile(r"(\d+)%")


def verbosity() -> int:
    """How much the command that runs is to say: -1, 0 or 1."""
    context = click.get_current_context(silent=True)
    return 0 if context is None else int(context.meta.get(_VERBOSITY, 0))


class Progress:
    """Says on standard error what is being done, once the work has lasted longer than two seconds.

    Nothing is said within ``pause`` seconds of what was said before; with --verbose everything is, with --quiet
    nothing. Where a text holds a share of the work ("40%"), the time that is left follows.
    """

    def __init__(self, pause: float = 0.0) -> None:
        self._start = self._said = time.monotonic()
        self._verbosity = verbosity()
        self._pause = 0.0 if self._verbosity > 0 else pause

    def __call__(self, text: str) -> None:
        """Say ``text``."""
        now = time.monotonic()
        elapsed = now - self._start
        wait = -1.0 if self._verbosity > 0 else 2.0
        if self._verbosity >= 0 and elapsed > wait and now - self._said >= self._pause:
            self._said = now
            click.echo(paint(f"[{elapsed:5.1f} s] {text}{_left(text, elapsed)}", "bright_black", err=True), err=True)


def _left(text: str, elapsed: float) -> str:
    """The time that is left, where the text says which share is done."""
    share = int(found[1]) / 100 if (found := _SHARE.search(text)) else 0.0
    return f", {elapsed * (1 - share) / share:.0f} s left" if 0.02 < share < 1 else ""


def _verbosely(context: click.Context, parameter: click.Parameter, given: bool) -> bool:
    if given:
        context.meta[_VERBOSITY] = -1 if parameter.name == "quiet" else 1
    return given


def verbosity_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a command with --quiet and --verbose."""
    quiet = click.option(
        "--quiet", "-q", is_flag=True, expose_value=False, callback=_verbosely, help="Say the verdict alone."
    )
    verbose = click.option(
        "--verbose", "-v", is_flag=True, expose_value=False, callback=_verbosely, help="Say all that is being done."
    )
    return quiet(verbose(command))


def _allow(context: click.Context, parameter: click.Parameter, given: bool) -> bool:
    """Code from files is allowed to this command and to the processes that it starts."""
    if given and CODE_ALLOWED not in os.environ:
        os.environ[CODE_ALLOWED] = "1"
        context.call_on_close(lambda: os.environ.pop(CODE_ALLOWED, None))
    return given


allow_code_option = click.option(
    "--allow-code",
    is_flag=True,
    expose_value=False,
    callback=_allow,
    help="Run code that a manifest, scenario or calibration names as module:Name.",
)


def check_folder(path: Path | None) -> None:
    """Refuse an output path before the work is done, not after."""
    if path is None or is_standard_output(path):
        return
    if path.is_dir():
        raise InputError(f"{path}: is a folder; wanted the name of a file to write")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {str(path.parent)!r} does not exist; wanted one to write into")


def check_reports(json_path: Path | None, html_path: Path | None) -> None:
    """Refuse the two files of a report before the work is done: what cannot be written, and one name for both."""
    for path in (json_path, html_path):
        check_folder(path)
    if all(map(is_standard_output, (json_path, html_path))):
        raise InputError("the JSON and the HTML are both for the standard output; wanted one of them there")
    if json_path is not None and html_path is not None and json_path.resolve() == html_path.resolve():
        raise InputError(f"{json_path}: named for the JSON and for the HTML; wanted two files")


def tell(summary: str, html_path: Path | None, *others: Path | None, verdict: str = "") -> None:
    """Print a summary, where the report is, if there is one, and the verdict last.

    On standard error where a file is standard output; with --quiet the verdict alone.
    """
    aside = any(map(is_standard_output, (html_path, *others)))
    if verbosity() >= 0 or not verdict:
        click.echo(summary, err=aside)
    if html_path is not None and not is_standard_output(html_path):
        click.echo(f"\nReport: {html_path.resolve()}", err=aside)
    if verdict:
        head, colon, rest = verdict.partition(":")
        start = "" if verbosity() < 0 else "\n"
        click.echo(f"{start}{paint(head, _COLOURS.get(head), bold=True, err=aside)}{colon}{rest}", err=aside)
