"""A fitted gain that no gyro has, where means over the whole record did not tell it: rows in bunches, lost or late.

Errors of a reference make a gain smaller, and none larger; stamps of a printing, not of a measurement, do.
"""

from __future__ import annotations

from collections.abc import Mapping

from insenv.effects.rate.scale import ScaleFactor
from insenv.identify.clean.plausibility import INCREDIBLE, SURE
from insenv.identify.findings import Findings, TargetFindings


def gain_cautions(found: Findings, doubts: Mapping[str, tuple[str, ...]]) -> Mapping[str, tuple[str, ...]]:
    """A caution for each gyro whose fitted scale factor is larger than any is, where ``doubts`` have none of it yet."""
    far = [t for t in found.targets if t.target.startswith("gyro") and not doubts.get(t.target)]
    return {t.target: (_sentence(t.target, gain),) for t in far if (gain := _too_large(t)) is not None}


def _too_large(target: TargetFindings) -> float | None:
    """The fitted gain, if it is surely further above 1 than any gyro's."""
    for one in target.estimates_after:
        if one.effect == ScaleFactor.id:
            size = abs(1.0 + one.value)
            return 1.0 + one.value if size - SURE * one.sd > 1.0 + INCREDIBLE else None
    return None


def _sentence(target: str, gain: float) -> str:
    return (
        f"{target} reads {gain:.3g} times the rate that it was exposed to by the fitted rows, further from 1 than any "
        "gyro is, though means over the whole record do not say so: check the unit, the range setting and the time "
        "stamps, which a printer or a serial port may have given."
    )
