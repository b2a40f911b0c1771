"""A sweep over the runs of a scenario, and what it says of an estimator's errors.

    mean m +- z s / sqrt(n),    standard deviation s +- z sqrt(m4 - s^4) / (2 s sqrt(n))

with z the normal quantile of 97.5 % and m4 the fourth central moment: the intervals hold for errors that are not
Gaussian, too. The spread of z-scores is their root mean square; 1 where the estimator tells true deviations.
"""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from insenv.core.errors import InputError
from insenv.core.plugins import ESTIMATORS, POLICIES, find
from insenv.core.recording import Floats
from insenv.core.units import ARCSEC, PPM
from insenv.evaluate.runs import Episodes
from insenv.scenario.source import source
from insenv.sweep import Backend, Folder, Identity, Memory, Store, Table, sweep

#: Normal quantile of 97.5 %.
QUANTILE = 1.959964
#: How SI units are shown.
_SHOWN = {"rad": ("arcsec", ARCSEC), "1": ("ppm", PPM)}


def identity(job: Episodes, first: int, total: int) -> Identity:
    """What the store of such a sweep is known by: the texts of scenario and plug-ins count, not their names alone.

    Raises
    ------
    InputError
        If there is no such scenario or plug-in.
    """
    tree, _ = source(job.scenario, json.loads(job.changes))
    settings = {name: str(value) for name, value in asdict(job).items()}
    settings["scenario's hash"] = _hash(json.dumps(tree, sort_keys=True, default=str).encode())
    for kind, group in (("estimator", ESTIMATORS), ("policy", POLICIES)):
        try:
            path = Path(inspect.getfile(find(group, settings[kind])))
            settings[f"{kind}'s hash"] = _hash(path.read_bytes())
        except (TypeError, OSError):  # not written in a file
            settings[f"{kind}'s hash"] = "unknown"
    return Identity("insenv.evaluate.runs:Episodes", first, total, settings)


def run(
    job: Episodes, first: int, total: int, folder: Path | None, backend: Backend, resume: bool, progress: bool
) -> Store:
    """Play the runs; see `insenv.sweep.sweep`.

    Raises
    ------
    InputError
        If the job cannot be done, or the store or the back end cannot be used.
    """
    if total < 1 or first < 0:
        raise InputError(f"{total} runs from seed {first} given; wanted one or more, from a seed of 0 or more")
    _ = job.units  # bad names are refused before a folder is made
    store: Store = Memory() if folder is None else Folder(folder, identity(job, first, total), resume)
    return sweep(job, first, total, store, backend, progress=progress)


@dataclass(frozen=True)
class Moments:
    """Number of values and the sums of their powers 1 to 4, for values of about unit size."""

    count: int
    sums: tuple[float, float, float, float]

    @property
    def mean(self) -> tuple[float, float]:
        """With half of its 95 % interval."""
        return self.sums[0] / self.count, QUANTILE * self.deviation[0] / self.count**0.5

    @property
    def deviation(self) -> tuple[float, float]:
        """Standard deviation about the mean (n - 1), with half of its 95 % interval."""
        n = self.count
        m, q, c, f = (s / n for s in self.sums)
        variance = max(q - m * m, 0.0)
        fourth = f - 4 * m * c + 6 * m * m * q - 3 * m**4
        s = (variance * n / max(n - 1, 1)) ** 0.5
        return s, QUANTILE * max(fourth - variance**2, 0.0) ** 0.5 / (2 * s * n**0.5) if s else 0.0

    @property
    def rms(self) -> tuple[float, float]:
        """Root mean square, with half of its 95 % interval."""
        n, (_, q, _, f) = self.count, (s / self.count for s in self.sums)
        r = q**0.5
        return r, QUANTILE * max(f - q * q, 0.0) ** 0.5 / (2 * r * n**0.5) if r else 0.0


def moments(values: Iterable[Floats]) -> Moments:
    """Of all values of some arrays."""
    count, sums = 0, np.zeros(4)
    for part in values:
        count += len(part)
        sums += [float(np.sum(part**k)) for k in (1, 2, 3, 4)]
    a, b, c, d = sums.tolist()
    return Moments(count, (a, b, c, d))


def summary(job: Episodes, store: Store) -> str:
    """Errors of each quantity that the task asks for, in words and numbers.

    Raises
    ------
    InputError
        If a file of the store cannot be read.
    """
    units = job.units
    names = sorted(
        {name.removeprefix("error.") for part in store.parts() for name in part if name.startswith("error.")}
    )
    count = sum(stop - start for start, stop in store.done())
    time = moments(part["time"] for part in store.parts()).mean[0] if count else 0.0
    how = (
        f"dwells of {job.block or 'a step'}{' s' if job.block else ''}" if job.path == "dwells" else "sample by sample"
    )
    lines = [
        f"{job.scenario}: policy {job.policy}, estimator {job.estimator}, {how}",
        f"{count} runs of {time:.6g} s in the mean; +- are 95 % intervals",
    ]
    if not names:
        lines.append("The estimator tells nothing of what the task asks for.")
    for name in names:
        lines += _lines(name, units.get(name, "1"), store)
    return "\n".join(lines)


def _lines(name: str, si: str, store: Store) -> list[str]:
    unit, scale = _SHOWN.get(si, (si, 1.0))
    error = moments(part[f"error.{name}"] / scale for part in store.parts())
    told = moments(_stated_deviation(part, name) / scale for part in store.parts())
    score = moments(part[f"error.{name}"] / _stated_deviation(part, name) for part in store.parts())
    return [
        f"{name} [{unit}]",
        f"  mean error          {_with(error.mean)}",
        f"  standard deviation  {_with(error.deviation)}",
        f"  root mean square    {_with(error.rms)}",
        f"  claimed deviation   {told.rms[0]:.5g} rms",
        f"  error / claimed     {_with(score.rms)}",
    ]


def _stated_deviation(part: Table, name: str) -> Floats:
    deviation: Floats = np.sqrt(part[f"cov.{name}.{name}"])
    return deviation


def _with(value: tuple[float, float]) -> str:
    """A value with half of its interval, to two digits of that."""
    middle, half = value
    if not (half > 0 and np.isfinite(half)):
        return f"{middle:.5g}"
    digits = max(0, 1 - int(np.floor(np.log10(half))))
    return f"{middle:.{digits}f} +- {half:.{digits}f}"


def _hash(text: bytes) -> str:
    return hashlib.sha256(text).hexdigest()[:16]
