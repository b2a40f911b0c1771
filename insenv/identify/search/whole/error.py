r"""The error of a whole search, by signs: how often noise alone would give as much, anywhere.

If only noise is left, whitened, its values in time are independent and as often above zero as below: each may have
either sign. With signs by chance the residual is put to the same search, every shape of every effect of the catalogue,
lines and held-out data, and what the search finds in it is by chance. Of B such residuals k have as much evidence as
the finding or more:

    p = (1 + k) / (B + 1),

whatever the effects have in common, which no count of looks knows. Exact for the residual of the true model whitened by
the true noise; what remains approximate:

* model and noise are fitted. The residual is that of the larger model, scaled to unit variance, and each residual of
  chance is freed of the model's span again. To those of them that have most evidence the noise is fitted anew, with and
  without the effect, where few modes tell it, as to the recording; their models stay whitened as they were;
* shapes of the finding are refined off their grid, those of chance are not;
* what the search refuses of a candidate beyond an incredible coefficient (another curve in each run, an error of the
  reference) it does not refuse in residuals of chance, which makes p larger.

Rank tests by signs: Winkler et al. (2014), NeuroImage 92, 381-397; the largest statistic for all looks together:
Westfall and Young (1993), Resampling-Based Multiple Testing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.special import bdtrc

from insenv.core.lazy import Lazy, nothing
from insenv.core.recording import Floats
from insenv.identify.findings import BY_SIGNS, WholeError
from insenv.identify.fit.evidence import held_out_modes, log_tail
from insenv.identify.fit.gls import solve, whitened
from insenv.identify.search.scan import Hit
from insenv.identify.search.tracks import Step, Track
from insenv.identify.search.whole.directions import TOGETHER, Singles, Whole, log_tails, to_modes, to_series, whole

#: Residuals of chance.
DRAWS = 999
#: Share of draws from which on as much is chance, probability from which on it is asked, and gain of held-out data
#: from which on these say otherwise.
CHANCE, ASKED, GAIN = 0.05, 1e-6, 0.01
#: Probability of a count as far off as this from which two p-values are said to disagree.
APART = 1e-3


@dataclass(frozen=True)
class Chance:
    """Evidence of searches in residuals of chance, and the looks of each candidate that they count.

    ``least`` is the logarithm of the smallest probability, looks counted, of each: shape (draws,).
    """

    least: Floats
    looks: dict[str, float]

    def p(self, hit: Hit) -> tuple[float, int]:
        """The share of searches of chance with as much evidence as a hit, and how many there were."""
        looks = self.looks.get(hit.candidate.effect.key, hit.looks)
        own = log_tail(hit.deviate) + float(np.log(looks))
        more = int(np.sum(self.least <= own))
        return (1 + more) / (len(self.least) + 1), more


def _signed(series: Floats, count: int, rng: np.random.Generator) -> Singles:
    signs = rng.integers(0, 2, size=(len(series), count), dtype=np.int8) * np.int8(2) - np.int8(1)
    return np.asarray(series.astype(np.float32)[:, None] * signs)


@dataclass(frozen=True)
class Residual:
    """The search beside the declared model of a track, and the white residual that its search has come to.

    ``series`` and ``held`` are of unit variance, block after block: shapes (bins,).
    """

    whole: Whole
    series: Floats
    held: Floats

    @classmethod
    def of(cls, track: Track) -> Residual:
        """Of a track."""
        problem, large = track.problem, track.fit
        small = large if not track.added else solve(problem, track.prepared.model, start=large.noise.power)
        given = whole(problem, small, large.noise.power, track.candidates, track.family, track.tones)
        series = _unit(to_series(given.fitted, whitened(problem, large)[2]))
        held = _unit(to_series(given.held, held_out_modes(problem, large)[1])) if given.held else np.zeros(0)
        return cls(given, series, held)

    def chance(self, seed: int, draws: int = DRAWS) -> Chance:
        """The same search in residuals whose values have signs by chance."""
        rng = np.random.Generator(np.random.SFC64(seed))
        found: dict[str, list[tuple[Floats, Floats]]] = {}
        for start in range(0, draws, TOGETHER):
            count = min(TOGETHER, draws - start)
            w = to_modes(self.whole.fitted, _signed(self.series, count, rng))
            v = to_modes(self.whole.held, _signed(self.held, count, rng)) if len(self.held) else _none(count)
            for key, told in self.whole.deviates(w, v, rng, anew=True).items():
                found.setdefault(key, []).append(told)
        deviates = {key: np.concatenate([z for z, _ in parts]) for key, parts in found.items()}
        looks = self.whole.looks({key: np.concatenate([p for _, p in parts]) for key, parts in found.items()})
        each = [log_tails(z) + np.log(looks[key]) for key, z in deviates.items()]
        return Chance(np.min(each, axis=0) if each else np.zeros(draws), looks)


def _none(count: int) -> Singles:
    return np.zeros((0, count), np.float32)


def whole_errors(track: Track, seed: int) -> list[Callable[[], WholeError | None]]:
    """Of each effect that was added to a track: the error of the whole search for it, made when it is asked for.

    What was judged on several targets together, or by what stands on others, has none of one target.
    """
    searches = Lazy(lambda: Residual.of(track).chance(seed))
    alone = (not step.together and step.p_value == step.hit.p_value for step in track.steps)
    return [
        Lazy(partial(_error, searches, step)) if one else nothing for step, one in zip(track.steps, alone, strict=True)
    ]


def of_chance(track: Track, errors: Sequence[Callable[[], WholeError | None]], alpha: float) -> tuple[str, ...]:
    """A word on what the same search finds in noise more often than allowed: there is too little behind it.

    Few means with most of the evidence have it so: k of them have the same signs once in 2^(k - 1) times.

    Parameters
    ----------
    track : Track
    errors : sequence of callable
        Of each effect that was added (`whole_errors`).
    alpha : float
        Share of recordings in which a false alarm was allowed.
    """
    found = []
    for step, error in zip(track.steps, errors, strict=True):
        told = error()
        if told is not None and told.p > alpha and not told.least:
            found.append(
                f"{step.hit.candidate.effect.key} {BY_SIGNS} in {told.p:.2g} of draws, and {alpha:.2g} is allowed"
            )
    return tuple(found)


def by_chance(track: Track, errors: Sequence[Callable[[], WholeError | None]]) -> tuple[Step, str] | None:
    """What the same search finds in noise as often, and held-out data do not gain by, and why; None if there is none.

    Of seven such names in 700 measured recordings none was there. It is said, and has no name. A line may have been
    looked for at the frequency of another axis alone, which draws of all frequencies do not know.
    """
    for step, error in zip(track.steps, errors, strict=True):
        gains = step.after.rms < (1 - GAIN) * step.before.rms
        effect = step.hit.candidate.effect
        if effect.generic or effect.line or step.p_value < ASKED or gains:
            continue
        told = error()
        if told is not None and told.p > CHANCE:
            return step, f"{BY_SIGNS} in {told.p:.2g} of draws"
    return None


def _error(searches: Callable[[], Chance], step: Step) -> WholeError:
    found = searches()
    p, more = found.p(step.hit)
    draws = len(found.least)
    return WholeError(p, draws, agree(more, draws, step.p_value))


def agree(more: int, draws: int, p_value: float) -> bool:
    """Whether ``more`` of ``draws`` is what ``p_value`` lets expect, or fewer: it then errs on the safe side."""
    return float(bdtrc(more - 1, draws, p_value)) > APART if more else True


def _unit(series: Floats) -> Floats:
    size = float(np.sqrt(np.mean(series**2))) if len(series) else 1.0
    return series / size if size > 0 else series
