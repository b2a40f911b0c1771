r"""Vectors carried through the axes of a table, compiled: what `insenv.core.unit.rotations` asks for, sample by sample.

    v_j' = c v_j + s v_k,   v_k' = c v_k - s v_j        (coordinates turned about axis i; i, j, k cyclic)

A chain is a list of such turns: the axis' number, and the place among the angles that change, or -1 where one stays for
the run. Cosine and sine are taken where an angle changes, and nothing is computed anew where none does: a table mostly
rests. Each run goes through the same scalar code alone, so that a row of a batch is that run, bit for bit.
"""

# mypy: disable-error-code="no-untyped-def"
# Vectors are tuples of floats here, which the compiler keeps in registers.

from __future__ import annotations

import math

from insenv.core.compiled import jit, patient


@jit
def _turned(axis, c, s, v):
    """Return components in axes that are turned about one of them."""
    if axis == 0:
        return v[0], c * v[1] + s * v[2], c * v[2] - s * v[1]
    if axis == 1:
        return c * v[0] - s * v[2], v[1], c * v[2] + s * v[0]
    return c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]


@jit
def _looked(chain, turns, angles, row, i):
    """Bring the turns of a row's axes to sample i; return whether one of them changed."""
    changed = i == 0
    if not changed:
        for m in range(angles.shape[1]):
            changed |= angles[row, m, i] != angles[row, m, i - 1]
    if changed:
        for j in range(chain.shape[0]):
            m = chain[j, 1]
            if m >= 0 and (i == 0 or angles[row, m, i] != angles[row, m, i - 1]):
                turns[j, 0], turns[j, 1] = math.cos(angles[row, m, i]), math.sin(angles[row, m, i])
    return changed


@jit
def _through(chain, turns, v):
    """Return a vector behind the whole chain."""
    for j in range(chain.shape[0]):
        v = _turned(chain[j, 0], turns[j, 0], turns[j, 1], v)
    return v


@jit
def _spun(chain, turns, rates, row, i):
    """Return the rate behind the chain whose axes turn at these rates."""
    v = (0.0, 0.0, 0.0)
    for j in range(chain.shape[0]):
        axis, m = chain[j]
        v = _turned(axis, turns[j, 0], turns[j, 1], v)
        if m >= 0:
            w = rates[row, m, i]
            v = (
                v[0] + w if axis == 0 else v[0],
                v[1] + w if axis == 1 else v[1],
                v[2] + w if axis == 2 else v[2],
            )
    return v


@jit
def _turning(rates, row, i):
    """Return whether an axis has a rate."""
    for m in range(rates.shape[1]):  # noqa: SIM110 - no generator is compiled
        if rates[row, m, i] != 0.0:
            return True
    return False


@jit
def _rests(angles, rates, row):
    """Return whether no angle changes and nothing turns."""
    for m in range(angles.shape[1]):
        for i in range(1, angles.shape[2]):
            if angles[row, m, i] != angles[row, m, 0]:
                return False
    for m in range(rates.shape[1]):
        for i in range(rates.shape[2]):
            if rates[row, m, i] != 0.0:
                return False
    return True


@patient
def carried(chain, fixed, angles, vectors, out):
    """Carry a constant vector of each run, (R, 3), into ``out``, shape (1, 3, R, n).

    ``chain`` has shape (s, 2), ``angles`` (R, k, n), and ``fixed``, (R, s, 2), the cosines and sines that stay.
    """
    for row in range(out.shape[2]):
        turns, v = fixed[row].copy(), (0.0, 0.0, 0.0)
        for i in range(out.shape[3]):
            if _looked(chain, turns, angles, row, i):
                v = _through(chain, turns, (vectors[row, 0], vectors[row, 1], vectors[row, 2]))
            out[0, 0, row, i], out[0, 1, row, i], out[0, 2, row, i] = v


@patient
def spun(chain, fixed, angles, rates, out):
    """Rate against the base at each sample, (1, 3, R, n), for ``rates`` (R, k, n); the rest as of `carried`."""
    for row in range(out.shape[2]):
        if _rests(angles, rates, row):
            out[0, :, row] = 0.0
            continue
        turns = fixed[row].copy()
        for i in range(out.shape[3]):
            _looked(chain, turns, angles, row, i)
            v = (0.0, 0.0, 0.0)
            if _turning(rates, row, i):
                v = _spun(chain, turns, rates, row, i)
            out[0, 0, row, i], out[0, 1, row, i], out[0, 2, row, i] = v


@patient
def felt(chain, fixed, angles, rates, earth, force, out):
    """Mean inertial rates and mean forces, (2, 3, R, n), by Simpson's rule of the Earth's rate and the force.

    ``angles`` (R, k, 2 n + 1) at edges and middles, ``rates`` (R, k, n), ``earth`` and ``force`` (R, 3) of the base.
    """
    for row in range(out.shape[2]):
        turns = fixed[row].copy()
        e0, f0 = (earth[row, 0], earth[row, 1], earth[row, 2]), (force[row, 0], force[row, 1], force[row, 2])
        _looked(chain, turns, angles, row, 0)
        e, f = _through(chain, turns, e0), _through(chain, turns, f0)
        if _rests(angles, rates, row):  # as below
            for c in range(3):
                out[0, c, row] = (e[c] + 4.0 * e[c] + e[c]) / 6.0
                out[1, c, row] = (f[c] + 4.0 * f[c] + f[c]) / 6.0
            continue
        for i in range(out.shape[3]):
            w, em, fm = (0.0, 0.0, 0.0), e, f
            if _turning(rates, row, i):
                w = _spun(chain, turns, rates, row, i)
            if _looked(chain, turns, angles, row, 2 * i + 1):
                em, fm = _through(chain, turns, e0), _through(chain, turns, f0)
            el, fl = em, fm
            if _looked(chain, turns, angles, row, 2 * i + 2):
                el, fl = _through(chain, turns, e0), _through(chain, turns, f0)
            for c in range(3):
                out[0, c, row, i] = w[c] + (e[c] + 4.0 * em[c] + el[c]) / 6.0
                out[1, c, row, i] = (f[c] + 4.0 * fm[c] + fl[c]) / 6.0
            e, f = el, fl
