"""What a reader may switch on and off: the columns of every effect that was found or tried, at its shape.

y - X theta = after:   with X, the priors and the noise's spectra anyone can fit any of these models anew
"""

from __future__ import annotations

import numpy as np

from insenv.identify.findings import Switch, Switchable
from insenv.identify.fit.gls import solve
from insenv.identify.fit.noise import eigenvalues
from insenv.identify.fit.problem import NOISE_TERMS, Problem, Term, free_bins
from insenv.identify.search.tracks import Track

#: Refused effects that can be tried, the likeliest ones; rivals of one effect.
MOST_REFUSED, MOST_RIVALS = 4, 3
#: Bins beyond which refused ones are left out, and free bins beyond which nothing is switched: the file would be large.
MOST_BINS, MOST_FREE = 12000, 60
#: Eigenvalues at which the spectra of the noise are told.
SPECTRUM = 200


def switchable(track: Track) -> Switchable | None:
    """Everything that was found or tried on a target; None where too many bins are free."""
    problem, fit = track.problem, track.fit
    free = free_bins(problem)
    if len(free) > MOST_FREE:
        return None
    terms, switches = offered(track)
    columns = [problem.columns(term) for term in terms]
    names = [row for term in terms for row in problem.names(term)]
    of = [index for index, one in enumerate(columns) for _ in range(one.shape[1])]
    lam = _eigenvalues(problem)
    cleaned = tuple(f"a line at {line.frequency:.4g} Hz" for line in track.prepared.lines)
    return Switchable(
        switches=switches,
        columns=np.column_stack([*columns]) if columns else np.zeros((problem.bins.n, 0)),
        of=tuple(of),
        labels=tuple((name, unit) for name, unit, _ in names),
        prior=np.array([sd for term in terms for sd in problem.priors(term)]),
        theta=_found(track, terms, names, of),
        free=free,
        blocks=tuple((b.run + 1, b.start, b.stop, b.fitted, b.span) for b in problem.bins.blocks),
        width=problem.bins.width,
        most=None if problem.most is None else tuple(map(float, problem.most)),
        noise=tuple(term.id for term in NOISE_TERMS),
        lam=lam,
        spectra=np.column_stack([term.spectrum(lam, problem.bins.width) for term in NOISE_TERMS]),
        known=_known(track, terms, switches),
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
    track: Track, terms: tuple[Term, ...], switches: tuple[Switch, ...]
) -> tuple[tuple[tuple[bool, ...], tuple[float, ...]], ...]:
    """Powers of the noise of the declared model, of the final one, and of that with one switch turned."""
    final = tuple(one.role in ("declared", "added") for one in switches)
    turned = (tuple(on != (k == j) for k, on in enumerate(final)) for j in range(len(final)))
    states = dict.fromkeys((final, tuple(one.role == "declared" for one in switches), *turned))
    found = []
    for state in states:
        model = tuple(term for term, on in zip(terms, state, strict=True) if on)
        found.append((state, tuple(map(float, solve(track.problem, model).noise.power))))
    return tuple(found)


def _shape(problem: Problem, term: Term) -> tuple[tuple[str, float, str], ...]:
    shapes = getattr(term.effect, "shapes", ())
    return tuple((p.name, float(v), p.unit_on(problem.unit)) for p, v in zip(shapes, term.shape, strict=True))


def _found(track: Track, terms: tuple[Term, ...], names: list[tuple[str, str, float]], of: list[int]) -> np.ndarray:
    """Coefficients of the final model, SI."""
    design = track.fit.design
    known = {
        (int(term), label[1]): value
        for term, label, value in zip(design.term, design.labels, track.fit.theta, strict=True)
    }
    inside = len(track.fit.model)
    return np.array([known.get((k, row[0]), 0.0) if k < inside else 0.0 for k, row in zip(of, names, strict=True)])


def _eigenvalues(problem: Problem) -> np.ndarray:
    """A grid of eigenvalues from that of half a mode of the longest run to 4."""
    longest = max(max(b.span, b.n) for b in problem.bins.blocks)
    least = 4 * np.sin(0.25 * np.pi / longest) ** 2
    return np.geomspace(0.999 * min(least, eigenvalues(problem.fitted).max()), 4.0, SPECTRUM)
