r"""Rates that deviate from the line, by a rule that is stated beforehand.

The dwells of all power-ups are averaged rate by rate; z is the residual of such a
mean from the robust line in units of its standard deviation (white noise and the robust spread from setting to
setting, of all rates or of the half with the least noise, whichever is larger). A rate is flagged where |z| > 5 and
that of the opposite direction exceeds 5 too; one whose opposite was not measured where |z| > 10; and only if more than
half of the power-ups deviate to the same side. Tests with fewer than ten rates have no flags.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimators.rate_table import rate_line_fits
from insenv.core.rate_test import Flagged
from insenv.core.recording import Floats
from insenv.core.units import DEG

#: Rates nearer to each other than this [rad/s], and this share, are the same one of several power-ups.
SAME, SAME_SHARE = 0.02 * DEG, 1e-3
#: Limits of |z| for a pair of directions, and for one alone; fewest rates.
PAIR, ALONE, FEWEST = 5.0, 10.0, 10
#: More than the share of sound tests in which a rate is flagged. Simulated, 1e5 tests each of the published 34 rates
#: with one turn: white noise of 0.12 deg/sqrt(h) and an independent Gaussian spread from setting to setting of 0 to 5
#: deg/h, of which 1 deg/h has the most, 0.9e-3 (with every rate alone: 0.5e-3). Without any spread: none in 1e5.
FALSE_ALARM = 1e-3
RULE = (
    f"a rate is flagged if its mean over the power-ups is more than {PAIR:g} standard deviations off the robust line "
    f"in both directions ({ALONE:g} where the opposite was not measured) and more than half of the power-ups deviate "
    f"to the same side; the deviation is that of white noise and of the robust spread from setting to setting; with "
    f"fewer than {FEWEST} rates nothing is flagged"
)


def same(a: Floats | float, b: Floats | float) -> NDArray[np.bool_]:
    """Whether two rates [rad/s] are the same one, commanded anew."""
    return np.asarray(np.abs(np.subtract(a, b)) <= SAME + SAME_SHARE * np.abs(a))


def flags(rates: Floats, measured: tuple[Floats, Floats, Floats], table: Floats, tukey: Floats) -> tuple[Flagged, ...]:
    """The rates that deviate by the rule.

    Parameters
    ----------
    rates : ndarray, shape (m,)
        [rad/s]
    measured : tuple
        Mean outputs, shape (m,), variances of their noise, shape (m,), variance from setting to setting.
    table : ndarray, shape (power-ups, m)
        Outputs of each power-up; NaN: none.
    tukey : ndarray, shape (m,)
        Weights of the robust line.
    """
    if len(rates) < FEWEST:
        return ()
    means, white, d = measured
    fit = rate_line_fits.line(rates, means, tukey, white)
    left = fit.residual(rates, means)
    quiet = rate_line_fits.setting_spread(left, white, white <= np.median(white))
    z = left / np.sqrt(white + np.maximum(d, quiet) + 1e-30)
    each = table - fit.k * rates - fit.f0
    each = each - np.nanmedian(each, axis=1)[:, None]
    same_side = np.nansum(np.sign(each) == np.sign(left), axis=0) > 0.5 * np.isfinite(each).sum(axis=0)
    found = []
    for j, rate in enumerate(rates):
        other = int(np.abs(rates + rate).argmin())
        paired = other != j and bool(same(rates[other], -rate))
        strong = min(abs(z[j]), abs(z[other])) > PAIR if paired else abs(z[j]) > ALONE
        if strong and same_side[j]:
            found.append(Flagged(float(rate), float(left[j]), float(z[j])))
    return tuple(found)
