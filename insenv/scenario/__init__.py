"""Scenarios: TOML text -> a simulated recording with a manifest that closing the loop reads back.

A scenario names a plant ([table] with [profile], or [base]), an [instrument] with the noise that its maker
declares, and the effects that are simulated. Those of ``[declared]`` reach the manifest's model by name;
those of ``[undeclared]`` reach no file but, where ``[output] truth = true`` asks for it, ``truth.json``.
`insenv.scenario.schema` is the layout; ``scenarios/`` has examples.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from insenv.core.errors import InputError
from insenv.core.files import write_whole
from insenv.core.manifest.schema import convert, tree
from insenv.scenario import write
from insenv.scenario.build import Scenario, build
from insenv.scenario.schema import ScenarioTable

__all__ = ["Scenario", "load", "simulate"]


def load(path: Path | str) -> Scenario:
    """Scenario at ``path``, checked and ready to be played.

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, has an unknown key, unit or effect, or contradicts itself.
    """
    path = Path(path)
    table = convert(tree(path, "scenario"), ScenarioTable, (), path, "scenario")
    if not 0 <= table.output.decimals <= 17:
        raise InputError(f"{path}: output.decimals = {table.output.decimals}; wanted from 0 to 17")
    scenario = build(table, path)
    write.columns(scenario)
    return scenario


def simulate(
    path: Path | str, out: Path | str, seed: int = 0, progress: Callable[[int, int], None] | None = None
) -> Path:
    """Play the scenario at ``path`` and write recording, manifest and, where asked for, truth into ``out``.

    Parameters
    ----------
    path : Path
        The scenario's TOML file.
    out : Path
        Folder, made where it is missing.
    seed : int
        Run ``seed``; the same seed gives the same files.
    progress : callable, optional
        Called with the samples written so far and their total.

    Returns
    -------
    Path
        Of the manifest.

    Raises
    ------
    InputError
        As `load`, or if a file cannot be written; then no file is left half written.
    """
    if seed < 0:
        raise InputError(f"seed {seed} given; wanted zero or more")
    scenario = load(path)
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made a folder ({error.strerror or error})") from None
    data = f"recording.{scenario.table.output.format}"
    stream = scenario.rig.stream(seed, scenario.samples)
    write.write_recording(scenario, write.rows(stream, write.columns(scenario)), folder / data, progress)
    if scenario.table.output.truth:
        write_whole(folder / "truth.json", write.truth(scenario, seed))
    manifest = folder / "manifest.toml"
    return write_whole(manifest, write.manifest(scenario, data, seed))
