"""Turns of coordinates one after the other, some of an angle at each sample and others of one for a whole run.

What is costly of a unit on its table is here, compiled (`insenv.core.unit.rotations_kernel`): Numba is imported where
something is turned.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from insenv.core.compiled import of_one_type

Floats = NDArray[np.float64]
#: A vector along a time axis: its three components, each of shape (..., n).
Vector = tuple[Floats, Floats, Floats]


@dataclass(frozen=True)
class Rotations:
    """A sequence of turns about axes of the coordinates.

    Attributes
    ----------
    turns : ndarray of int, shape (s, 2)
        Axis of each turn, and its place among the angles that change, or -1.
    fixed : ndarray, shape (..., s, 2)
        Cosine and sine of those that do not.
    """

    turns: NDArray[np.int64]
    fixed: Floats

    @classmethod
    def of(cls, turns: Sequence[tuple[str, Floats | int]]) -> Self:
        """Of letters with an angle of shape (...) [rad], or the place of one that changes."""
        angles = np.broadcast_arrays(*(np.zeros(()) if isinstance(a, int) else a for _, a in turns))
        numbers = [("xyz".index(letter), a if isinstance(a, int) else -1) for letter, a in turns]
        stacked = np.stack(angles, axis=-1)
        return cls(np.array(numbers, np.int64), np.stack([np.cos(stacked), np.sin(stacked)], axis=-1))

    def carry(self, vector: Vector, angles: Floats) -> Vector:
        """A vector of components of shape (..., 1), at angles of shape (..., k, n): components of shape (..., n)."""
        from insenv.core.unit.rotations_kernel import carried

        batch = self._batch(angles.shape[:-2], *(np.shape(v)[:-1] for v in vector))
        return self._filled(carried, batch, angles, (), (vector,), angles.shape[-1])[0]

    def spin(self, rates: Floats, angles: Floats) -> Vector:
        """The rate of the last axes against the first, for rates and angles of shape (..., k, n)."""
        from insenv.core.unit.rotations_kernel import spun

        return self._filled(
            spun, self._batch(rates.shape[:-2], angles.shape[:-2]), angles, (rates,), (), angles.shape[-1]
        )[0]

    def means(self, rates: Floats, angles: Floats, turning: Vector, steady: Vector) -> tuple[Vector, Vector]:
        """Of n intervals: the mean rate with a steady vector's mean, and another's mean, components (..., n).

        Parameters
        ----------
        rates : ndarray, shape (..., k, n)
            Mean rates [rad/s].
        angles : ndarray, shape (..., k, 2 n + 1)
            At the edges and in the middles [rad].
        turning, steady : tuple of ndarray
            Components of shape (..., 1).
        """
        from insenv.core.unit.rotations_kernel import felt

        batch = self._batch(rates.shape[:-2], angles.shape[:-2])
        rate, mean = self._filled(felt, batch, angles, (rates,), (turning, steady), rates.shape[-1])
        return rate, mean

    def _batch(self, *shapes: tuple[int, ...]) -> tuple[int, ...]:
        return np.broadcast_shapes(self.fixed.shape[:-2], *shapes)

    def _filled(
        self,
        kernel: Callable[..., None],
        batch: tuple[int, ...],
        angles: Floats,
        along: Sequence[Floats],
        vectors: Sequence[Vector],
        n: int,
    ) -> list[Vector]:
        """What a kernel fills, three components for each vector, or for the one rate."""
        given = [as_rows(values, batch, 2) for values in (self.fixed, angles, *along)]
        given += [as_rows(np.concatenate(np.broadcast_arrays(*v), axis=-1), batch, 1) for v in vectors]
        out = np.empty((max(1, len(vectors)), 3, len(given[0]), n))
        kernel(self.turns, *given, out)
        shaped: Any = out.reshape(len(out), 3, *batch, n)
        return [(v[0], v[1], v[2]) for v in shaped]


def as_rows(values: Floats, batch: tuple[int, ...], own: int) -> Floats:
    """Return values with ``own`` last axes, a row of them for each run of a batch, as a kernel takes them."""
    shape = values.shape[values.ndim - own :]
    rows = np.broadcast_to(values, (*batch, *shape)).reshape(int(np.prod(batch)), *shape)
    return of_one_type(rows)
