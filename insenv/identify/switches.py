"""What a reader may switch on and off: the columns of every effect that was found or tried, at its shape.

y - X theta = after:   with X, the priors and the noise's spectra anyone can fit any of these models anew
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from insenv.core.recording import Floats
from insenv.identify.findings import Solved, Switch, Switchable
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.noise import eigenvalues
from insenv.identify.fit.problem import NOISE_TERMS, Problem, Term, free_bins
from insenv.identify.fit.uncertainty import of_true_rates, shapes_as_stated
from insenv.identify.search.tracks import Track

#: Refused effects that can be tried, the likeliest ones; rivals of one effect.
MOST_REFUSED, MOST_RIVALS = 4, 3
#: Bins beyond which refused ones are left out, and free bins beyond which nothing is switched: the file would be large.
MOST_BINS, MOST_FREE = 12000, 60
#: Eigenvalues at which the spectra of the noise are told.
SPECTRUM = 200

#: Of a column: name, unit, standard deviation of its prior.
Named = tuple[str, str, float]


def switchable(track: Track) -> Switchable | None:
    """Everything that was found or tried on a target; None where too many bins are free."""
    problem, fit = track.problem, track.fit
    free = free_bins(problem)
    if len(free) > MOST_FREE:
        return None
    terms, switches = offered(track)
    # A law of the rate is of the rate itself, as it is stated, not of the rate times the gain of the target.
    factors = [of_true_rates(problem, term) for term in terms]
    columns = [problem.columns(term) / factor for term, factor in zip(terms, factors, strict=True)]
    names = [row for term in terms for row in problem.names(term)]
    of = [index for index, one in enumerate(columns) for _ in range(one.shape[1])]
    stated = np.array([factors[index] for index in of])
    lam = _eigenvalues(problem)
    cleaned = tuple(f"a line at {line.frequency:.4g} Hz" for line in track.prepared.lines)
    return Switchable(
        switches=switches,
        columns=np.column_stack([*columns]) if columns else np.zeros((problem.bins.n, 0)),
        of=tuple(of),
        labels=tuple((name, unit) for name, unit, _ in names),
        prior=np.array([sd for term in terms for sd in problem.priors(term)]) * np.abs(stated),
        theta=stated * _found(track.fit, tuple(range(len(track.fit.model))), names, of),
        free=free,
        blocks=tuple((b.run + 1, b.start, b.stop, b.fitted, b.span) for b in problem.bins.blocks),
        width=problem.bins.width,
        most=None if problem.most is None else tuple(map(float, problem.most)),
        noise=tuple(term.id for term in NOISE_TERMS),
        lam=lam,
        spectra=np.column_stack([term.spectrum(lam, problem.bins.width) for term in NOISE_TERMS]),
        known=_known(track.problem, terms, switches, (names, of, stated)),
        own_level=any(term.effect.part == "level" and term.per_run for term in fit.model),
        rows=_rows(problem),
        cleaned=(*cleaned, *(("a held output",) if track.prepared.held.hold else ())),
    )


def _rows(problem: Problem) -> np.ndarray:
    """First row and end of each bin, counted through all runs, shape (bins, 2)."""
    found, offset = [], 0
    for exposure, kept, weights in zip(problem.exposures, problem.bins.kept, problem.bins.weights, strict=True):
        cell, per_bin = exposure.cell_of_row, weights.shape[1]
        inside = np.flatnonzero(cell >= 0)
        of_bin = cell[inside] // per_bin
        first = inside[np.searchsorted(of_bin, kept)]
        last = inside[np.searchsorted(of_bin, kept, side="right") - 1]
        found.append(offset + np.column_stack([first, last + 1]))
        offset += len(cell)
    return np.concatenate(found)


def offered(track: Track) -> tuple[tuple[Term, ...], tuple[Switch, ...]]:
    """The terms of the final model, rivals of each added one, and the likeliest of the refused ones."""
    declared = len(track.prepared.model)
    rows = [(term, "declared" if k < declared else "added", "") for k, term in enumerate(track.fit.model)]
    seen = {term.effect.key for term in track.fit.model}
    few = track.problem.bins.n <= MOST_BINS

    def add(term: Term, role: str, of: str = "") -> bool:
        if term.effect.key in seen:
            return False
        seen.add(term.effect.key)
        rows.append((term, role, of))
        return True

    for step, rivalry in zip(track.steps, track.rivalries, strict=False):
        for term in rivalry.terms[:MOST_RIVALS]:
            add(term, "rival", step.hit.term.effect.key)
    tried = [*(r.hit for r in track.refusals), *track.last_physical, *(track.hits or ())]
    left = MOST_REFUSED if few else 0
    for hit in sorted(tried, key=lambda hit: -hit.likelihood_ratio):
        left -= left > 0 and add(hit.term, "refused")
        if not left:
            break
    switches = tuple(
        Switch(term.effect.key, role, of, term.effect.generic, _shape(track.problem, term)) for term, role, of in rows
    )
    return tuple(term for term, _, _ in rows), switches


def _known(
    problem: Problem,
    terms: tuple[Term, ...],
    switches: tuple[Switch, ...],
    columns: tuple[list[Named], list[int], Floats],
) -> tuple[Solved, ...]:
    """The declared model, the final one, that with one switch turned, and with two of which one is a curve."""
    names, of, stated = columns
    final = tuple(one.role in ("declared", "added") for one in switches)
    some = range(len(final))
    pairs = ((i, j) for i, j in combinations(some, 2) if switches[i].generic or switches[j].generic)
    turned = (tuple(on != (k in pair) for k, on in enumerate(final)) for pair in (*((j,) for j in some), *pairs))
    states = dict.fromkeys((final, tuple(one.role == "declared" for one in switches), *turned))
    found = []
    for state in states:
        inside = tuple(k for k, on in enumerate(state) if on)
        fit = solve(problem, tuple(terms[k] for k in inside))
        theta = tuple(map(float, stated * _found(fit, inside, names, of)))
        found.append(Solved(state, tuple(map(float, fit.noise.power)), theta))
    return tuple(found)


def _shape(problem: Problem, term: Term) -> tuple[tuple[str, float, str], ...]:
    shapes, factors = getattr(term.effect, "shapes", ()), shapes_as_stated(problem, term)
    return tuple(
        (p.name, f * float(v), p.unit_on(problem.unit)) for p, v, f in zip(shapes, term.shape, factors, strict=True)
    )


def _found(fit: Fit, inside: tuple[int, ...], names: list[Named], of: list[int]) -> Floats:
    """Coefficients of all columns [SI]; zero of terms not ``inside`` the model, and where a column adds nothing."""
    design = fit.design
    known = {
        (inside[int(term)], label[1]): value
        for term, label, value in zip(design.term, design.labels, fit.theta, strict=True)
        if term >= 0
    }
    return np.array([known.get((k, row[0]), 0.0) for k, row in zip(of, names, strict=True)])


def _eigenvalues(problem: Problem) -> np.ndarray:
    """A grid of eigenvalues from that of half a mode of the longest run to 4."""
    longest = max(max(b.span, b.n) for b in problem.bins.blocks)
    least = 4 * np.sin(0.25 * np.pi / longest) ** 2
    return np.geomspace(0.999 * min(least, eigenvalues(problem.fitted).max()), 4.0, SPECTRUM)
