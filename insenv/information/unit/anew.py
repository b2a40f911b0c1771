r"""When a linear model of a unit is made anew about what was found: products of two errors, and how often.

An axis that is off by theta on a unit that is mounted, or turned, by eta askew feels theta eta of gravity. What is
linear in both leaves that out. It is right where the product hides in the noise of a rest; where it does not, the model
is linearised about the estimate each time the recording has grown by half: Gauss-Newton, at so many times that all of
them cost as much as the last three.
Source: Bell and Cathey, The iterated Kalman filter update as a Gauss-Newton method, IEEE Trans. Automatic Control 38
(1993) 294.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from insenv.core.estimate import Datasheet
from insenv.core.unit.motion import ACCELEROMETERS, UNIT
from insenv.information.means import stated_noises
from insenv.information.unit.calibration import BLOCK, REST, nuisance, sought

#: Share of the noise of a rest in which products hide.
_HIDDEN = 0.1
#: Blocks after which the model is first made anew, and by how much a recording grows until it is again.
FIRST, _GROWTH = 20, 1.5


def products_show(sheet: Datasheet) -> bool:
    """Whether products of the unit's errors, with each other and the mounting, show beside the noise of a rest."""
    gravity, table = sheet.site.gravity, sheet.mounting.gimbals
    if gravity is None or table is None:
        return False
    unit = max(_size(q.sd for q in sought(sheet) if q.name.startswith(target) and q.unit == "1") for target in UNIT)
    mounting = _size(q.sd for q in nuisance(table) if q.name.startswith("mounting."))
    return (unit + mounting) * unit * gravity > hidden(sheet)


def hidden(sheet: Datasheet) -> float:
    """What the noise of a rest hides of a specific force [m/s^2]."""
    rest = np.array([0, REST])
    variances = [
        sum(n.coefficient**2 * float(n.effect.covariance(rest, BLOCK)[0, 0]) for n in stated_noises(sheet, target))
        for target in ACCELEROMETERS
    ]
    return float(_HIDDEN * np.sqrt(min(variances)))


def after(count: int) -> int:
    """Number of blocks at which a model that was made anew at ``count`` is again."""
    return int(np.ceil(_GROWTH * count))


def _size(deviations: Any) -> float:
    return float(np.sqrt(sum(sd**2 for sd in deviations)))
