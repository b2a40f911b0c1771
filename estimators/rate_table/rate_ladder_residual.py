r"""What stands out of the smooth errors of a scale factor: suspects, alarms, and the form of a local fault.

    residual = b0 + c1 x + c2 |x| + c3 x^3 + c5 x^5 + d t + local,     x = rate / top

All but the local part is fitted robustly (Tukey's biweight), for an open-loop gyro bends over the whole range, and a
fault that tilts the line hides in it. Suspect is a rate whose residual, or the half sum or half difference with that at
the opposite rate, is more than so many of its standard deviations; these are those of the datasheet, or as much larger
as the residuals are spread (median absolute deviation). The rule stands before the data do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from insenv.core.recording import Floats
from insenv.core.series.robust import MEDIAN

#: Of the biweight, for 95 % efficiency, and its rounds.
_TUNING, _ROUNDS = 4.685, 20
#: Commanded rates this near are the same magnitude [rad/s].
_SAME = 1e-9
#: Share of the largest singular value below which the rates tell nothing: at rates of one magnitude a is a bias.
_TOLD = 1e-4
#: Chi square of two coefficients above which the error bends; of a straight one a chance of 3e-7.
_BENT = 30.0
#: Slope of the line through each term, at rates that are evenly spread.
_EVEN = np.array([0.0, 1.0, 0.0, 0.0, 3 / 5, 3 / 7])
#: Widths and centres that are tried for a fault.
_WIDTHS, _CENTRES = 40, 121


@dataclass(frozen=True)
class BellFault:
    """A local fault: centre and width (standard deviation) of its magnitude, height, with their deviations [rad/s]."""

    centre: float
    width: float
    height: float
    centre_sd: float
    width_sd: float
    height_sd: float


@dataclass(frozen=True)
class Smooth:
    """A robust fit of the smooth part; all of shape (n,).

    Attributes
    ----------
    left : ndarray
        Residual minus the smooth part [rad/s].
    sd : ndarray
        Standard deviation of each, as large as the spread demands [rad/s].
    """

    left: Floats
    sd: Floats

    @property
    def z(self) -> Floats:
        """What is left, in standard deviations."""
        return self.left / self.sd


def smooth(rate: Floats, residual: Floats, middle: Floats, variance: Floats, top: float) -> Smooth:
    """Fit the smooth part to the means of n entries, each of shape (n,); entries of infinite variance are left out."""
    sd, used = np.sqrt(variance), np.isfinite(variance)
    x = np.where(used, rate, 0.0) / top
    t = np.where(used, middle, 0.0)
    t = (t - t[used].mean()) / max(float(np.ptp(t[used])), 1.0)
    F = np.stack([np.ones_like(x), x, np.abs(x), x**3, x**5, t], axis=-1)
    y, root = np.where(used, residual, 0.0), np.where(used, 1.0 / sd, 0.0)
    # The first weights are those of a fit that minimises absolute deviations, roughly.
    weight = np.ones_like(x)
    for k in range(_ROUNDS):
        w = root * np.sqrt(weight)
        left = y - F @ np.linalg.lstsq(F * w[:, None], y * w, rcond=None)[0]
        z = left * root
        spread = max(1.0, _median(np.abs(z[used])) / MEDIAN)
        u = z / (spread * _TUNING)
        weight = 1.0 / np.maximum(1.0, np.abs(z) / spread) if k < _ROUNDS // 2 else np.maximum(1 - u * u, 0.0) ** 2
    return Smooth(left, spread * np.where(used, sd, np.inf))


def _median(values: Floats) -> float:
    """As np.median, which takes longer to find out along which axis than to find the middle."""
    middle = len(values) // 2
    parted = np.partition(values, (max(middle - 1, 0), middle))
    return float(parted[middle] if len(values) % 2 else (parted[middle - 1] + parted[middle]) / 2)


def loudness(fit: Smooth, rate: Floats) -> Floats:
    """How far each entry stands out, in standard deviations: alone, or with the opposite one; shape (n,).

    ``rate`` is what was commanded, so that opposite rates are found.
    """
    z = fit.z
    order = np.argsort(np.abs(rate), kind="stable")
    loud = np.abs(z)
    for i, j in zip(order[:-1], order[1:], strict=True):
        if abs(rate[i] + rate[j]) <= _SAME < abs(rate[i]):
            both = (abs(z[i]) + abs(z[j])) / 2**0.5  # of the half sum or the half difference, whichever is larger
            loud[[i, j]] = np.maximum(loud[[i, j]], both)
    return loud


def groups(rate: Floats, loud: Floats, threshold: float, apart: float, most: int) -> Floats:
    """Magnitudes around which entries are louder than ``threshold``, the loudest first, at most ``most``; shape (k,).

    Those within ``apart`` [rad/s] of each other are one.
    """
    heard = np.flatnonzero(loud > threshold)
    heard = heard[np.argsort(np.abs(rate[heard]), kind="stable")]
    if not len(heard):
        return np.empty(0)
    magnitude, weight = np.abs(rate[heard]), loud[heard]
    group = np.concatenate([[0], np.cumsum(np.diff(magnitude) > apart)])
    total = np.bincount(group, weight)
    centre = np.bincount(group, weight * magnitude) / total
    strength = np.array([weight[group == g].max() for g in range(len(total))])
    found: Floats = centre[np.argsort(-strength, kind="stable")[:most]]
    return found


def fault(rate: Floats, fit: Smooth, near: float, within: float) -> BellFault:
    """The fault, odd in the rate, that fits best around a magnitude, ``within`` so much of it [rad/s]."""
    some = (np.abs(np.abs(rate) - near) < 2 * within) & np.isfinite(fit.sd)
    x, y, w = np.abs(rate[some]), np.sign(rate[some]) * fit.left[some], fit.sd[some] ** -2.0
    centres = near + within * np.linspace(-1.0, 1.0, _CENTRES)
    widths = within * np.geomspace(0.03, 2.0, _WIDTHS)
    c, s = (a.ravel() for a in np.meshgrid(centres, widths, indexing="ij"))
    shape = np.exp(-0.5 * ((x - c[:, None]) / s[:, None]) ** 2)
    told = np.maximum((w * shape**2).sum(axis=-1), 1e-300)
    gain = (w * shape * y).sum(axis=-1) ** 2 / told
    best = int(gain.argmax())
    height, centre, width = float((w * shape[best] * y).sum() / told[best]), float(c[best]), float(s[best])
    d = (x - c[best]) / s[best]
    J = shape[best][:, None] * np.stack([np.ones_like(d), height * d / s[best], height * d * d / s[best]], axis=-1)
    scale = np.array([1.0, abs(height) / s[best], abs(height) / s[best]])
    cov = np.linalg.pinv((J / scale).T @ (w[:, None] * (J / scale)), hermitian=True)
    height_sd, centre_sd, width_sd = (float(v) for v in np.sqrt(np.diagonal(cov)) / scale)
    return BellFault(centre, width, height, centre_sd, width_sd, height_sd)


def line(rate: Floats, residual: Floats, middle: Floats, variance: Floats, top: float) -> tuple[float, float]:
    """Relative error of the scale factor and its standard deviation, by a weighted fit of b + c x + a |x| + d t.

    The asymmetry a is in, as a list that does not run each rate both ways would take it for a scale factor. Where the
    error bends, c3 x^3 + c5 x^5 are in too, and the scale factor is the slope of the line through that curve at rates
    that are evenly spread: c + 3/5 c3 + 3/7 c5. Else it would be that of the rates at which most time was spent.
    """
    used = np.isfinite(variance)
    w = variance[used] ** -0.5
    x, t = rate[used] / top, middle[used] - middle[used].mean()
    terms = [np.ones_like(x), x, np.abs(x), t / max(float(np.ptp(t)), 1.0), x**3, x**5]
    F, y = w[:, None] * np.stack(terms, axis=-1), w * residual[used]
    G = np.linalg.pinv(F, _TOLD)
    bent = G[4:] @ y
    if len(np.unique(np.round(np.abs(x), 2))) > 2 and bent @ np.linalg.solve(G[4:] @ G[4:].T, bent) > _BENT:
        g = _EVEN @ G
    else:
        g = np.linalg.pinv(F[:, :4], _TOLD)[1]
    return float(g @ y) / top, float(np.sqrt(g @ g)) / top
