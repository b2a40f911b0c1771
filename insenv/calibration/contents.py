"""What stands in a calibration; all numbers SI.

Of a parameter: ``value``, ``sd``, ``unit``, and where it stands in the covariance of its target.
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from insenv.core.plugins import EFFECTS, check_code, names
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, Effect
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


class Contents(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What stands in a calibration.

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
