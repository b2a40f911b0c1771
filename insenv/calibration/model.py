"""A calibration and its file, JSON of the schema ``insenv.calibration/1``."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from insenv.calibration.apply import Applied, apply
from insenv.calibration.contents import HELD, LINE, Contents, Parameter, Target, Term
from insenv.core.errors import InputError
from insenv.core.files import write_whole
from insenv.core.recording import Recording
from insenv.data.manifest.schema import convert
from insenv.effects.base import OUTPUT, DrivenEffect, Effect
from insenv.effects.timing import SampleHold


class Calibration(Contents, frozen=True, forbid_unknown_fields=True):
    """What explains the readings of an instrument; its fields are those of `insenv.calibration.contents.Contents`."""

    def apply(self, recording: Recording) -> Recording:
        """The recording without what the calibration explains as an error; see `explain` for what that is.

        Raises
        ------
        InputError
            If it has none of the channels, has one in another unit, lacks the latitude, or a correction at its own
            output does not settle.
        """
        return self.explain(recording).recording

    def explain(self, recording: Recording) -> Applied:
        """As `apply`, with what was taken out, what was left, and why."""
        return apply(self, recording)

    def found(self) -> Calibration:
        """The calibration with nothing but what the loop added: what was declared stays in the readings."""
        targets = [
            msgspec.structs.replace(t, terms=[term for term in t.terms if term.origin == "added"]) for t in self.targets
        ]
        return msgspec.structs.replace(self, targets=targets)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write it to ``path``, whole or not at all.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        return write_whole(path, json.dumps(msgspec.to_builtins(self), indent=2, ensure_ascii=False) + "\n")


def load_calibration(path: str | os.PathLike[str]) -> Calibration:
    """The calibration that was written to ``path``.

    Raises
    ------
    InputError
        If it cannot be read, is no JSON, has an unknown key or a wrong value, or an effect that is not known here.
    """
    path = Path(path)
    found = convert(_tree(path), Calibration, (), path, "calibration")
    for i, target in enumerate(found.targets):
        _check_covariance(target, f"{path}: targets[{i}]")
        for j, term in enumerate(target.terms):
            _check(term, target, len(found.runs), f"{path}: targets[{i}].terms[{j}]")
    return found


def _tree(path: Path) -> Any:
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: the calibration cannot be read ({reason}); wanted a JSON file") from None
    try:
        return json.loads(content.decode("utf-8-sig"), parse_constant=_refused)
    except RecursionError:
        raise InputError(f"{path}: lists are nested too deeply; wanted a calibration in JSON") from None
    except ValueError as error:
        raise InputError(f"{path}: not JSON ({error}); wanted a file of insenv close-loop --calibration") from None


def _refused(constant: str) -> None:
    raise ValueError(f"{constant} is no number of JSON")


def _check(term: Term, target: Target, runs: int, where: str) -> None:
    """Refuse a term whose parameters are not those of its effect."""
    try:
        effect = term.made()
    except InputError as error:
        raise InputError(f"{where}.effect: {error}") from None
    if isinstance(effect, DrivenEffect):
        raise InputError(f"{where}.effect = {term.effect!r} is driven by chance; wanted effects that can be taken out")
    known = _known(term, effect)
    for k, p in enumerate(term.parameters):
        _check_parameter(p, known, target, f"{where}.parameters[{k}]")
    names = [(p.name, p.run) for p in term.parameters]
    if len(set(names)) < len(names):
        raise InputError(f"{where}.parameters names one twice; wanted each of {', '.join(known)} once")
    if any(run > runs for run in (*_of_runs(term), *term.runs)):
        raise InputError(f"{where} is of run {max((*_of_runs(term), *term.runs))}; wanted runs from 1 to {runs}")
    lacking = {p.name for p in effect.shapes} - {name for name, _ in names}
    if names and lacking and not term.is_line:
        raise InputError(f"{where}: {term.effect!r} lacks {', '.join(sorted(lacking))}; wanted all its shapes")


def _known(term: Term, effect: Effect) -> dict[str, str]:
    """Parameters that a term may have, with their units."""
    if term.is_line:
        return LINE
    own = {p.name: p.unit for p in effect.params}
    return own | HELD if effect.id == SampleHold.id else own


def _check_parameter(p: Parameter, known: dict[str, str], target: Target, place: str) -> None:
    if p.name not in known:
        raise InputError(f"{place}.name = {p.name!r}; wanted one of {', '.join(known)}")
    unit = known[p.name].replace(OUTPUT, target.unit)
    if p.unit != unit:
        raise InputError(f"{place}.unit = {p.unit!r}; wanted {unit!r}")
    sd = p.sd or 0.0
    if not (math.isfinite(p.value) and math.isfinite(sd) and sd >= 0):
        raise InputError(f"{place} has value {p.value:g} and sd {p.sd}; wanted finite numbers and no negative sd")
    if p.row is not None and p.row >= len(target.covariance):
        raise InputError(f"{place}.row = {p.row}; the covariance has {len(target.covariance)} rows")


def _of_runs(term: Term) -> Iterator[int]:
    return (p.run for p in term.parameters if p.run is not None)


def _check_covariance(target: Target, where: str) -> None:
    matrix = target.covariance
    if any(len(row) != len(matrix) for row in matrix):
        raise InputError(f"{where}.covariance has rows of other lengths; wanted {len(matrix)} numbers in each")
    if not all(math.isfinite(x) for row in matrix for x in row):
        raise InputError(f"{where}.covariance has a number that is not finite; wanted finite ones")
