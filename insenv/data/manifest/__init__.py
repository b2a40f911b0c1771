"""Manifest of a measured recording: TOML text -> frozen settings in SI units and radians.

A manifest says where the data files lie, what each channel is, what the model declares and which data no fit
may see; `insenv.data.manifest.schema` is its layout. Two keys need a word:

``[model] bias = "common" | "per-run"``
    Whether the runs of one instrument share their bias.
``[held_out] averaging = "5 s"``
    Length of the means in which the held-out error is scored.
"""

from __future__ import annotations

from pathlib import Path

from insenv.core import plugins
from insenv.data.manifest import checks, schema
from insenv.data.manifest.spec import (
    ChannelSpec,
    HeldOut,
    KnownPositions,
    Manifest,
    Model,
    RowRanges,
    RunSpec,
    Source,
)

__all__ = [
    "ChannelSpec",
    "HeldOut",
    "KnownPositions",
    "Manifest",
    "Model",
    "RowRanges",
    "RunSpec",
    "Source",
    "load_manifest",
]


def load_manifest(path: Path | str, folder: Path | str | None = None, allow_code: bool = False) -> Manifest:
    """Manifest at ``path``; its data files lie in ``folder``, by default beside it. No data file is opened.

    ``allow_code``: whether it may name effects as "module:Name".

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, has an unknown key or unit, or contradicts itself.
    """
    path = Path(path)
    table = schema.parse(path)
    folder = path.parent if folder is None else Path(folder)
    runs = checks.runs(table, folder, path)
    channels = checks.channels(table, runs, path, folder)
    with plugins.allow_code(allow_code):
        model = checks.model(table.model, channels, path)
    return Manifest(
        path=path,
        title=table.title or path.stem,
        runs=runs,
        channels=channels,
        model=model,
        noise=checks.noise(table, model.targets, path),
        held_out=checks.held_out(table.held_out, None if "power" in channels else len(runs), path),
        fit_rows=checks.ranges(table.fit.rows, f"{path}: fit.rows"),
        columns=checks.columns(table, runs, path),
        resample=checks.resample(table, len(runs), path),
        source=checks.source(table.source),
        positions=checks.positions(table.positions, table.model.procedure, path),
        datasheet=table.datasheet,
        report=checks.report(table.report, path),
    )
