"""An estimator plug-in on a measured recording: what a manifest names, read, told and estimated.

    state = reset(),   state = update(state, run),   (m, P) = estimate(state)

The same plug-in that plays an environment; its datasheet is that of the manifest (`insenv.scenario.measured`). Runs are
estimated one by one.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate, Estimated, Estimation
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.recording import Recording
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.scenario.measured import datasheet_of

Progress = Callable[[str], None]


def estimate(manifest: str | Path, estimator: str, progress: Progress = lambda text: None) -> Estimation:
    """What a plug-in makes of the recording that a manifest names.

    Parameters
    ----------
    manifest : str or Path
    estimator : str
        Name of an installed plug-in, or "module:Name".
    progress : callable
        Told what is being done.

    Raises
    ------
    InputError
        If a file cannot be used, there is no such plug-in, or it cannot work on this recording.
    """
    made: Callable[[Datasheet], Any] = find(ESTIMATORS, estimator)
    read = load_manifest(Path(manifest))
    progress(f"reading {read.title}")
    runs = []
    for run in read_recordings(read):
        progress(f"{run.label}: {estimator}")
        runs.append(_estimated(made, estimator, datasheet_of(read, run), run))
    return Estimation(str(read.path), read.title, estimator, tuple(runs), read.filing())


def _estimated(made: Callable[[Datasheet], Any], name: str, sheet: Datasheet, run: Recording) -> Estimated:
    where = f"{run.label}: estimator {name!r}"
    try:
        plugin = made(sheet)
        state = plugin.reset()
        prior = plugin.estimate(state)
        found = plugin.estimate(plugin.update(state, run))
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    except Exception as error:  # noqa: BLE001 -- a plug-in may raise anything, and the user wants one sentence
        text = " ".join(str(error).split()) or "no message"
        raise InputError(f"{where} failed: {type(error).__name__}: {text}") from error
    for one in (prior, found):
        _check(one, where)
    return Estimated(run.label, len(run), float(run.t[-1] - run.t[0]), found, prior)


def _check(found: object, where: str) -> None:
    """Refuse what is no estimate of single quantities."""
    if not isinstance(found, Estimate):
        raise InputError(f"{where} returns a {type(found).__name__}; wanted an insenv.core.estimate.Estimate")
    k = len(found.names)
    if np.shape(found.mean) != (k,) or np.shape(found.cov) != (k, k):
        shapes = f"{np.shape(found.mean)} and {np.shape(found.cov)}"
        raise InputError(f"{where} returns arrays of shapes {shapes}; wanted ({k},) and ({k}, {k})")
    if not (np.isfinite(found.mean).all() and np.isfinite(found.cov).all() and (np.diag(found.cov) >= 0).all()):
        raise InputError(f"{where} returns a value or variance that is not finite; wanted numbers")
