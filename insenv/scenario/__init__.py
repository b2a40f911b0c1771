"""Scenarios: TOML text -> a simulated recording with a manifest that closing the loop reads back.

A scenario names a plant ([table] or [vehicle] with [profile] or [task], or [base]), an [instrument] with the noise that
its maker declares, and the effects that are simulated. Those of ``[declared]`` reach the manifest's model by name;
those of ``[undeclared]`` reach no file but, where ``[output] truth = true`` asks for it, ``truth.json``.
`insenv.scenario.schema` is the layout; ``scenarios/`` has examples, and some are packaged: `names`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from insenv.core.errors import InputError
from insenv.core.files import write_whole
from insenv.core.system import plants
from insenv.data.manifest.schema import convert
from insenv.scenario import write
from insenv.scenario.build import Scenario, build
from insenv.scenario.datasheet import datasheet
from insenv.scenario.schema import ScenarioTable
from insenv.scenario.source import names, source
from insenv.scenario.spec import TaskSpec
from insenv.scenario.task import check_task

__all__ = ["Scenario", "TaskSpec", "check_task", "datasheet", "load", "names", "simulate"]


def load(path: Path | str, changes: Mapping[str, Any] | None = None) -> Scenario:
    """A scenario, checked and ready to be played.

    Parameters
    ----------
    path : Path or str
        Of a TOML file, or the name of a packaged scenario: "north_finder/published".
    changes : mapping of str to object, optional
        What is to be other than in the file: ``{"table.tilt": "12 deg"}``.

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, has an unknown key, unit or effect, or contradicts itself, or if
        its task has no meaning (`check_task`).
    """
    tree, path = source(path, changes)
    if "carriers" in tree:
        raise InputError(f"{path}: 'carriers' is no table of a scenario")
    tree["carriers"] = {name: tree.pop(name) for name in plants() if name in tree}
    table = convert(tree, ScenarioTable, (), path, "scenario")
    if not 0 <= table.output.decimals <= 17:
        raise InputError(f"{path}: output.decimals = {table.output.decimals}; wanted from 0 to 17")
    if not 1 <= table.output.files <= 100:
        raise InputError(f"{path}: output.files = {table.output.files}; wanted from 1 to 100")
    scenario = build(table, path)
    write.columns(scenario)
    if scenario.task is not None:
        check_task(scenario)
    return scenario


def simulate(
    path: Path | str,
    out: Path | str,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    changes: Mapping[str, Any] | None = None,
) -> Path:
    """Play the scenario at ``path`` and write recording, manifest and, where asked for, truth into ``out``.

    Parameters
    ----------
    path : Path or str
        The scenario's TOML file, or the name of a packaged one.
    out : Path
        Folder, made where it is missing.
    seed : int
        Run ``seed``; the same seed gives the same files.
    progress : callable, optional
        Called with the samples written so far and their total.
    changes : mapping of str to object, optional
        As of `load`.

    Returns
    -------
    Path
        Of the manifest.

    Raises
    ------
    InputError
        As `load`, or if the scenario has a task and no profile, or a file cannot be written; then no file is left
        half written.
    """
    if seed < 0:
        raise InputError(f"seed {seed} given; wanted zero or more")
    scenario = load(path, changes)
    if scenario.table.base is None and scenario.table.profile is None:
        raise InputError(
            f"{scenario.path}: [profile] is missing; without it the [task] needs an environment to play it"
        )
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made a folder ({error.strerror or error})") from None
    output, columns = scenario.table.output, write.columns(scenario)
    data = [f"recording{f'_{n + 1}' if output.files > 1 else ''}.{output.format}" for n in range(output.files)]
    for number, name in enumerate(data):
        own = seed + write.FILES_APART * number
        phases = {c.name: float(scenario.phases(own, c.name)) for c in columns if c.pulses or c.renewed > 1}
        stream = scenario.cast(seed, number + 1).stream(own, scenario.samples)
        write.write_recording(scenario, write.rows(stream, columns, phases), folder / name, progress)
    if scenario.table.output.truth:
        write_whole(folder / "truth.json", write.truth(scenario, seed))
    manifest = folder / "manifest.toml"
    return write_whole(manifest, write.manifest(scenario, data[0] if len(data) == 1 else data, seed))
