"""Which copies of a recording the loop would say nothing of, by what all copies have in common.

Copies share motion, bins, and the directions of every shape of every effect (`insenv.identify.search.whole`): what is
new in a copy is a change of its readings, which is binned and looked at in those directions, held-out data and lines
included, in a small part of the time of a whole close. Where the evidence is so far from significant that no refit
brings it there, the loop would name nothing, and the copy is not closed; any other is, as the recording was.

What is named, and with which estimates, is therefore that of one close after another, but for copies of which the
screen is wrong. Its evidence is a score in noise of the recording, and the loop's a likelihood ratio with all that is
prepared anew; between them lies a factor of `MARGIN` in probability. The verdict of a copy that was not closed is not
known: beside nothing that is named the loop may still find that something is left.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats, Recording
from insenv.data.split import split, without_tails
from insenv.effects.catalogue import catalogue
from insenv.effects.timing import SampleHold
from insenv.identify.fit.evidence import HeldOutSpace
from insenv.identify.fit.gls import Fit, coefficients, solve, spectrum
from insenv.identify.fit.heldout import residual
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import Problem
from insenv.identify.loop import trace
from insenv.identify.prepare.excess import most_power
from insenv.identify.search.tracks import Track
from insenv.identify.search.whole.directions import Singles, Whole, log_tails, whole
from insenv.identify.search.whole.error import Residual
from insenv.trust.copies import Base

#: Times the level that the probability of a copy's evidence is to be, looks counted, for the copy not to be closed.
MARGIN = 10.0
#: Residuals of chance on which looks are counted.
DRAWS = 199


@dataclass(frozen=True)
class Look:
    """A whole search beside one fit of the declared model, whose noise is free or held to what was declared."""

    problem: Problem
    fit: Fit
    whole: Whole
    looks: dict[str, float]
    free: bool

    @classmethod
    def of(cls, track: Track, seed: int) -> Look:
        """Of a track in which nothing was found."""
        found = Residual.of(track)
        # Only what was exposed and binned is kept: the rest of what a problem remembers is of its readings.
        problem = replace(track.problem, cache={})
        return cls(problem, track.fit, found.whole, found.chance(seed, DRAWS).looks, track.problem.most is None)

    @classmethod
    def held(cls, track: Track, declared: dict[str, float], looks: dict[str, float]) -> Look:
        """The same with the noise held to what was declared."""
        problem = replace(track.problem, most=most_power(declared))
        fit = solve(problem, track.fit.model)
        given = whole(problem, fit, fit.noise.power, track.candidates, track.family, track.tones)
        return cls(replace(problem, cache={}), fit, given, looks, False)

    def log_p(self, change: Floats) -> float:
        """Logarithm of the probability of the evidence, looks counted, where the bins are changed: shape (bins,)."""
        problem = replace(self.problem, y=self.problem.y + change, cache={"modes": self.problem.modes()})
        beta, cov = coefficients(problem, self.fit.design, self.fit.noise.power)
        fit = replace(self.fit, beta=beta, cov=cov)
        left = residual(problem, fit)
        free = problem.y - fit.design.matrix @ fit.beta
        w = transform(problem.fitted, free) / np.sqrt(spectrum(problem, fit.noise.power))
        space = HeldOutSpace.of(problem, fit)
        v = space.damped(space.white(left))
        size = float(np.sqrt(np.mean(w**2))) if self.free else 1.0
        told = self.whole.deviates(_single(w / size), _single(v / size), np.random.default_rng(0), anew=self.free)
        return min(
            float(log_tails(z)[0] + np.log(self.looks[key])) for key, (z, _) in told.items() if key in self.looks
        )


def _single(modes: Floats) -> Singles:
    return np.asarray(modes[:, None], np.float32)


@dataclass(frozen=True)
class Screen:
    """Of a recording with one target, from which nothing is taken out of its samples.

    ``cells`` are the cells of the rows of each run, as of `Exposure.cell_of_row`.
    """

    given: tuple[Recording, ...]
    target: str
    cells: tuple[NDArray[np.int64], ...]
    looks: tuple[Look, ...]
    alpha: float

    def quiet(self, copy: tuple[Recording, ...]) -> bool:
        """Whether the loop would name nothing in a copy, as far as its bins tell."""
        problem = self.looks[0].problem
        means = []
        for own, other, cell, exposure in zip(self.given, copy, self.cells, problem.exposures, strict=True):
            change = other.channels[self.target].values - own.channels[self.target].values
            inside = cell >= 0
            count = np.bincount(cell[inside], minlength=exposure.motion.n)
            means.append(np.bincount(cell[inside], change[inside], exposure.motion.n) / np.maximum(count, 1))
        changed = problem.bins.mean(tuple(means))
        level = np.log(self.alpha * MARGIN)
        return all(look.log_p(changed) >= min(level, np.log(0.5)) for look in self.looks)

    def sees(self, effect: str) -> bool:
        """Whether bins alone tell of an effect: of a held output its samples do."""
        return effect != SampleHold.id


def screen_of(given: Base, alpha: float, seed: int) -> Screen | None:
    """The screen of a recording's copies; None where more than bins decides, or several targets do together."""
    read, recordings = given.manifest, given.recordings
    if len(read.model.targets) > 1 or read.model.effects:
        return None
    uses = split(read, recordings)
    own = without_tails(recordings, uses) if read.procedure == "static" else (recordings, uses)
    (track,) = trace(read, *own, catalogue(), alpha, seed).tracks
    prepared = track.prepared
    taken = prepared.lines or prepared.held.hold or prepared.rails or track.finer or track.instead
    cells = tuple(e.cell_of_row for e in track.problem.exposures)
    whole_rows = all(len(cell) == len(r) for cell, r in zip(cells, recordings, strict=True))
    if track.added or taken or not whole_rows or any(given.left.values()):
        return None
    first = Look.of(track, seed)
    declared = dict(read.noise.get(track.problem.target, {}))
    looks = (first, Look.held(track, declared, first.looks)) if declared else (first,)
    return Screen(recordings, track.problem.target, cells, looks, alpha)
