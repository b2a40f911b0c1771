r"""Whether what is left of several channels wanders together: noise of each knows nothing of the others.

A walk or a flicker of the noise takes up whatever changes slowly, heat, a supply or a base that gives way, and then
nothing is left to be named. Where channels of one unit have it in common it is no noise of theirs. Of the modes z of
what is left of two channels, whitened, in which the slow noise of either exceeds its white one,

    rho = sum z z' / sqrt(sum z^2 sum z'^2),     t = rho sqrt((K - 1) / (1 - rho^2)),     K = (sum p)^2 / sum p^2

with p = z^2 + z'^2: where the noise is not what the model of it says, few modes count. Source of the test:
R. A. Fisher, Statistical Methods for Research Workers, 4th ed. (1932), section 34.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from insenv.core.recording import Floats
from insenv.identify.fit.gls import spectrum
from insenv.identify.fit.heldout import residual
from insenv.identify.fit.noise import transform
from insenv.identify.search.tracks import Track

#: Power of a mode, in that of the white noise, from which on it wanders.
WANDERS = 2.0
#: Fewest modes that tell a correlation, the least one that is said, and its probability by chance among all pairs.
FEWEST, LEAST, CHANCE = 6.0, 0.4, 1e-3


@dataclass(frozen=True)
class _Alike:
    """Two channels that wander together: their correlation, its p-value among all pairs, from what period on [s]."""

    pair: tuple[int, int]
    correlation: float
    p_value: float
    period: float


def with_common_wander(tracks: Sequence[Track]) -> list[Track]:
    """The tracks of a unit at rest, with what each has in common with others in words."""
    found = _alike(tracks)
    out = list(tracks)
    for index, track in enumerate(tracks):
        own = [one for one in found if index in one.pair]
        if own:
            best = max(own, key=lambda one: abs(one.correlation))
            others = sorted({other for one in own for other in one.pair} - {index})
            names = " and ".join(tracks[other].problem.target for other in others)
            said = (
                f"what is left wanders with that of {names} (correlation {best.correlation:.2g} of what is slower than "
                f"{best.period:.2g} s, p = {min(one.p_value for one in own):.1g}): heat, a supply or a base that moves "
                "does that, and no noise of its own"
            )
            out[index] = replace(track, in_common=said)
    return out


def _alike(tracks: Sequence[Track]) -> list[_Alike]:
    """Pairs of channels of one kind that wander together for certain."""
    able = [i for i, track in enumerate(tracks) if not track.problem.turns]
    pairs = [(i, j) for i, j in combinations(able, 2) if _comparable(tracks[i], tracks[j])]
    whitened = {i: _whitened(tracks[i]) for pair in pairs for i in pair}
    told = [one for pair in pairs if (one := _of_pair(tracks, pair, whitened, len(pairs))) is not None]
    return [one for one in told if one.p_value < CHANCE and abs(one.correlation) > LEAST]


def _comparable(one: Track, other: Track) -> bool:
    """Whether two channels are of one kind, in the same means of the same rows."""
    a, b = one.problem, other.problem
    blocks = [[(block.start, block.stop) for block in problem.fitted] for problem in (a, b)]
    return a.unit == b.unit and a.bins.width == b.bins.width and blocks[0] == blocks[1]


def _of_pair(
    tracks: Sequence[Track],
    pair: tuple[int, int],
    whitened: Mapping[int, tuple[Floats, NDArray[np.bool_]]],
    looks: int,
) -> _Alike | None:
    (x, slow), (y, also) = (whitened[i] for i in pair)
    where = slow & also
    power = x[where] ** 2 + y[where] ** 2
    modes = float(power.sum() ** 2 / max(float(power @ power), 1e-300))
    size = float(np.sqrt((x[where] @ x[where]) * (y[where] @ y[where])))
    if modes < FEWEST or not size > 0:
        return None
    correlation = float(x[where] @ y[where]) / size
    t = correlation * float(np.sqrt((modes - 1) / max(1 - correlation**2, 1e-12)))
    p = 2 * float(stdtr(modes - 1, -abs(t)))
    fastest = max(block.n for block in tracks[pair[0]].problem.fitted) * tracks[pair[0]].problem.bins.width
    return _Alike(pair, correlation, min(1.0, p * looks), 2 * fastest / float(where.sum()))


def _whitened(track: Track) -> tuple[Floats, NDArray[np.bool_]]:
    """Modes of what is left, whitened, and whether the slow noise exceeds the white one in each; shape (modes,)."""
    problem = track.problem
    left = transform(problem.fitted, residual(problem, track.fit))
    noise = spectrum(problem, track.fit.noise.power)
    return left / np.sqrt(noise), noise > WANDERS * noise.min()
