"""The sawtooth that a held output leaves in differences from sample to sample, and what of them each hold explains.

Hold times are in samples here, as phases are. Which output is held is told in `insenv.identify.clean.holds`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.data.exposure import Exposure
from insenv.identify.clean.response.stretches import held_part

#: Largest share of an output that is held.
MOST_SHARE = 1.5
#: Share of the hold times of which that may not hold.
MOST = 0.1
#: Peaks of the spectrum that are looked at as renewal rates, hold times that are tried, and phases of each.
PEAKS, TRIED, PHASES = 32, 32, 8
#: Share of a column's square sum that rounding leaves of it.
ROUNDING = 1e-13
#: The shortest hold times, which are always tried.
ALWAYS = 24
#: Hold times of round numbers of samples, always tried too: a ramp that is shorter than the hold shows no sawtooth.
ROUND = (20.0, 25.0, 40.0, 50.0, 100.0, 125.0, 200.0, 250.0, 500.0, 1000.0)
#: Standard deviations at which a hold would have been seen for certain.
SEEN = 12.0


@dataclass(frozen=True)
class HoldGain:
    """Square sum that a hold explains of ``total``, its share, and the square sum of its column."""

    gain: float
    share: float
    size: float
    total: float


@dataclass(frozen=True)
class HeldDifferences:
    """Differences ``left`` from cell to cell of a run, free of the columns ``q``, and what holds explain of them."""

    exposure: Exposure
    cells: NDArray[np.int64]
    q: Floats
    left: Floats
    seen: dict[tuple[float, float], HoldGain] = field(default_factory=dict)

    @cached_property
    def follow(self) -> bool:
        """Whether the cells follow each other without a gap."""
        return int(self.cells[-1] - self.cells[0]) + 1 == len(self.cells)

    @cached_property
    def total(self) -> float:
        """Square sum of the differences."""
        return float(self.left @ self.left)

    def gain(self, ratio: float, phase: float) -> HoldGain:
        """Gain of a hold of ``ratio`` samples that was renewed ``phase`` samples before the start of the run."""
        key = ratio, phase % ratio
        if key not in self.seen:
            self.seen[key] = self._gain(*key)
        return self.seen[key]

    def change(self, ratio: float, phase: float) -> Floats:
        """Differences of what a whole hold adds, shape (cells - 1,)."""
        whole, cells = self.exposure.motion, self.cells
        start, stop = max(0, int(cells[0]) - int(ratio) - 1), int(cells[-1]) + 1  # from a whole cell of the hold on
        u = self.exposure.u[start:stop]
        motion = Motion(whole.t[start : stop + 1], u, step=whole.step)  # a hold needs no more of it
        column = held_part(motion, u, ratio * whole.dt, phase * whole.dt)
        told = column[int(cells[0]) - start :] if self.follow else column[cells - start]
        return told[1:] - told[:-1]

    def _gain(self, ratio: float, phase: float) -> HoldGain:
        change, total = self.change(ratio, phase), self.total
        along = self.q.T @ change  # what is left has no part there
        power = float(change @ change)
        size = power - float(along @ along)
        size = size if size > ROUNDING * power else 0.0
        share = float(change @ self.left) / size if size > 0 else 0.0
        credible = 0 < share <= MOST_SHARE  # a larger one is another hold, tried too
        return HoldGain(share**2 * size if credible else 0.0, share, size, total)

    def of(self, one: tuple[float, float]) -> float:
        """Square sum explained."""
        return self.gain(*one).gain

    def sees_all(self) -> bool:
        """Whether a whole hold of nearly any length that was tried would have stood out.

        Not of every one: what is held for a whole period of the motion is a constant.
        """
        noise = float(self.left @ self.left) / max(len(self.left) - self.q.shape[1] - 1, 1)
        return float(np.quantile([one.size for one in self.seen.values()], MOST)) > SEEN**2 * noise

    def coarse(self) -> tuple[float, float] | None:
        """The best of the ratios at whose rate the residual follows the acceleration most, at several phases."""
        tried = [(r, float(np.floor(r * k / PHASES))) for r in self._ratios() for k in range(PHASES)]
        return max(dict.fromkeys(tried), key=self.of, default=None)

    def refined(self, best: tuple[float, float]) -> tuple[float, float]:
        """The best beside ``best``: first its phase, then its ratio; whole samples where they do as well."""
        step = max(1.0, best[0] // PHASES)
        while step >= 1:
            best = max(((best[0], best[1] + k * step) for k in (-1, 0, 1)), key=self.of)
            step //= 2
        # Boundaries move past samples one by one: finer than this nothing changes. About the middle of the cells, so
        # that the phase stays there.
        finest, middle = best[0] / len(self.cells), float(self.cells.mean())
        step = 16 * finest
        while step > 0.5 * finest:
            near = [(best[0] + k * step, best[1] + k * step * middle / best[0]) for k in (-1, 0, 1)]
            best = max((one for one in near if one[0] > 1), key=self.of)
            step /= 2
        whole = float(round(best[0]))
        left = self.gain(*best).total - self.of(best)
        for phase in (0.0, *(float(p) for p in range(1, min(int(whole), 200)))):
            if whole >= 2 and self.gain(whole, phase).total - self.of((whole, phase)) <= 1.02 * left:
                return whole, phase
        return best[0], best[1] % best[0]

    def _ratios(self) -> list[float]:
        n, moved = len(self.left), np.diff(self.exposure.u[self.cells])
        power = np.abs(np.fft.rfft(self.left * moved)) ** 2
        power = np.maximum(power, np.maximum(np.roll(power, 1), np.roll(power, -1)))
        most = n // 4
        whole = [r for m, last in ((1, 100), (10, 1000), (100, 10000)) for r in range(max(2, last // 10), last, m)]
        halves = [0.5 * r for r in range(4, 21)]
        peaks = np.argsort(power[4:])[::-1][:PEAKS] + 4
        ratios = {*map(float, whole), *halves, *(n / float(k) for k in peaks)}

        def strength(ratio: float) -> float:
            """Mean power at the first harmonics."""
            tops = range(1, 1 + min(4, int(ratio / 2)))
            return float(np.mean([power[min(round(k * n / ratio), len(power) - 1)] for k in tops]))

        few = sorted(r for r in ratios if 2 <= r <= most)
        return sorted(
            {*few[:ALWAYS], *(r for r in ROUND if r <= most), *sorted(few, key=strength, reverse=True)[:TRIED]}
        )


def orthogonal(columns: Floats) -> Floats:
    """Orthonormal columns of the same span."""
    size = np.linalg.norm(columns, axis=0)
    scaled = columns[:, size > 0] / size[size > 0]
    u, s, _ = np.linalg.svd(scaled, full_matrices=False)
    return u[:, s > 1e-9 * s.max(initial=0.0)]


def outside(q: Floats, x: Floats) -> Floats:
    """What of ``x`` is outside the span of orthonormal columns."""
    return x - q @ (q.T @ x)
