"""Laid-out recordings as their owners' files have them, and altered copies: columns in the file's own units.

What a reader makes of a file is left to the reader: the copy is an `npz` of the columns that the manifest names, and a
manifest that differs in nothing but where they lie. So a clock, a rounding, a hold stay what they were.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.units import scale_to_si
from insenv.data.load import columns
from insenv.data.manifest import Manifest, load_manifest
from insenv.data.manifest.spec import CHANNELS, INCREMENTS
from insenv.data.readers import read_table

Floats = NDArray[np.float64]
NANOSECONDS = "nanoseconds"
#: Readings that stay as they are in so large a share of the rows are held, not rounded.
HELD = 0.5


@dataclass(frozen=True)
class Run:
    """One file: its columns by channel, shape (n,), its labels, and the units that it states itself."""

    values: Mapping[str, Floats]
    labels: Mapping[str, list[str]]
    units: Mapping[str, str]
    quantity: str
    t: Floats | None

    def __len__(self) -> int:
        return max(map(len, self.values.values()))

    def of_rows(self, start: int, stop: int) -> Run:
        """Some of its rows."""
        rows = slice(start, stop)
        values = {name: column[rows] for name, column in self.values.items()}
        labels = {name: column[rows] for name, column in self.labels.items()}
        return replace(self, values=values, labels=labels, t=None if self.t is None else self.t[rows])


@dataclass(frozen=True)
class Kept:
    """A recording as it was kept: the words of its manifest and its files."""

    text: Mapping[str, Any]
    manifest: Manifest
    runs: tuple[Run, ...]

    @property
    def targets(self) -> tuple[str, ...]:
        """Channels that are to be explained."""
        return self.manifest.model.targets

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that the manifest names."""
        return tuple(self.manifest.channels)

    def time(self, run: Run) -> Floats:
        """Times of the rows [s], increasing, whatever the stamps say."""
        n, spec = len(run), self.manifest.channels.get("time")
        if run.t is not None:
            t = run.t
        elif spec is None or spec.rate is not None or spec.column == "row":
            t = np.arange(n) / (1.0 if spec is None or spec.rate is None else spec.rate)
        else:
            t = self._factor("time", run)[0] * run.values["time"]
            t = t + 1e-9 * run.values[NANOSECONDS] if NANOSECONDS in run.values else t
        t = t - t[0]
        step = float(np.median(np.diff(t)))
        if not (np.diff(t) > -1e-12).all() or step <= 0.0 or np.ptp(t) > 20.0 * step * n:
            period = step if step > 0.0 else float(np.ptp(t)) / n
            return np.asarray(period * np.arange(n))
        return np.asarray(t + 1e-9 * step * np.arange(n))

    def si(self, run: Run, name: str) -> Floats:
        """A channel in SI units, an increment as a rate."""
        factor, offset, per = self._scale(name, run)
        return np.asarray((factor * (run.values[name] - self.manifest.channels[name].offset) + offset) / per)

    def with_si(self, run: Run, given: Mapping[str, Floats], whole: bool = False) -> Run:
        """The run with channels of these values, rounded as the file rounds them.

        What rounding took of a number is not known: it lies anywhere within half a step, the same for as long as the
        number is held. ``whole`` values are rounded as they are: the rail of an instrument is one number.
        """
        values, rng = dict(run.values), np.random.default_rng(len(run))
        for name, si in given.items():
            factor, offset, per = self._scale(name, run)
            was, raw = run.values[name], (si * per - offset) / factor + self.manifest.channels[name].offset
            step = step_of(was)
            if step and not whole:
                taken = rng.uniform(-0.5, 0.5, was.size)
                raw = raw + step * (taken[renewed(was)] if held(was) else taken)
            values[name] = step * np.round(raw / step) if step else raw
        return replace(run, values=values)

    def _scale(self, name: str, run: Run) -> tuple[float, float, float]:
        spec = self.manifest.channels[name]
        summed = (spec.quantity or (run.quantity if CHANNELS[name] in INCREMENTS else "rate")) == "increment"
        factor, offset = self._factor(name, run, INCREMENTS[CHANNELS[name]] if summed else CHANNELS[name])
        return factor, offset, float(np.median(np.diff(self.time(run)))) if summed else 1.0

    def _factor(self, name: str, run: Run, dimension: str = "") -> tuple[float, float]:
        unit = self.manifest.channels[name].unit or run.units[name]
        return scale_to_si(unit, dimension or CHANNELS[name], name)


def step_of(x: Floats) -> float:
    """By how much neighbouring numbers of a column differ at least, if all are whole multiples of it; else 0."""
    levels = np.unique(x[np.isfinite(x)])
    if not 1 < levels.size < 0.5 * x.size:
        return 0.0
    step = float(np.min(np.diff(levels)))
    off = np.abs(levels / step - np.round(levels / step))
    return step if step > 1e-9 * float(np.max(np.abs(levels))) and float(np.max(off)) < 0.05 else 0.0


def held(x: Floats) -> bool:
    """Whether a column repeats its numbers because it is renewed more seldom than read."""
    steps = np.diff(x)
    again = steps == 0
    if again.mean() < HELD or again.all():
        return False
    step = step_of(x)
    return not step or float(np.median(np.abs(steps[~again]))) > 3.0 * step


def renewed(x: Floats) -> NDArray[np.int64]:
    """Of each row the row at which its number was renewed."""
    fresh = np.append(True, np.diff(x) != 0)
    return np.maximum.accumulate(np.where(fresh, np.arange(x.size), 0))


def read(path: Path) -> Kept:
    """The recording of a laid-out manifest; of one file the rows alone that it uses, where they are one piece."""
    manifest = load_manifest(path)
    text, runs = tomllib.loads(path.read_text(encoding="utf-8")), tuple(_runs(manifest))
    if len(runs) == 1 and len(manifest.fit_rows) == 1:
        text["fit"] = {key: value for key, value in text["fit"].items() if key != "rows"}
        runs = (runs[0].of_rows(*manifest.fit_rows[0]),)
    return Kept(text, manifest, runs)


def alters_what_is_used(case: Path, untouched: Path) -> bool:
    """Whether a copy is another one in rows that its manifest uses: an effect behind them is nobody's to see."""
    rows = load_manifest(case / "case.toml").fit_rows
    if not rows:
        return True
    with np.load(case / "run1.npz") as new, np.load(untouched / "run1.npz") as old:
        return any(np.any(new[name][a:b] != old[name][a:b]) for name in new.files for a, b in rows)


def _runs(manifest: Manifest) -> Iterator[Run]:
    for run in manifest.runs:
        table = read_table(run, columns(manifest), manifest.columns)
        values, units = dict(table.values), dict(table.units)
        for spec in {s.file: s for s in manifest.channels.values() if s.file is not None}.values():
            assert spec.file is not None
            beside = replace(run, file=spec.file, format=spec.format)
            other = read_table(beside, columns(manifest, spec.file), manifest.columns)
            values, units = values | dict(other.values), units | dict(other.units)
        units |= dict.fromkeys(table.stamped, "s")
        labels = {name: list(each) for name, each in table.labels.items()}
        yield Run(values, labels, units, table.quantity, table.t)


def written(kept: Kept, folder: Path) -> Path:
    """The files of a recording and its manifest; the manifest's path."""
    text = {k: v for k, v in kept.text.items() if k not in ("data", "runs", "format", "columns", "read", "channels")}
    runs = []
    for k, (run, given) in enumerate(zip(kept.runs, _given(kept.text), strict=True), start=1):
        held_ = {name: np.asarray(v) for name, v in run.values.items()}
        held_ |= {name: np.asarray(v) for name, v in run.labels.items()}
        held_ |= {} if run.t is None else {"time": run.t}
        np.savez(folder / f"run{k}.npz", **held_)  # type: ignore[arg-type]
        runs.append({**given, "file": f"run{k}.npz"})
    lines = [f"{key} = {_value(value)}" for key, value in text.items() if not isinstance(value, dict)]
    for key, value in text.items():
        if isinstance(value, dict):
            lines += [f"[{key}]", *(f"{k} = {_value(v)}" for k, v in value.items())]
    lines += ["[channels]", *(f"{n} = {_value(c)}" for n, c in _channels(kept).items())]
    for run_ in runs:
        lines += ["[[runs]]", *(f"{k} = {_value(v)}" for k, v in run_.items())]
    (folder / "case.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder / "case.toml"


def _given(text: Mapping[str, Any]) -> list[dict[str, Any]]:
    """What each run of a manifest says of itself."""
    if "runs" in text:
        return [dict(run) for run in text["runs"]]
    files = [text["data"]] if isinstance(text["data"], str) else text["data"]
    return [{"file": file, "label": Path(file).name} for file in files]


def _channels(kept: Kept) -> dict[str, dict[str, Any]]:
    told: Mapping[str, Any] = kept.text.get("channels", {})
    first, out = kept.runs[0], {}
    for name in kept.channels:
        own = {k: v for k, v in told.get(name, {}).items() if k not in ("column", "file")}
        if name in first.values or name in first.labels or (name == "time" and first.t is not None):
            own["column"] = name
            if name in first.units and "unit" not in own:
                own["unit"] = first.units[name]
            if "nanoseconds" in own:
                own["nanoseconds"] = NANOSECONDS
            if name == "time" and first.t is not None:
                own["unit"] = "s"
        elif "column" in told.get(name, {}):
            own["column"] = told[name]["column"]
        if first.quantity == "increment" and CHANNELS[name] in INCREMENTS and name in first.values:
            own.setdefault("quantity", "increment")
        if own:  # a time that nobody gave is that of the rows
            out[name] = own
    return out


def _value(value: Any) -> str:
    """A value as TOML writes it, on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{k} = {_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return json.dumps(value, ensure_ascii=False)
