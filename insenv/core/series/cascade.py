"""A filter in sections of second order, one after another.

In transposed direct form II, for each sample x of a row,

    y = b0 x + s0,    s0 = b1 x - a1 y + s1,    s1 = b2 x - a2 y

and each y the x of the next section. As `scipy.signal.sosfilt`, bit for bit; `scipy.signal` takes a second to import,
which every process that simulates would spend.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np

from insenv.core.compiled import patient
from insenv.core.recording import Floats


def cascade(sections: Floats, x: Floats, state: Floats | None = None) -> tuple[Floats, Floats]:
    """Filter ``x``, shape (..., n), by ``sections``, shape (sections, 6) as SciPy has them.

    ``state`` has the shape (..., sections, 2), at rest if it is not given. Returned are y, of the shape of x, and the
    state after it.
    """
    shape = (*x.shape[:-1], len(sections), 2)
    after = np.zeros(shape) if state is None else np.array(np.broadcast_to(state, shape))
    y = np.array(x, dtype=np.float64, order="C")
    rows = math.prod(x.shape[:-1])
    _filtered(np.ascontiguousarray(sections), y.reshape(rows, x.shape[-1]), after.reshape(rows, *shape[-2:]))
    return y, after


@patient
def _filtered(sections, y, state):
    for row in range(y.shape[0]):
        for k in range(y.shape[1]):
            value = y[row, k]
            for j in range(sections.shape[0]):
                new = sections[j, 0] * value + state[row, j, 0]
                state[row, j, 0] = sections[j, 1] * value - sections[j, 4] * new + state[row, j, 1]
                state[row, j, 1] = sections[j, 2] * value - sections[j, 5] * new
                value = new
            y[row, k] = value
