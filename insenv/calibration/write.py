"""Corrected recordings, written with a manifest beside them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from insenv.calibration.apply import Applied, Said
from insenv.calibration.model import Calibration
from insenv.core.errors import InputError
from insenv.data.load import read_recordings
from insenv.data.manifest import Manifest
from insenv.data.power import by_power_up
from insenv.data.save import save


def correct(calibration: Calibration, manifest: Manifest, folder: Path | str) -> tuple[Path, tuple[Applied, ...]]:
    """Take what the calibration explains out of every run of ``manifest`` and write the outcome into ``folder``.

    Returns
    -------
    manifest : Path
        Of the corrected recordings, named as the one given; model, noise and held-out data are those of it.
    applied : tuple of Applied
        One per run.

    Raises
    ------
    InputError
        If the calibration does not fit a recording, or a file cannot be written.
    """
    recordings = by_power_up(read_recordings(manifest))
    path = Path(folder) / manifest.path.name
    given = {manifest.path.resolve(), *(run.file.resolve() for run in manifest.runs)}
    written = {path, *(path.with_name(f"{path.stem}_{i}.npz") for i in range(1, len(recordings) + 1))}
    if both := {p.resolve() for p in written} & given:
        raise InputError(f"{min(both)}: would be written over; wanted another folder than that of the recording")
    applied = tuple(calibration.explain(recording) for recording in recordings)
    save(
        path,
        [one.recording for one in applied],
        manifest.model,
        title=f"{manifest.title}, corrected",
        noise=manifest.noise,
        held_out=manifest.held_out,
        fit_rows=manifest.fit_rows,
    )
    return path, applied


def summary(calibration: Calibration, applied: Sequence[Applied]) -> str:
    """What was taken out of each recording, what was not, and why: lines of text."""
    lines = []
    for one in applied:
        made = f"run {one.run} of {calibration.manifest}" if one.run else f"not a recording of {calibration.manifest}"
        lines.append(f"{one.recording.label} ({made})")
        for target in dict.fromkeys(said.target for said in (*one.taken, *one.left)):
            taken = [_taken(said) for said in one.taken if said.target == target]
            lines.append(f"  {target}: taken out: {', '.join(taken) or 'nothing'}")
            lines += [f"    left: {said.effect} ({said.reason})" for said in one.left if said.target == target]
    return "\n".join(lines)


def _taken(said: Said) -> str:
    return said.effect if said.channel == said.target else f"{said.effect} (out of {said.channel})"
