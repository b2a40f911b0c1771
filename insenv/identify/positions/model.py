"""The model of a triad: effects on three axes as a matrix and an offset.

    m = f + E f + o,        E = sum_j theta_j E_j,    o = sum_j theta_j o_j
    f = A (m - o),          A = (I + E)^-1,           df / dtheta_j = -A (o_j + E_j f)

m is what is measured, shape (n, 3), f the true input. E_j and o_j are asked of the effects themselves
(`insenv.effects`): what they add when unit inputs lie along one axis after the other, and when there is none; each
reading has its own, for they may follow the temperature. A coefficient is one axis's own, or belongs to two of them:
see `insenv.effects.triad`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, CurveEffect, Effect, LinearEffect

AXES = "xyz"
#: Half of what counts as an instant [s]: less than any turn between rests takes.
INSTANT = 1e-3


@dataclass(frozen=True)
class Coefficient:
    """One unknown of a triad: parameter ``name`` of axis ``axis`` (0 to 2), in other axes with a factor.

    ``shares`` has (axis, index of the parameter, factor) of every place where it stands.
    """

    shares: tuple[tuple[int, int, float], ...]


@dataclass(frozen=True)
class TriadTerm:
    """An effect on all three axes and its coefficients.

    Attributes
    ----------
    effect : LinearEffect or CurveEffect
    coefficients : tuple of Coefficient
    shape, shape_sd : tuple of float
        Of a curve of time its shapes, which no fit changes, and how well each is known.
    looks : int
        Forms of the effect among which this one was chosen.
    """

    effect: LinearEffect | CurveEffect
    coefficients: tuple[Coefficient, ...]
    shape: tuple[float, ...] = ()
    shape_sd: tuple[float, ...] = ()
    looks: int = 1

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return len(self.coefficients)

    @property
    def axes(self) -> frozenset[int]:
        """Axes in which a coefficient stands."""
        return frozenset(axis for one in self.coefficients for axis, _, _ in one.shares)

    def part(self, kept: Sequence[int]) -> TriadTerm:
        """The effect with some of its coefficients alone."""
        return replace(self, coefficients=tuple(self.coefficients[j] for j in kept))


def triad_term(effect: Effect, shape: tuple[float, ...] = ()) -> TriadTerm:
    """The effect on three axes: coefficients of each axis its own, or tied where the effect says how."""
    assert isinstance(effect, LinearEffect) or (isinstance(effect, CurveEffect) and len(shape) == len(effect.shapes))
    symmetry = getattr(effect, "symmetry", None)
    if symmetry is None:
        others = "cross_rate" in effect.needs  # what an axis sees of itself is a scale factor
        places = [(axis, k) for axis in range(3) for k in range(len(effect.linear)) if not (others and axis == k)]
        own = tuple(Coefficient(((axis, k, 1.0),)) for axis, k in places)
        return TriadTerm(effect, own, shape)
    pairs = ((0, 1), (0, 2), (1, 2))
    return TriadTerm(effect, tuple(Coefficient(((i, j, 1.0), (j, i, float(symmetry)))) for i, j in pairs))


@dataclass(frozen=True)
class Surroundings:
    """What else the offsets depend on: mid-times [s] and temperatures [K] of the n readings, each shape (n,)."""

    time: Floats
    temperature: Floats | None = None
    reference_temperature: float = 298.15

    @cached_property
    def known(self) -> dict[TriadTerm, tuple[Floats, Floats]]:
        """Derivatives of the terms that were asked so far: every step of a fit asks them again."""
        return {}

    def motion(self, inputs: Floats, axis: int) -> Motion:
        """Exposure of one axis to ``inputs``, shape (n, 3)."""
        columns: Mapping[str, Floats] = {AXES[k]: inputs[:, k] for k in range(3) if k != axis}
        return Motion(
            t=_edges(self.time),
            rate=inputs[:, axis],
            temperature=None if self.temperature is None else _edges(self.temperature),
            cross_rate=columns,
            reference_temperature=self.reference_temperature,
            step=1.0,
        )


#: Of what has neither offsets nor a time: rotations.
NOWHEN = Surroundings(np.zeros(1))


def _edges(middles: Floats) -> Floats:
    """Edges between which the means are ``middles``: a motion has edges, and linear effects see the means alone."""
    signs = (-1.0) ** np.arange(len(middles) + 1)
    return signs * np.concatenate([[0.0], np.cumsum(-2 * signs[:-1] * middles)])


@dataclass(frozen=True)
class Linear:
    """Derivatives of E and o to each coefficient: shapes (p, n, 3, 3), or (p, 1, 3, 3) of one E, and (p, n, 3)."""

    gain: Floats
    offset: Floats

    @classmethod
    def of(cls, terms: Sequence[TriadTerm], around: Surroundings) -> Linear:
        """Asked of the effects of ``terms``, in their order."""
        n = len(around.time)
        for term in terms:
            if term not in around.known:
                around.known[term] = _derivatives(term, around)
        blocks = [around.known[term] for term in terms]
        if not blocks:
            return cls(np.zeros((0, 1, 3, 3)), np.zeros((0, n, 3)))
        each = max(gain.shape[1] for gain, _ in blocks)
        gains = [np.broadcast_to(gain, (len(gain), each, 3, 3)) for gain, _ in blocks]
        return cls(np.concatenate(gains), np.concatenate([offset for _, offset in blocks]))

    def matrix(self, theta: Floats) -> Floats:
        """A = (I + E)^-1, shape (n, 3, 3), or (1, 3, 3) of one E."""
        errors = np.eye(3) + np.tensordot(theta, self.gain, axes=1)
        try:
            return np.asarray(np.linalg.inv(errors), np.float64)
        except np.linalg.LinAlgError:  # a step of the fit to gains of nothing, which the next one takes back
            return np.asarray(np.linalg.pinv(errors), np.float64)

    def corrected(self, measured: Floats, theta: Floats) -> Floats:
        """The true input f, shape (n, 3)."""
        return _times(self.matrix(theta), measured - np.tensordot(theta, self.offset, axes=1))

    def slopes(self, true: Floats, theta: Floats) -> Floats:
        """Derivative of f to each coefficient, shape (p, n, 3)."""
        added = self.offset + _times(self.gain, true)
        return -_times(self.matrix(theta), added)


def _times(matrix: Floats, vectors: Floats) -> Floats:
    """Of each reading its matrix, (..., n or 1, 3, 3), times its vector, (..., n, 3)."""
    return np.asarray((matrix @ vectors[..., None])[..., 0], np.float64)


def _derivatives(term: TriadTerm, around: Surroundings) -> tuple[Floats, Floats]:
    """Of one term: shapes (k, n, 3, 3), or (k, 1, 3, 3) where all readings have the same, and (k, n, 3)."""
    if isinstance(term.effect, CurveEffect):
        return _derivatives_of_curve(term, term.effect, around)
    n = len(around.time)
    none = np.zeros((n, 3))
    gain, offset = np.zeros((term.size, n, 3, 3)), np.zeros((term.size, n, 3))
    for axis in range(3):
        at_rest = term.effect.basis(none[:, axis], around.motion(none, axis))
        along = [np.broadcast_to(unit, (n, 3)) for unit in np.eye(3)]
        ones = [term.effect.basis(unit[:, axis], around.motion(unit, axis)) - at_rest for unit in along]
        for j, coefficient in enumerate(term.coefficients):
            for where, index, factor in coefficient.shares:
                if where == axis:
                    gain[j, :, axis] += factor * np.stack([each[:, index] for each in ones], axis=-1)
                    offset[j, :, axis] += factor * at_rest[:, index]
    return (gain[:, :1] if np.all(gain == gain[:, :1]) else gain), offset


def _derivatives_of_curve(term: TriadTerm, effect: CurveEffect, around: Surroundings) -> tuple[Floats, Floats]:
    """Of a curve of time: it is asked at each reading by itself, for between readings it may bend."""
    at = [effect.profile(np.zeros(1), _instant(float(t)), np.array(term.shape))[0] for t in around.time]
    offset = np.zeros((term.size, len(at), 3))
    for j, coefficient in enumerate(term.coefficients):
        for axis, index, factor in coefficient.shares:
            offset[j, :, axis] += factor * np.array(at)[:, index]
    return np.zeros((term.size, 1, 3, 3)), offset


def _instant(t: float) -> Motion:
    """No motion, about one time [s]."""
    return Motion(t=np.array([t - INSTANT, t + INSTANT]), rate=np.zeros(1))


@dataclass(frozen=True)
class Named:
    """What one coefficient is called on one axis: the parameter's name and unit, and its factor there."""

    axis: int
    name: str
    unit: str
    factor: float


def named(term: TriadTerm, coefficient: Coefficient, output: str) -> tuple[Named, ...]:
    """Every place of a coefficient; ``output`` is the unit of what the triad measures."""
    params = term.effect.linear
    return tuple(
        Named(axis, params[k].name, params[k].unit.replace(OUTPUT, output), factor)
        for axis, k, factor in coefficient.shares
    )
