"""What a reader may switch on and off of a whole unit on a table: every effect that was found or tried.

The problem is linear. A page fits it anew from the triangle of its fitted cells, which is small however many they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from insenv.core.unit.motion import UNIT
from insenv.identify.findings import Switch, SwitchableUnit
from insenv.identify.positions.least_squares import solve
from insenv.identify.positions.on_axes.problem import UnitTerm
from insenv.identify.positions.on_axes.trace import UnitFound

#: Most refused effects of the gyros, of the accelerometers and of the table, the likeliest ones.
MOST_REFUSED = 4


@dataclass(frozen=True)
class Offered:
    """A term and its switch."""

    term: UnitTerm
    switch: Switch


def offered(found: UnitFound) -> tuple[Offered, ...]:
    """The terms of the final model, rivals of each added one, and the likeliest of those that were refused."""
    outcome = found.outcome
    declared = len(outcome.before.terms)
    rows = [
        Offered(term, _switch(term, "declared" if k < declared else "added"))
        for k, term in enumerate(outcome.after.terms)
    ]
    others = [(rival, "rival", key) for key, rivals in outcome.rivals.items() for rival in rivals]
    refused = sorted(outcome.rejected, key=lambda r: (r.p_value, -r.likelihood_ratio))
    for kind in ("gyro", "accel", "table"):
        own = [r.effect for r in refused if r.effect.startswith(f"{kind}.")]
        others += [(key, "refused", "") for key in own[:MOST_REFUSED]]
    for key, role, of in others:
        if key not in {row.switch.effect for row in rows}:
            rows += [Offered(term, _switch(term, role, of)) for term in _likeliest(found, key)]
    return tuple(rows)


def _switch(term: UnitTerm, role: str, of: str = "") -> Switch:
    name = "t0" if term.effect.kind == "table" else "tau"
    return Switch(term.effect.key, role, of, shape=() if term.shape is None else ((name, term.shape, "s"),))


def _likeliest(found: UnitFound, key: str) -> list[UnitTerm]:
    """The term of a key, of several shapes the one that explains most beside what was found."""
    terms, after = [term for term in found.tried if term.effect.key == key], found.outcome.after
    if len(terms) < 2:
        return terms
    others = [term for term in after.terms if term.effect.key != key]
    return [min(terms, key=lambda term: solve(found.problem, [*others, term]).rss)]


def unit_switchable(found: UnitFound, rows: tuple[Offered, ...], target: str) -> SwitchableUnit | None:
    """Everything that can be switched, with the cells of one channel; None where nothing can."""
    problem = found.problem
    if not rows:
        return None
    terms = [row.term for row in rows]
    design, y = problem.rows(terms)
    whole = np.column_stack([design, y])[problem.fitted]
    triangle = np.asarray(np.linalg.qr(np.vstack([whole, np.zeros((whole.shape[1],) * 2)]), mode="r"), float)
    at, q = [j for term in terms for j in term.at], len(problem.nuisance)
    own = [part for part in problem.cells if part.channel == UNIT.index(target)]
    return SwitchableUnit(
        switches=tuple(row.switch for row in rows),
        of=(*(k for k, term in enumerate(terms) for _ in term.at), *(-1,) * q),
        labels=(*(_label(term, j, target) for term in terms for j in range(term.size)), *(None,) * q),
        triangle=triangle,
        deviations=np.concatenate([np.full(len(at), np.inf), problem.nuisance]),
        fitted=int(problem.fitted.sum()),
        columns=np.concatenate([np.hstack([part.columns[:, at], part.nuisance]) for part in own]),
        theta=_found(found, terms),
        rests=np.concatenate([part.rest for part in own]),
    )


def _found(found: UnitFound, terms: list[UnitTerm]) -> np.ndarray:
    """Coefficients of all columns in the final model, then the table's errors."""
    after = found.outcome.after
    own = [after.theta[after.of(t)] if t in after.terms else np.zeros(t.size) for t in terms]
    p = sum(term.size for term in after.terms)
    return np.concatenate([*own, after.theta[p:]])


def _label(term: UnitTerm, j: int, target: str) -> tuple[str, str, float] | None:
    """Name, unit and factor of a coefficient on a channel."""
    for share in term.shares[j]:
        if share.channel in ("", target):
            return share.name, share.unit, share.factor
    return None
