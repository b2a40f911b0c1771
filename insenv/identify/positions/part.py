"""What the parts of a triad's problem have in common: what is declared and tried, and whether units bear it out.

The accelerometers of all rests are one part, the gyros' rotations from rest to rest another, and the means of each gyro
at rest a third.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.core.units import STANDARD_GRAVITY
from insenv.data.manifest import Manifest
from insenv.effects.base import Effect
from insenv.effects.bias import Bias, BiasDrift
from insenv.effects.catalogue import by_key
from insenv.effects.cross import CrossAxis, GSensitivity
from insenv.effects.rate.scale import ScaleFactor, ScaleFactorTemperature
from insenv.effects.thermal import BiasTemperature
from insenv.effects.triad import AccelBias, AccelScaleFactor, Misalignment, NonOrthogonality
from insenv.identify.findings import NotTestable
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes
from insenv.identify.positions.evidence import held_out_errors, held_out_scatter
from insenv.identify.positions.gyros.means import RestMeans
from insenv.identify.positions.gyros.rotations import Rotations
from insenv.identify.positions.least_squares import Fit, in_turn
from insenv.identify.positions.model import Surroundings, TriadTerm
from insenv.identify.positions.rests import Rest, middle_times
from insenv.identify.positions.search import LEAST_FREEDOM, Outcome

#: Effects of each part that may be declared. Those that are not are tried, but for what is slow on gyros at rest: a
#: bias that walks there looks like a drift.
OF_ACCELEROMETERS = (
    AccelBias.id,
    AccelScaleFactor.id,
    NonOrthogonality.id,
    BiasDrift.id,
    BiasTemperature.id,
    ScaleFactorTemperature.id,
)
OF_ROTATIONS = (ScaleFactor.id, NonOrthogonality.id, Misalignment.id)
OF_RESTS = (GSensitivity.id, BiasDrift.id, BiasTemperature.id)
SLOW = (BiasDrift.id, BiasTemperature.id)
#: May be declared of the rotations, and is not tried: non-orthogonality and misalignment are its parts.
WHOLE = CrossAxis.id
#: Error of the magnitude of gravity that no unit at rest has, beside all that was found [m/s^2].
NO_REST = 0.5


@dataclass(frozen=True)
class Part:
    """One problem, and what its search came to; ``parted`` are effects of which an axis, or more, is not told."""

    problem: Magnitudes | Rotations | RestMeans
    outcome: Outcome
    reasons: tuple[str, ...]
    parted: tuple[TriadTerm, ...] = ()


def surroundings(manifest: Manifest, recordings: Sequence[Recording], rests: Sequence[Rest]) -> Surroundings:
    """Time and temperature of the rests."""
    temperature = None
    if all("temperature" in r.channels for r in recordings):
        temperature = np.array([recordings[r.run].channels["temperature"].values[r.rows].mean() for r in rests])
    return Surroundings(middle_times(recordings, rests), temperature, manifest.model.reference_temperature)


def declared_of(manifest: Manifest, prefix: str) -> list[Effect]:
    """Declared effects that are meant for this triad, in their order."""
    allowed = {
        "accel": OF_ACCELEROMETERS,
        "gyro": (Bias.id, *OF_ROTATIONS, WHOLE, *OF_RESTS),
    }
    both = {t.partition("_")[0] for t in manifest.model.targets}
    known = {key for name in both for key in (*allowed[name], Bias.id)}
    effects = []
    for key in manifest.model.declared:
        effect = by_key(key)
        if effect.id not in known:
            names = ", ".join(sorted(known))
            where = f"{manifest.path}: model.declared has {key!r}"
            raise InputError(f"{where}; of {', '.join(sorted(both))} in several positions wanted some of {names}")
        if effect.id == Bias.id and prefix == "accel":
            if AccelBias.id in manifest.model.declared:
                continue
            effect = AccelBias()
        if effect.id in allowed[prefix]:
            effects.append(effect)
    return effects


def candidates(
    allowed: tuple[str, ...], declared: Sequence[Effect], around: Surroundings, keys: tuple[str, ...] | None
) -> tuple[list[Effect], tuple[NotTestable, ...]]:
    """Effects to try beside the declared ones, and those that lack a channel."""
    there = {effect.key for effect in declared}
    tried, blind = [], []
    for effect in map(by_key, allowed):
        names = {effect.key, effect.id} | ({Bias.id} if effect.id == AccelBias.id else set())
        if effect.key in there or any(e.id == WHOLE for e in declared) and effect.id != ScaleFactor.id:
            continue
        if keys is not None and not names & set(keys):
            continue
        if "temperature" in effect.needs and around.temperature is None:
            blind.append(NotTestable(effect.key, ("temperature",), "the recording has no such channel"))
        else:
            tried.append(effect)
    return tried, tuple(blind)


def enough(
    manifest: Manifest, problem: Magnitudes | Rotations, size: int, units: str, told: tuple[int, str] | None = None
) -> None:
    """Refuse fewer rests than the declared model can be fitted to.

    ``told`` are the attitudes of them, of which parts are none, and what else would do.
    """
    count = int(problem.fitted.sum())
    least = -(-(size + LEAST_FREEDOM) // problem.rank)
    silent = "" if in_turn(problem) else ", or no [held_out] at all: each is then held out in its turn"
    distinct, instead = (count, "") if told is None else told
    if told is not None and distinct * problem.rank < size:
        found = f"{distinct} {units} for {size} declared parameters"
        raise InputError(f"{manifest.path}: {found}; wanted at least {-(-size // problem.rank)} attitudes")
    if count < least:
        found = f"{count} {units} to fit for {size} declared parameters"
        raise InputError(f"{manifest.path}: {found}; wanted at least {least} that are not held out{silent or instead}")


def structure(
    problem: Magnitudes | Rotations | RestMeans, fit: Fit, alpha: float, units: str, freedom: int | None = None
) -> tuple[str, ...]:
    """Whether the held-out units scatter as the fitted ones foretell; a sentence where they do not.

    ``freedom`` is that of the noise, that of the fit if None.
    """
    if isinstance(problem, Magnitudes) and (error := held_out_errors(problem, fit)[0]) > NO_REST:
        share = error / STANDARD_GRAVITY
        return (f"rests miss gravity by {error:.2g} m/s^2 ({share:.0%}): the unit moved, or an axis reads no force",)
    if in_turn(problem):
        return ()  # all are fitted, and each is foretold by all others
    freedom = fit.freedom if freedom is None else freedom
    if freedom < 1 or not fit.variance > 0:
        return ()
    ratio, count = held_out_scatter(problem, fit, problem.held_out, fit.variance)
    p = float(fdtrc(count, freedom, ratio))
    if p >= alpha:
        return ()
    return (f"held-out {units} scatter {np.sqrt(ratio):.3g} times as much as the fitted ones foretell (p = {p:.1e})",)
