"""Where axes are and how fast they turn, compiled: `insenv.core.unit.turns.Turns.at`, axis by axis of each run."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from insenv.core.compiled import patient


def _at(t, begin, time, ramp, start, angle, out):
    """Angles and rates, (2, R, n), of R axes with turns of shape (R,) at times of shape (n,)."""
    for row in range(len(begin)):
        whole, up = time[row], ramp[row]
        peak = angle[row] / (whole - up) if whole > up else 0.0
        slope = peak / up if up > 0.0 else 0.0
        for i in range(len(t)):
            s = min(max(t[i] - begin[row], 0.0), whole)
            left = whole - s
            if left < up:
                out[0, row, i] = start[row] + (angle[row] - 0.5 * slope * left * left)
            elif s < up:
                out[0, row, i] = start[row] + 0.5 * slope * s * s
            else:
                out[0, row, i] = start[row] + peak * (s - 0.5 * up)
            if s < up:
                out[1, row, i] = slope * s
            elif left < up:
                out[1, row, i] = slope * left
            else:
                out[1, row, i] = peak


at = patient(_at)
