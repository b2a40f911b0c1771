"""Fitted gains that need not be a gyro's: larger than any is, or as a clock would make it.

Errors of a reference make a gain smaller, and none larger; rows in bunches, lost or late, with stamps of a printing and
not of a measurement, do, where means over the whole record did not tell it. And a gyro beside an angle, or turned from
rest to rest, is integrated over the time that the rows are said to take: where that is wrong by a share, every gyro of
the file has a scale factor of that share, and no instrument has it.
"""

from __future__ import annotations

from collections.abc import Mapping

from insenv.data.manifest.spec import Manifest
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


def clock_cautions(manifest: Manifest, found: Findings) -> Mapping[str, tuple[str, ...]]:
    """A caution for each gyro of which a scale factor was found, where the rate of the rows is but stated."""
    time = manifest.channels.get("time")
    integrated = manifest.procedure == "multi-position" or "table_angle" in manifest.channels
    if time is None or time.rate is None or not integrated:
        return {}
    said = (
        f"The rate of the rows is stated, {time.rate:.6g} Hz, and was not recorded: where it is wrong by a share, "
        "every gyro has a scale factor of that share.",
    )
    gains = [t.target for t in found.targets if any(a.effect == ScaleFactor.id for a in t.added)]
    return {target: said for target in gains if target.startswith("gyro")}
