"""Gain and lag of an output that is held: with the phase of each run, and the share that is held."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from insenv.core.recording import Recording, Response
from insenv.core.series.robust import OF_MEDIAN
from insenv.identify.clean.response.fit import FAR, fitted, seen, slack_of, slope_of
from insenv.identify.clean.response.forms import likelier, with_response
from insenv.identify.clean.response.stretches import Stretch, held_part, stretches, with_form

#: Rows of a hold up to which every phase is tried.
MOST_PHASES = 64


@dataclass(frozen=True)
class Held:
    """A held output beside gain and lags: its share and the standard deviation of that, and the phase of each run."""

    share: float
    share_sd: float
    phases: tuple[float, ...]


def with_held(
    recordings: tuple[Recording, ...],
    spans: tuple[slice, ...],
    target: str,
    hold: float,
    phases: tuple[float, ...],
    seen: bool = False,
) -> tuple[tuple[Recording, ...], Held | None]:
    """The recordings with lags that are told beside a hold, where the table's reading is noisy.

    A held output is late by half of its hold time: without the hold beside it, that was in the lag. Phases that were
    ``seen`` in the readings stay as they are.
    """
    parts = stretches(recordings, spans, target)
    parts = [s for s in parts if (table := recordings[s.run].table) is not None and not table.still]
    if not parts:
        return recordings, None
    found, lags = dict(enumerate(phases)), {}
    for s in parts:
        dt = s.exposure.motion.dt
        start = s.exposure.motion.lag - 0.5 * (hold - dt)
        unsettled = not seen and hold < MOST_PHASES * dt
        tried = np.arange(round(hold / dt)) * dt if unsettled else np.array([found[s.run]])
        misfits = [_misfit(s, start, hold, phase) for phase in tried.tolist()]
        found[s.run] = float(tried[int(np.argmin(misfits))])
        lags[s.run] = start
    follows = likelier(parts, lags, {s.run for s in parts}, (hold, found))
    form = [replace(s, exposure=with_form(s.exposure, follows.filtered, follows.window)) for s in parts]
    share, sd = _share(form, follows.lags, hold, found)
    old = recordings[parts[0].run].responses.get(target, Response()).gain
    gain = old * follows.gain if old != 1.0 else 1.0
    return with_response(recordings, target, gain, follows), Held(
        share, sd, tuple(found[i] for i in range(len(recordings)))
    )


def _misfit(one: Stretch, lag: float, hold: float, phase: float) -> float:
    """Square sum that is left of a run with its own gain, lag and level, at that phase."""
    gain, _, lags = fitted([one], {one.run: lag}, {one.run}, (hold, {one.run: phase}))
    held, known, lag = (hold, {one.run: phase}), one.known > 0, lags[one.run]
    left = (one.y - gain * seen(one, lag, held))[known]
    left = left - np.median(left)
    bound = FAR * OF_MEDIAN * float(np.median(np.abs(left))) + slack_of(one, slope_of(one, lag, held), held)[known]
    return float(np.sum(np.minimum(left**2, bound**2)))


def _share(parts: list[Stretch], lags: dict[int, float], hold: float, phases: dict[int, float]) -> tuple[float, float]:
    """Share of the output that is held, of its gain, and its standard deviation: noise is held as well."""
    total, weight = 0.0, 0.0
    for s in parts:
        motion, lag = s.exposure.motion, lags[s.run]
        u = s.input(lag)
        part = held_part(motion, s.whole(lag), hold, phases[s.run])[s.start : s.stop]
        matrix = np.column_stack([u, part, slope_of(s, lag, None), np.ones(len(u))])[s.known > 0]
        size = np.linalg.norm(matrix, axis=0)
        scaled = matrix / np.where(size > 0, size, 1.0)
        y = s.y[s.known > 0]
        theta = np.linalg.lstsq(scaled, y, rcond=1e-10)[0]
        noise = float(np.mean((y - scaled @ theta) ** 2)) * max(hold / motion.dt, 1.0)
        variance = noise * float(np.linalg.pinv(scaled.T @ scaled, hermitian=True)[1, 1]) / size[1] ** 2
        gain = float(theta[0] / size[0])
        if variance > 0 and gain:
            own, own_variance = float(theta[1] / size[1]) / gain, variance / gain**2
            total, weight = total + own / own_variance, weight + 1 / own_variance
    return (total / weight, float(weight**-0.5)) if weight else (1.0, np.inf)
