"""What a command says while it works, and what it looks at before."""

from __future__ import annotations

import os
import time
from pathlib import Path

import click

from insenv.core.errors import InputError
from insenv.core.names import CODE_ALLOWED, is_standard_output


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


def tell(summary: str, html_path: Path | None, *others: Path | None) -> None:
    """Print a summary, and where the report is, if there is one; on standard error where a file is standard output."""
    aside = any(map(is_standard_output, (html_path, *others)))
    click.echo(summary, err=aside)
    if html_path is not None and not is_standard_output(html_path):
        click.echo(f"\nReport: {html_path.resolve()}", err=aside)
