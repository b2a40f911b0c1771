"""What a non-orthogonality means as an angle.

Of two axes i and j that lean towards each other alike, a_i . a_j = c_ij + c_ji = 2 c: they are 90 deg - 2 c apart. Who
leaves the one axis where it is gives all of 2 c to the other, as triangular matrices of other programs do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from insenv.effects.triad import NonOrthogonality
from insenv.identify.findings import Estimate

#: Standard deviations from which on an angle is told.
TOLD = 3.0


def apart(effect: str, axis: str, rows: Sequence[Estimate]) -> str:
    """How far ``axis`` is apart from the others, by the coefficients of a non-orthogonality on it; else empty."""
    if effect != NonOrthogonality.id:
        return ""
    told = [row for row in rows if abs(row.value) > TOLD * row.sd > 0]
    return ", ".join(
        f"{axis} and {row.parameter.removeprefix('c_')} are {90 - 2 * np.rad2deg(row.value):.3f} ± "
        f"{2 * np.rad2deg(row.sd):.2g} deg apart ({2 * row.value:.3g} if one of them leans alone)"
        for row in told
    )
