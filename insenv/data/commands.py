"""``insenv init``, and what `insenv close-loop` does with a data file.

Exit status 2 and one sentence where questions are left open.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from insenv.core.console.progress import check_folder, verbosity, verbosity_options
from insenv.core.console.terminal import examples, is_terminal, paint, shortened, width, wrapped
from insenv.core.errors import InputError

if TYPE_CHECKING:
    from insenv.data.guess.draft import Draft, Question
    from insenv.data.init import Ask

_COLOURS = {"stated": "green", "answered": "green", "numbers": "green", "assumed": "yellow", "open": "red"}


@click.command(
    "init",
    epilog=examples("insenv init my_gyro.csv", "insenv init run1.csv run2.csv --out test.toml --set gyro.unit=deg/s"),
)
@click.argument("data", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="DATA...")
@click.option("--out", type=click.Path(path_type=Path), help="Manifest to write; '-': standard output. [DATA's .toml]")
@click.option("--set", "answers", multiple=True, metavar="KEY=VALUE", help="Answer a question: --set gyro.unit=deg/s.")
@click.option("--columns", metavar="NAMES", help="Headings of a file without: 't [s],gx [deg/s],-'.")
@click.option("--force", is_flag=True, help="Replace a manifest that is there.")
@click.option("--no-input", is_flag=True, help="Ask nothing, also on a terminal.")
@verbosity_options
def init(data: tuple[Path, ...], out: Path | None, answers: tuple[str, ...], columns: str | None, **how: bool) -> None:
    """Write the manifest of data files: what each column is, in which unit.

    DATA is a CSV, text, npz, Parquet, MATLAB, Excel or R file, or a ROS bag; several are runs of one instrument.
    Headings and numbers tell what they can; what would change a result and is not told is asked, or marked in the
    manifest.
    """
    from insenv.core.names import is_standard_output
    from insenv.data.init import init as write

    check_folder(out)
    given = dict(_answer(text) for text in answers)
    if columns is not None:
        given["columns"] = columns
    aside = is_standard_output(out)
    ask = None if how["no_input"] or aside or not is_terminal() else asking()
    made = write(data, out, given, ask, how["force"])
    if verbosity() >= 0 and (ask is None or not made.draft.questions):
        click.echo(table(made.draft), err=aside)
    if made.draft.questions:
        raise InputError(waiting(made.path, made.draft))
    if not aside:
        start = "\n" if verbosity() >= 0 else ""
        click.echo(f"{start}{made.path}: written. Next: insenv close-loop {made.path}")


def of_data(path: Path) -> Path:
    """The manifest of a data file that was given in place of one: the one beside it, or one that is written now.

    Raises
    ------
    InputError
        If questions are left open, or the file cannot be read.
    """
    from insenv.data.init import init as write
    from insenv.data.init import manifest_beside

    if (beside := manifest_beside(path)) is not None:
        click.echo(f"{path} is data; its manifest is {beside}.", err=True)
        return beside
    made = write([path], ask=asking() if is_terminal() else None)
    click.echo(table(made.draft), err=True)
    if made.draft.questions:
        raise InputError(waiting(made.path, made.draft))
    click.echo(f"\n{path} is data; its manifest was written to {made.path}.\n", err=True)
    return made.path


def waiting(path: Path, draft: Draft) -> str:
    """The sentence that ends a command with open questions."""
    keys = [question.key for question in draft.questions]
    noun = "1 question is" if len(keys) == 1 else f"{len(keys)} questions are"
    return f'{path}: written, and {noun} open ({", ".join(keys)}); wanted an answer in place of each "?" in it'


def _answer(text: str) -> tuple[str, str]:
    key, equals, value = text.partition("=")
    if not equals or not value.strip():
        raise InputError(f"--set {text}: wanted KEY=VALUE, as in --set gyro.unit=deg/s")
    return key.strip(), value.strip()


def asking() -> Ask:
    """A function that asks on the terminal: the table first, then a question; an empty answer leaves all open."""
    shown = False

    def ask(draft: Draft, question: Question) -> str | None:
        nonlocal shown
        from insenv.data.init import fault

        if not shown:
            click.echo(table(draft, questions=False), err=True)
            click.echo("\nEnter takes what stands in brackets; '?' leaves the rest open.", err=True)
            shown = True
        click.echo(f"\n{wrapped(f'{question.key}: {question.text}', '')}", err=True)
        while True:
            answer: str = click.prompt("", default=question.hint or "?", prompt_suffix="> ", err=True).strip()
            if answer == "?":
                return None
            if not (wrong := fault(question, answer)):
                return answer
            click.echo(wrong, err=True)

    return ask


def table(draft: Draft, questions: bool = True) -> str:
    """The draft as a table, and its open questions."""
    from insenv.data.guess.written import SURE, question_text, rows

    many = "" if len(draft.files) == 1 else f" and {len(draft.files) - 1} more"
    counted = f": {draft.rows} rows" if draft.rows else ""
    lines = [f"{draft.files[0]}{many}{counted}, read as {draft.format}", ""]
    cells = [("channel", "column", "unit", "known by", "because"), *rows(draft)]
    wide = [min(28, max(len(row[i]) for row in cells)) for i in range(4)]
    for n, row in enumerate(cells):
        texts = [shortened(text, size).ljust(size) for text, size in zip(row, wide, strict=False)]
        if n:
            texts[3] = paint(texts[3], _COLOURS.get(row[3]))
        because = shortened(row[4], max(20, width() - sum(wide) - 10))
        lines.append(("  " + "  ".join([*texts, because])).rstrip())
    used = {row[3] for row in rows(draft)}
    meant = "; ".join(f"{word}: {meaning}" for word, meaning in SURE.items() if word in used and word != "open")
    lines += ["", wrapped(f"({meant})", "  ")]
    lines += [wrapped(f"left out: {', '.join(draft.left_out)}", "  ")] if draft.left_out else []
    lines += [wrapped(f"note: {note}", "  ") for note in draft.notes]
    lines += [f"\n{wrapped(question_text(question), '? ')}" for question in draft.questions if questions]
    return "\n".join(lines)
