"""Stretches of runs by which gain and lag are told, and what is seen of their input: late, smoothed or held."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.motion import Motion, interval_slope
from insenv.core.recording import Floats, Recording
from insenv.data.exposure import Exposure, expose
from insenv.effects.timing import before_mean, earlier, held_values

#: Share of the fitted rows below which the longest stretch without a gap is one of many pieces.
SHREDDED = 0.1
#: Scatter of the rate in a stretch, as a share of that of all fitted rows, below which it lacks the motion.
LIVELY = 0.1
#: Least change of a rate, as a share of it, beside which a gain is told from a bias.
CHANGING = 0.01
#: Fewest rows that tell a gain, and rows of a run that are looked at.
FEWEST, MOST_ROWS = 64, 40_000


@dataclass(frozen=True)
class Stretch:
    """Cells ``start`` to ``stop`` of a run, one a row; ``used`` are those of them that may be fitted, None: all.

    Reading and input are running means ``over`` so many cells.
    """

    run: int
    exposure: Exposure
    start: int
    stop: int
    used: NDArray[np.bool_] | None = None
    over: int = 1

    @property
    def y(self) -> Floats:
        """The reading, shape (n,)."""
        return self._mean(self.exposure.y[self.start : self.stop])

    @property
    def known(self) -> Floats:
        """Cells that hold a row and may be fitted, shape (n,)."""
        there = self.exposure.count[self.start : self.stop] > 0
        known = (there if self.used is None else there & self.used).astype(float)
        return known if self.over == 1 else np.asarray(self._mean(known) > 1 - 0.5 / self.over, np.float64)

    def input(self, lag: float) -> Floats:
        """The input ``lag`` seconds earlier, shape (n,)."""
        return self._mean(self.whole(lag)[self.start : self.stop])

    def _mean(self, values: Floats) -> Floats:
        if self.over == 1:
            return values
        from scipy.ndimage import uniform_filter1d  # slow to import

        # At an end the mean of the half that is there: the outermost reading again and again is its rounding.
        return np.asarray(uniform_filter1d(values, self.over, mode="reflect"))

    def whole(self, lag: float) -> Floats:
        """The same of the whole run."""
        return lagged(self.exposure, lag)

    def held(self, lag: float, hold: float, phase: float) -> Floats:
        """The input that a held output shows, shape (n,)."""
        u = self.whole(lag)
        return self._mean((u + held_part(self.exposure.motion, u, hold, phase))[self.start : self.stop])


def lagged(exposure: Exposure, lag: float) -> Floats:
    """Input of an exposure ``lag`` seconds earlier, before a first-order filter of ``-lag`` or a mean, shape (n,)."""
    motion = exposure.motion
    if not lag or motion.rate_edges is None:
        return exposure.u
    if motion.filtered:
        return np.asarray(exposure.u - lag * interval_slope(motion.rate_edges, motion.dt))
    return earlier(*before_mean(exposure.u, motion.rate_edges, motion), motion, lag)


def with_form(exposure: Exposure, filtered: bool, window: float) -> Exposure:
    """The exposure whose reference came through a filter, or is a mean over ``window``: that is undone at once."""
    motion = replace(exposure.motion, filtered=filtered, window=window)
    if not window or motion.rate_edges is None:
        return replace(exposure, motion=motion)
    u, edges = before_mean(exposure.u, motion.rate_edges, motion)
    return replace(exposure, u=u, motion=replace(motion, rate_edges=edges, window=0.0))


def held_part(motion: Motion, u: Floats, hold: float, phase: float) -> Floats:
    """What holding adds to ``u``, where a value was renewed ``phase`` seconds before the start of the run.

    The value that is held at first is older than the data: it is read off the line through the first two.
    """
    begin, end = float(motion.t[0]) + phase, float(motion.t[-1]) + phase
    dt = (end - begin) / motion.n if motion.step is None else motion.step
    hold = max(hold, motion.dt)
    age = np.floor((begin % hold) / motion.dt + 0.5 - 1e-6)
    # As `SampleHold` adds: thousands are tried, and what an effect asks first costs more than to hold.
    source = np.concatenate([[u[0] - age * (u[1] - u[0])], u])
    return held_values(source, max(hold / dt, 1.0), round(begin / dt)) - u


def stretch(exposure: Exposure, run: int, span: slice) -> Stretch | None:
    """The liveliest cells of a fitted span; None where the table does not change its rate."""
    cells = exposure.cell_of_row[span]
    cells = cells[cells >= 0]
    if len(cells) < FEWEST:
        return None
    start, stop = int(cells[0]), int(cells[-1]) + 1
    if stop - start > MOST_ROWS:
        moved = np.concatenate([[0.0], np.cumsum(np.diff(exposure.u[start:stop]) ** 2)])
        start += int(np.argmax(moved[MOST_ROWS - 1 :] - moved[: -(MOST_ROWS - 1)]))
        stop = start + MOST_ROWS
    u = exposure.u[start:stop]
    return Stretch(run, exposure, start, stop) if np.ptp(u) > CHANGING * np.abs(u).max() else None


def in_pieces(exposure: Exposure, run: int, rows: NDArray[np.bool_]) -> Stretch | None:
    """All cells of a run of which no stretch is long enough, those of ``rows`` alone to be fitted."""
    cells = exposure.cell_of_row[rows]
    cells = cells[cells >= 0]
    if len(cells) < FEWEST // 8 or cells[-1] - cells[0] > MOST_ROWS:
        return None
    start, stop = int(cells[0]), int(cells[-1]) + 1
    used = np.zeros(stop - start, bool)
    used[cells - start] = True
    u = exposure.u[cells]
    return Stretch(run, exposure, start, stop, used) if np.ptp(u) > CHANGING * np.abs(u).max() else None


def stretches(
    recordings: tuple[Recording, ...],
    spans: tuple[slice, ...],
    target: str,
    rows: tuple[NDArray[np.bool_], ...] = (),
) -> list[Stretch]:
    """The `stretch` of each recording that has one; of one that gaps cut to pieces, its fitted ``rows``."""
    exposures = [expose(one, target) for one in recordings]
    whole = [stretch(one, run, span) for run, (one, span) in enumerate(zip(exposures, spans, strict=True))]
    few = not any(whole)
    for run, (exposure, fit) in enumerate(zip(exposures, rows, strict=False)):
        shredded = spans[run].stop - spans[run].start < SHREDDED * int(fit.sum())
        if few or shredded or _all_but_steady(exposure, whole[run], fit):
            whole[run] = in_pieces(exposure, run, fit) or whole[run]
    return [one for one in whole if one]


def _all_but_steady(exposure: Exposure, one: Stretch | None, rows: NDArray[np.bool_]) -> bool:
    """Whether the table goes at one rate in a stretch and at others in the rest: errors of that rate tell no gain."""
    cells = exposure.cell_of_row[rows]
    cells = cells[cells >= 0]
    if one is None or not len(cells):
        return False
    return float(np.std(exposure.u[one.start : one.stop])) < LIVELY * float(np.std(exposure.u[cells]))
