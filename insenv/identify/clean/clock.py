"""What a clock would make: where the rate of the rows is stated and not recorded, it scales what is integrated.

A gyro beside an angle, or turned from rest to rest, is integrated over the time that the rows are said to take. Where
that is wrong by a share, every gyro of the file has a scale factor of that share, and no instrument has it.
"""

from __future__ import annotations

from collections.abc import Mapping

from insenv.data.manifest.spec import Manifest
from insenv.effects.rate.scale import ScaleFactor
from insenv.identify.findings import Findings


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
