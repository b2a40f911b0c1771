"""What the check of the Earth rate's magnitude adds to the findings: a suspect, reasons, cautions, the azimuth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from insenv.core.units import ARCSEC, DEG_PER_HOUR
from insenv.effects.angle import AngleLockedRate, EarthRate, EncoderHarmonic, MagneticField
from insenv.effects.base import OUTPUT
from insenv.identify.earth.hidden import Hidden, hidden
from insenv.identify.findings import Added, Derived, Estimate
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.heldout import Score
from insenv.identify.fit.problem import Problem
from insenv.identify.search.earth_rate import Check, Horizontal, check, horizontal
from insenv.identify.search.tracks import Track

#: Effects that a caution names even where they were not to be tried.
SUSPECTS = (EncoderHarmonic(1), AngleLockedRate(1), MagneticField())
#: SI unit -> a small amount of it to show the harm of, as text and in SI.
_SMALL = {"rad": ("1 arcsec", ARCSEC), "rad/s": ("0.001 deg/h", 1e-3 * DEG_PER_HOUR)}


@dataclass(frozen=True)
class EarthFindings:
    """What is known of the horizontal Earth rate at the end of a search.

    Attributes
    ----------
    check : Check or None
        None where the magnitude could not be judged, or a declared effect may be what departs.
    departs : bool
        Whether it is not what latitude and tilt make it.
    suspects : tuple of Hidden
        Effects that may be what departs, the likeliest to be named first.
    untold : tuple of Hidden
        Effects that this recording does not tell from the Earth rate, whether it departs or not.
    """

    check: Check | None
    departs: bool
    suspects: tuple[Hidden, ...]
    untold: tuple[Hidden, ...]


def earth_findings(track: Track, alpha: float) -> EarthFindings:
    """Check the final fit of a track."""
    problem, fit = track.problem, track.fit
    inside = {term.effect.key for term in fit.model}
    tried = tuple(c.effect for c in track.candidates if not c.generic and c.effect.key not in inside)
    always = (e for e in SUSPECTS if e.key not in inside | {e.key for e in tried})
    lost = {key for key, _ in fit.design.dropped}
    declared = tuple(t.effect for t in fit.model if t.effect.key in lost and not t.effect.of_earth)
    untold = hidden(problem, fit, (*declared, *tried, *always), None)
    found = check(problem, fit, track.level, track.family)
    departs = found is not None and found.p_value < alpha
    if found is None or not departs or hidden(problem, fit, declared, None):
        # A declared effect that the recording does not tell from the Earth rate is no news: it may be all of it.
        return EarthFindings(None if departs else found, False, (), untold)
    # Where turning has told the others, what stands with the Earth is left.
    suspects = hidden(problem, fit, tried, found.level) or hidden(problem, fit, (MagneticField(),), found.level)
    return EarthFindings(found, True, suspects, untold)


def suspected(found: EarthFindings, score: Score) -> tuple[Added, ...]:
    """The first suspect with the others as its rivals; nothing where the magnitude agrees."""
    if not found.suspects or found.check is None:
        return ()
    first, *others = found.suspects
    effect = first.effect
    small, size = _SMALL.get(_unit(first), ("1", 1.0))
    least, sd, unit = first.least / size, first.least_sd / size, small.partition(" ")[2]
    if unit == "deg/h":
        least, sd = 1e-3 * least, 1e-3 * sd
    remark = (
        f"no residual shows it, the magnitude of the Earth rate does: at least {least:.3g} ± {sd:.1g} {unit}; its part "
        "across the Earth rate is not known. The tilt of the mount or the latitude may be wrong instead"
    )
    return (
        Added(
            effect=effect.id,
            order=getattr(effect, "order", None),
            parameters=tuple(
                Estimate(effect.key, p.name, float(value), float(width), p.unit.replace(OUTPUT, "rad/s"))
                for p, value, width in zip(effect.linear, first.theta, first.sd, strict=True)
            ),
            p_value=found.check.p_value,
            likelihood_ratio=found.check.deviate**2,
            confounded_with=tuple(one.effect.key for one in others) or (EarthRate.id,),
            held_out_before=score.rms,
            held_out_after=score.rms,
            remark=remark,
            indirect=True,
        ),
    )


def reasons(found: EarthFindings) -> tuple[str, ...]:
    """Why the magnitude is not taken for that of the Earth, and which error of latitude or tilt would do as well."""
    if not found.departs or found.check is None:
        return ()
    c = found.check
    fitted, due = c.earth.magnitude / DEG_PER_HOUR, c.level.value / DEG_PER_HOUR
    sd = c.sd / DEG_PER_HOUR
    places = max(0, 1 - int(np.floor(np.log10(sd))))
    others = [
        f"a {what} of {_beside(other, given)} instead of {np.rad2deg(given):.6g} deg"
        for what, other, given in (("latitude", c.latitude, c.level.latitude), ("tilt", c.tilt, c.level.tilt))
        if np.isfinite(other)
    ]
    said = (
        f"the horizontal Earth rate comes out as {fitted:.{places}f} deg/h where latitude and tilt make it "
        f"{due:.{places}f} deg/h, {abs(c.deviate):.3g} standard deviations off (p = {c.p_value:.1g})",
    )
    return (*said, f"{' or '.join(others)} would explain that as well") if others else said


def _beside(other: float, given: float) -> str:
    """An angle in degrees, to two digits of its distance from another."""
    away = abs(np.rad2deg(other - given))
    return f"{np.rad2deg(other):.{max(0, 1 - int(np.floor(np.log10(max(away, 1e-9)))))}f}"


def cautions(found: EarthFindings) -> tuple[str, ...]:
    """That the azimuth may be off by more than its standard deviation, and by how much for how little."""
    if not found.untold:
        return ()
    magnitude = found.untold[0].earth.magnitude if found.check is None else found.check.level.value
    parts = []
    for one in found.untold:
        small, size = _SMALL.get(_unit(one), (f"1 {_unit(one)}", 1.0))
        parts.append(f"{small} of {one.effect.key} by up to {one.turns / magnitude * size / ARCSEC:.4g} arcsec")
    if found.departs:
        bound = "The departure of the magnitude does not bound this error: it shows only the part along the Earth rate."
    elif found.check is not None:
        bound = "That the magnitude agrees does not bound this error: it shows only the part along the Earth rate."
    else:
        bound = "Nothing in this recording bounds this error."
    turned = ", ".join(parts)
    field = (
        " No turning of table or base tells the field of the place, which stands with the Earth: shielding, another "
        "place or a second gyro does."
        if any(one.effect.id == MagneticField.id for one in found.untold)
        else ""
    )
    return (
        f"The azimuth may be off by more than its standard deviation, for this recording cannot tell what turns it: "
        f"{turned}. {bound}{field}",
    )


def with_earth(estimates: Sequence[Estimate], found: EarthFindings) -> list[Estimate]:
    """The estimates with those of the Earth rate as they are beside the first suspect."""
    if not found.suspects:
        return list(estimates)
    earth = found.suspects[0].earth
    sd = np.sqrt(np.diag(earth.cov))
    own = [i for i, e in enumerate(estimates) if e.effect == EarthRate.id]
    changed = list(estimates)
    for i, value, width in zip(own, earth.theta, sd, strict=True):
        changed[i] = replace(estimates[i], value=float(value), sd=float(width))
    return changed


def derived(plain: Problem, before: Fit, track: Track, found: EarthFindings) -> tuple[Derived, ...]:
    """The azimuth of the input axis at table angle 0, before and after."""
    first = horizontal(plain, before)
    last = found.suspects[0].earth if found.suspects else horizontal(track.problem, track.fit)
    if first is None or last is None:
        return ()
    return (Derived("azimuth", "rad", _azimuth(first), _azimuth(last)),)


def _azimuth(earth: Horizontal) -> Estimate:
    return Estimate(EarthRate.id, "azimuth", earth.azimuth, earth.azimuth_sd, "rad")


def _unit(one: Hidden) -> str:
    return one.effect.linear[0].unit.replace(OUTPUT, "rad/s")
