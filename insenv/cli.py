"""The ``insenv`` command.

Bad input ends with one sentence on standard error and exit status 2; an interruption with status 130. A plug-in that
fails its check, or gives no result, is no bad input: status 1.
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

# The matrices are small: threads of the linear algebra would wait for each other longer than they work, and many times
# as long on a machine that has other things to do.
for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

import sys
import warnings
from collections.abc import Mapping
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NoReturn

import click

from insenv.core.console.progress import (
    Progress,
    allow_code_option,
    check_folder,
    check_reports,
    tell,
    verbosity,
    verbosity_options,
)
from insenv.core.console.terminal import OneOf, examples, forced, width
from insenv.core.errors import InputError
from insenv.core.filing import run_as
from insenv.core.names import KINDS
from insenv.core.version import VERSION
from insenv.data.commands import init, of_data
from insenv.design.commands import design
from insenv.evaluate.commands import check_plugin, evaluate
from insenv.play.commands import play
from insenv.trust.commands import trust

if TYPE_CHECKING:
    from insenv.identify.findings import Findings


class _Commands(click.Group):
    """The commands, each with the whole first sentence of its help."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a line for each command."""
        shown = [(name, (self.commands[name].help or "").partition("\n\n")[0]) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl([(name, " ".join(text.split())) for name, text in shown])


@click.group(
    cls=_Commands,
    invoke_without_command=True,
    epilog=examples(
        "insenv close-loop my_gyro.csv    what does the model of my gyro lack?",
        "insenv list environments         what there is: effects, scenarios, recordings ...",
    ),
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(VERSION, "-V", "--version", prog_name="insenv")
@click.pass_context
def insenv(context: click.Context) -> None:
    """Simulate inertial instruments, and trace measured errors to the effects that a model lacks."""
    # What is painted for a pipe, because FORCE_COLOR asks for it, stays so: click would take the colours out.
    context.color = forced() or None
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@insenv.command(
    "close-loop",
    epilog=examples(
        "insenv close-loop my_gyro.csv --html report.html",
        "insenv close-loop psins_lasergyro --json - | jq .verdict",
        "insenv close-loop unit7.toml unit8.toml unit9.toml     what all units have, and what is one's own",
    ),
)
@allow_code_option
@verbosity_options
@click.argument("manifests", nargs=-1, required=True, metavar="MANIFEST...")
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write the findings as JSON.")
@click.option("--html", "html_path", type=click.Path(path_type=Path), help="Write an HTML report in one file.")
@click.option(
    "--calibration",
    "calibration_path",
    type=click.Path(path_type=Path),
    help="Write the calibration, for insenv apply.",
)
@click.option("--effects", help="Try these effects only, separated by commas.")
@click.option(
    "--formula",
    "formula_path",
    type=click.Path(path_type=Path),
    help="Seek a formula for what no effect explains, and write it as an effect: my_effect.py.",
)
@click.option("--alpha", default=0.01, show_default=True, help="Probability of a false discovery, per target.")
@click.option("--seed", default=0, show_default=True, help="Seed of the noise that calibrates the search.")
@click.option("--in-environment", is_flag=True, help="MANIFEST is a scenario: play it, and what would settle it.")
@click.option("--budget", help="Instrument time of all its runs; ten times the first by default: '2 h'.")
@click.option("--estimator", help="Plug-in that finds the quantity in question; the usual one of its task.")
def close_loop(  # noqa: PLR0913 -- an argument for each option
    manifests: tuple[str, ...],
    json_path: Path | None,
    html_path: Path | None,
    calibration_path: Path | None,
    effects: str | None,
    formula_path: Path | None,
    alpha: float,
    seed: int,
    **played: Any,
) -> None:
    """Find the residual of the declared model and the effect that it lacks.

    MANIFEST is a TOML file, a data file (its manifest is then written first, as by insenv init), or the name of a
    recording of insenv datasets. With --in-environment it is a scenario, or the name of a packaged one, and --seed that
    of its instrument: what its first run leaves confounded is settled by the experiments that the loop proposes.

    Several are the recordings of several units, each with its own: they are judged together then.
    """
    from insenv.calibration import calibration
    from insenv.close import close, opened
    from insenv.report.formula import check_path, write_effects
    from insenv.report.html import write_html
    from insenv.report.json import write_json
    from insenv.report.text import summary

    check_reports(json_path, html_path)
    check_folder(calibration_path)
    check_path(formula_path)
    _belong_together({"effects": effects, "calibration": calibration_path, "formula": formula_path}, played)
    given = {"calibration": calibration_path, "formula": formula_path, "in-environment": played["in_environment"]}
    if len(manifests) > 1:
        _campaign(manifests, (json_path, html_path), effects, (alpha, seed), given)
        return
    (manifest,) = manifests
    if played["in_environment"]:
        _settle(manifest, (json_path, html_path), (alpha, seed), played)
        return
    if calibration_path is not None and calibration_path.resolve() in [
        p.resolve() for p in (json_path, html_path) if p
    ]:
        raise InputError(f"{calibration_path}: named for the calibration and for a report; wanted two files")
    manifest = _manifest(manifest)
    found = close(
        manifest,
        None if effects is None else effects.split(","),
        alpha,
        seed,
        Progress(),
        formula=formula_path is not None,
    )
    # Files first, and of them the one that takes time: a pipe that breaks or Ctrl-C then costs neither half.
    if html_path is not None:
        write_html(found, html_path)
    if json_path is not None:
        write_json(found, json_path)
    if calibration_path is not None:
        calibration(found, opened(manifest)).save(calibration_path)
    shown = summary(found, width(100))
    if formula_path is not None and write_effects(found, formula_path) is not None:
        shown += f"\n\nThe next search tries it: effects = [{str(formula_path)!r}] below [model], and --allow-code"
    tell(shown, html_path, json_path, calibration_path, verdict=_verdict(found))


def _manifest(given: str) -> str:
    """A manifest, or the one of a data file, which is written where there is none."""
    from insenv.data.init import is_data

    return str(of_data(Path(given))) if is_data(Path(given)) else given


def _campaign(
    manifests: tuple[str, ...],
    paths: tuple[Path | None, Path | None],
    effects: str | None,
    search: tuple[float, int],
    of_one: Mapping[str, object],
) -> None:
    """Judge several units together; ``search`` are alpha and the seed, ``of_one`` what one recording alone can have."""
    from insenv.campaign.run import campaign
    from insenv.campaign.words import summary, verdict, write_html, write_json

    for name, value in of_one.items():
        if value:
            raise InputError(f"--{name} belongs to one recording; {len(manifests)} manifests given")
    alpha, seed = search
    json_path, html_path = paths
    tried = None if effects is None else effects.split(",")
    found = campaign([_manifest(m) for m in manifests], tried, alpha, seed, Progress(1.0))
    if html_path is not None:
        write_html(found, html_path)
    if json_path is not None:
        write_json(found, json_path)
    tell(summary(found), html_path, json_path, verdict=verdict(found))


def _verdict(found: Findings) -> str:
    """The verdict and what was added, in one line."""
    several = len(found.targets) > 1
    added = [
        (f"{target.target}: " if several else "") + ", ".join(dict.fromkeys(one.effect for one in target.added))
        for target in found.targets
        if target.added
    ]
    return f"{found.verdict}{': ' if added else ''}{'; '.join(added)}"


def _belong_together(of_recording: Mapping[str, object], played: Mapping[str, Any]) -> None:
    """Refuse options of a recording for a scenario, and those of a scenario for a recording."""
    for name, value in of_recording.items():
        if played["in_environment"] and value is not None:
            raise InputError(f"--{name} belongs to a recording; wanted it without --in-environment")
    for name in ("budget", "estimator"):
        if played[name] is not None and not played["in_environment"]:
            raise InputError(f"--{name} belongs to a scenario; wanted it with --in-environment")


def _settle(scenario: str, paths: tuple[Path | None, Path | None], search: tuple[float, int], played: Any) -> None:
    """Close the loop on a scenario in its environment; ``search`` are alpha and the seed of the instrument."""
    from insenv.core.units import quantity
    from insenv.report.story import summary, write_json
    from insenv.report.story_html import write_html
    from insenv.settle import settle

    budget = None if played["budget"] is None else quantity(played["budget"], "time", "--budget")
    alpha, seed = search
    json_path, html_path = paths
    story = settle(scenario, budget, seed, played["estimator"], alpha, progress=Progress(1.0))
    if html_path is not None:
        write_html(story, html_path)
    if json_path is not None:
        write_json(story, json_path)
    tell(summary(story), html_path, json_path)


@insenv.command("apply", epilog=examples("insenv apply calibration.json next_run.toml --out corrected"))
@allow_code_option
@verbosity_options
@click.argument("calibration", type=click.Path(path_type=Path))
@click.argument("manifest")
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder to write into.")
def apply_calibration(calibration: Path, manifest: str, out: Path) -> None:
    """Take what CALIBRATION explains out of the recordings of MANIFEST, and write them with a manifest beside.

    CALIBRATION is a file of insenv close-loop --calibration, MANIFEST as there.
    """
    from insenv.calibration import correct, load_calibration
    from insenv.calibration.write import summary
    from insenv.close import opened

    found = load_calibration(calibration)
    path, applied = correct(found, opened(manifest, Progress()), out)
    click.echo(summary(found, applied))
    click.echo(path)


@insenv.command("rate-test", epilog=examples("insenv rate-test unit7.toml unit8.toml --html test.html"))
@allow_code_option
@verbosity_options
@click.argument("manifests", nargs=-1, required=True, metavar="MANIFEST...")
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write the results as JSON.")
@click.option("--html", "html_path", type=click.Path(path_type=Path), help="Write a test report in one HTML file.")
@click.option(
    "--zeros",
    default="auto",
    show_default=True,
    type=OneOf(["auto", "ends", "interleaved", "none"]),
    help="Static output to take off.",
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
    from insenv.report.rate_test.document import summary, write_html, write_json

    check_reports(json_path, html_path)
    left_out = quantity(warm_up, "time", "--warm-up")
    times = None if averaging is None else tuple(quantity(t, "time", "--averaging") for t in averaging.split(","))
    say = Progress(2.0)
    found = [run(m, zeros=zeros, warm_up=left_out, averaging=times, progress=say) for m in manifests]
    if html_path is not None:
        say("writing the report")
        write_html(found, html_path)
    if json_path is not None:
        write_json(found, json_path)
    tell(summary(found), html_path, json_path)


@insenv.command("estimate", epilog=examples("insenv estimate recording.toml --with north_gls"))
@allow_code_option
@verbosity_options
@click.argument("manifest")
@click.option("--with", "estimator", required=True, help="Name of an estimator, or module:Name.")
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write the estimates as JSON.")
@click.option("--html", "html_path", type=click.Path(path_type=Path), help="Write an HTML report in one file.")
def estimate_recording(manifest: str, estimator: str, json_path: Path | None, html_path: Path | None) -> None:
    """Estimate what a recording tells: any estimator on the runs of MANIFEST, with its [datasheet].

    MANIFEST is a TOML file, or the name of a recording of `insenv datasets`.
    """
    from insenv.estimate import estimate
    from insenv.report.estimate import summary, write_html, write_json

    check_reports(json_path, html_path)
    found = estimate(manifest, estimator, Progress())
    if html_path is not None:
        write_html(found, html_path)
    if json_path is not None:
        write_json(found, json_path)
    tell(summary(found), html_path, json_path)


@insenv.command(epilog=examples("insenv simulate scenarios/staircase.toml --out out/staircase"))
@allow_code_option
@verbosity_options
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder to write into.")
@click.option("--seed", default=0, show_default=True, help="Seed of the run.")
def simulate(scenario: Path, out: Path, seed: int) -> None:
    """Simulate the recording that SCENARIO (a TOML file) describes, and write its manifest beside it."""
    from insenv.scenario import simulate as run

    say = Progress()
    click.echo(run(scenario, out, seed, lambda done, total: say(f"{done / total:4.0%} of {total} samples")))


@insenv.command(epilog=examples("insenv datasets --fetch psins_lasergyro"))
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


@insenv.command(
    "sweep",
    epilog=examples("insenv sweep north_finder/published --policy constant_rate --estimator north_gls --seeds 200"),
)
@allow_code_option
@verbosity_options
@click.argument("scenario")
@click.option("--policy", required=True, help="Name of a policy, or module:Name.")
@click.option("--estimator", required=True, help="Name of an estimator, or module:Name.")
@click.option("--seeds", default=1000, show_default=True, help="Number of runs, a seed each.")
@click.option("--first", default=0, show_default=True, help="Seed of the first run.")
@click.option("--store", type=click.Path(path_type=Path), help="Folder for the results, from which to resume.")
@click.option("--resume", is_flag=True, help="Go on with what --store holds of this sweep.")
@click.option("--jobs", default=1, show_default=True, help="Processes on this machine.")
@click.option("--cluster", help="Dask scheduler instead, tcp://host:port.")
@click.option(
    "--path",
    default="samples",
    show_default=True,
    type=OneOf(["samples", "dwells"]),
    help="How to simulate: samples, or means over dwells.",
)
@click.option("--block", help="Length of a dwell, such as '0.1 s'; a step of the task.")
@click.option("--every", default=1, show_default=True, help="Steps after which the estimator is asked.")
def sweep_runs(  # noqa: PLR0913 -- an argument for each option
    scenario: str,
    policy: str,
    estimator: str,
    seeds: int,
    first: int,
    store: Path | None,
    resume: bool,
    jobs: int,
    cluster: str | None,
    path: Literal["samples", "dwells"],
    block: str | None,
    every: int,
) -> None:
    """Play SCENARIO for many seeds, and show the errors of the estimator.

    SCENARIO is a TOML file with a [task], or the name of a packaged one such as north_finder/published.
    """
    from insenv.core.units import quantity
    from insenv.evaluate.runs import Episodes
    from insenv.evaluate.sweeps import run, summary
    from insenv.sweep import LostError, backend

    if resume and store is None:
        raise InputError("--resume given without --store; wanted the folder to go on with")
    length = None if block is None else quantity(block, "time", "--block")
    job = Episodes(scenario, estimator, policy, path=path, block=length, every=every)
    try:
        found = run(job, first, seeds, store, backend(jobs, cluster), resume, progress=verbosity() >= 0)
    except KeyboardInterrupt:
        _end(f"interrupted; {_kept(store)}", 130)
    except LostError as error:
        _end(f"{error}; {_kept(store)}", 2)
    click.echo(summary(job, found))


def _kept(store: Path | None) -> str:
    """What becomes of a sweep that ended early."""
    if store is None:
        return "nothing was kept, for that it needs --store"
    return f"what is done is in {store}, and the same command with --resume goes on"


insenv.add_command(init)
insenv.add_command(check_plugin)
insenv.add_command(evaluate)
insenv.add_command(design)
insenv.add_command(trust)
insenv.add_command(play)


@insenv.command("list", epilog=examples("insenv list effects", "insenv list recordings"))
@click.argument("kind", type=OneOf(KINDS), metavar="KIND")
def list_kind(kind: str) -> None:
    """List what there is of a KIND, with a line each: the names that other commands and files take.

    KIND is effects, scenarios, instruments, estimators, policies, environments or recordings.
    """
    from insenv.shelf import listed

    click.echo(listed(kind, width()))


class _Name(click.ParamType):
    """A text that the shell may complete with the names of a kind, or several, between commas, or with files."""

    name = "text"

    def __init__(self, kind: str, files: bool = False) -> None:
        self.kind, self.files = kind, files

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[click.shell_completion.CompletionItem]:
        """Names that begin with what stands behind the last comma."""
        from click.shell_completion import CompletionItem

        from insenv.shelf import names

        before, comma, last = incomplete.rpartition(",")
        known = [name for kind in self.kind.split() for name in names(kind)]
        found = [CompletionItem(f"{before}{comma}{name}") for name in known if name.startswith(last)]
        return [*found, CompletionItem(incomplete, type="file")] if self.files else found


#: Arguments and options that take names of a kind; true: or a file.
_NAMED: Mapping[tuple[str, str], tuple[str, bool]] = {
    ("close-loop", "manifests"): ("recordings", True),
    ("close-loop", "effects"): ("effects", False),
    ("close-loop", "estimator"): ("estimators", False),
    ("apply", "manifest"): ("recordings", True),
    ("datasets", "names"): ("recordings", False),
    ("estimate", "manifest"): ("recordings", True),
    ("estimate", "estimator"): ("estimators", False),
    ("sweep", "scenario"): ("scenarios", True),
    ("sweep", "policy"): ("policies", False),
    ("sweep", "estimator"): ("estimators", False),
    ("evaluate", "env"): ("environments", False),
    ("evaluate", "estimator"): ("estimators", False),
    ("evaluate", "policy"): ("policies", False),
    ("evaluate", "scenario"): ("scenarios", True),
    ("simulate", "scenario"): ("scenarios", True),
    ("check-plugin", "name"): ("estimators policies effects", False),
    ("check-plugin", "env"): ("environments", False),
    ("play", "env"): ("environments", False),
    ("play", "scenario"): ("scenarios", True),
    ("play", "estimator"): ("estimators", False),
    ("play", "policy"): ("policies", False),
    ("design", "scenario"): ("scenarios", True),
    ("design", "estimator"): ("estimators", False),
    ("trust", "manifest"): ("recordings", True),
}
for (_command, _parameter), (_kind, _or_file) in _NAMED.items():
    next(p for p in insenv.commands[_command].params if p.name == _parameter).type = _Name(_kind, _or_file)


def main() -> None:
    """Entry point of the command."""
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # those of libraries tell a programmer, not who asks for a result
    if isinstance(sys.stdout, TextIOWrapper):
        # A terminal or pipe that has no root sign or minus sign gets its escape, not a traceback.
        sys.stdout.reconfigure(errors="backslashreplace")
    run_as(sys.argv[1:])
    try:
        insenv(standalone_mode=False)
    except InputError as error:
        _end(str(error), 2)
    except click.ClickException as error:
        _end(" ".join(error.format_message().split()), 2)  # choices stand on lines of their own
    except (click.Abort, KeyboardInterrupt):
        _end("interrupted; nothing was written", 130)


def _end(sentence: str, status: int) -> NoReturn:
    """One line on standard error, whatever a file's name holds, and the exit status."""
    line = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in sentence)
    click.echo(f"insenv: {line}", err=True)
    sys.exit(status)


if __name__ == "__main__":
    main()
