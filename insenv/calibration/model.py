"""A calibration and its file, JSON of the schema ``insenv.calibration/1``; all numbers SI.

Of a parameter: ``value``, ``sd``, ``unit``, and where it stands in the covariance of its target.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from msgspec import Meta

from insenv.calibration.apply import Applied, apply
from insenv.core.errors import InputError
from insenv.core.files import write_whole
from insenv.core.plugins import EFFECTS, check_code, names
from insenv.core.recording import Floats, Recording
from insenv.data.manifest.schema import convert
from insenv.effects.base import OUTPUT, DrivenEffect, Effect
from insenv.effects.catalogue import by_key

SCHEMA: Literal["insenv.calibration/1"] = "insenv.calibration/1"
#: Parameters of a line above the bin rate: how it looks in the samples, not in interval means.
LINE = {"f": "Hz", "amplitude": OUTPUT, "phase": "rad"}
#: Of an output that is held: the time from a renewal to the start of the run, beside the effect's own.
HELD = {"phase": "s"}

Count = Annotated[int, Meta(ge=1)]
Index = Annotated[int, Meta(ge=0)]
Sha256 = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]


class Parameter(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One parameter of a term: of run ``run`` alone where it belongs to one, and row ``row`` of the covariance."""

    name: str
    value: float
    sd: float | None
    unit: str
    run: Count | None = None
    row: Index | None = None


class Term(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An effect with its parameters.

    Attributes
    ----------
    effect : str
        Its key: "encoder_harmonic:1".
    origin : "declared" or "added"
    parameters : list of Parameter
    run_dependent : bool
        Whether its parameters belong to their runs: a bias changes from one power-up to the next.
    generic : bool
        Whether it is a curve without a cause.
    fitted : bool
        Whether a residual showed it: False where its least size alone is known.
    confounded_with : list of str
        Effects that the recordings could not tell it from.
    runs : list of int
        Runs, counted from 1, that it was found in; none: in all.
    plug_in : str
        "module:Name" of an effect that is none of insenv's own.
    """

    effect: str
    origin: Literal["declared", "added"]
    parameters: list[Parameter]
    run_dependent: bool = False
    generic: bool = False
    fitted: bool = True
    confounded_with: list[str] = msgspec.field(default_factory=list)
    runs: list[Count] = msgspec.field(default_factory=list)
    plug_in: str = ""

    @property
    def is_line(self) -> bool:
        """Whether it is a line above the bin rate."""
        return any(p.name == "amplitude" for p in self.parameters)

    def made(self) -> Effect:
        """The effect.

        Raises
        ------
        InputError
            If it is not known here.
        """
        if self.plug_in and self.effect.partition(":")[0] not in names(EFFECTS):
            check_code(self.plug_in, f"the calibration's effect {self.effect!r}")
        return by_key(self.effect, self.plug_in)

    def phase(self, run: int | None) -> float:
        """How much earlier its clock started than run ``run`` [s]."""
        own = (p for p in self.parameters if p.name == "phase" and p.run in (None, run) and not self.is_line)
        return next((p.value for p in own), 0.0)

    def theta(self, run: int | None) -> Floats:
        """Its parameters in the order of the effect, for run ``run``; those that could not be told are zero."""
        of_run = {p.name: p.value for p in self.parameters if p.run in (None, run)}
        return np.array([of_run.get(p.name, 0.0) for p in self.made().params])


class Target(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The terms of one channel, in SI ``unit``, and the covariance of the parameters that have a row in it."""

    target: str
    unit: Literal["rad/s", "m/s^2"]
    verdict: str
    terms: list[Term]
    covariance: list[list[float]] = msgspec.field(default_factory=list)


class Run(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A recording that the calibration was made from.

    ``sha256`` is its fingerprint (`insenv.data.fingerprint`). ``tilt``, ``axes``, ``table_axis``, ``latitude``: how the
    instrument was mounted, and where [rad].
    """

    label: str
    sha256: Sha256
    tilt: float
    axes: str
    table_axis: str = ""
    latitude: float | None = None


class Calibration(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What explains the readings of an instrument.

    Attributes
    ----------
    schema, insenv : str
        Of the file and of the package that made it.
    title, manifest, sha256 : str
        Title, name and hash of the manifest that it was made from.
    reference_temperature : float
        T_ref of the temperature effects [K].
    with_earth : bool
        Whether the known vertical part of the Earth's rate belongs to the input: then recordings need a latitude.
    runs : list of Run
    targets : list of Target
    """

    schema: Literal["insenv.calibration/1"]
    insenv: str
    title: str
    manifest: str
    sha256: Sha256
    reference_temperature: float
    with_earth: bool
    runs: list[Run]
    targets: list[Target]

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
    return own | HELD if effect.id == "sample_hold" else own


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
