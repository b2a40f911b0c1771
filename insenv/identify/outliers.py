"""Single bins that nothing at rest explains: knocks, dropped words of a data link.

A bin is an outlier if it lies further than `FAR` robust deviations from the median of its neighbours. A step, a ramp
or a slow effect moves the neighbours along, so it is none. Only recordings without a turning table are searched: where
the rate changes, single bins are the evidence of timing.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

from insenv.core.recording import Floats
from insenv.identify.bins import Block

#: Robust standard deviations; a Gaussian bin is that far out with probability 1e-15.
FAR = 8.0
#: Bins whose median a bin is compared with.
NEIGHBOURS = 9
#: Largest share of bins that may be outliers: more of them are how the instrument is.
MOST = 0.01


def outliers(y: Floats, blocks: tuple[Block, ...]) -> tuple[int, ...]:
    """Indices of outlying bins of the fitted blocks."""
    found: list[int] = []
    for block in blocks:
        if not block.fitted or block.n < 4 * NEIGHBOURS:
            continue
        x = y[block.start : block.stop]
        left = x - median_filter(x, size=NEIGHBOURS, mode="reflect")
        scale = 1.4826 * float(np.median(np.abs(left - np.median(left))))
        if scale > 0:
            found += (block.start + np.flatnonzero(np.abs(left) > FAR * scale)).tolist()
    fitted = sum(b.n for b in blocks if b.fitted)
    return tuple(found) if len(found) <= MOST * fitted else ()
