"""What a reader may switch on and off in positions: every model of the effects found or tried, fitted beforehand.

The fits are not linear, and there are few effects: a page holds what each model leaves of each rest or turn, instead
of what it would take to fit it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Recording
from insenv.effects.catalogue import by_key
from insenv.identify.findings import Estimate, OfferedModel, OfferedModels, Switch
from insenv.identify.positions.evidence import held_out_error, noise_floor
from insenv.identify.positions.gyros.means import RestMeans, RestTerm
from insenv.identify.positions.gyros.rotations import Rotations
from insenv.identify.positions.least_squares import Fit, solve
from insenv.identify.positions.model import triad_term
from insenv.identify.positions.part import Part
from insenv.identify.positions.rests import Rest
from insenv.identify.positions.trace import Positions

#: Most effects that can be switched: k of them have 2^k models.
MOST = 8
#: Models times rests or turns beyond which refused ones are left out: the page would be large.
MOST_VALUES = 20_000

#: Which switches are on, and the fit of that model.
Fitted = tuple[tuple[bool, ...], Fit]
#: Coefficients of a term in a fit, as a target shows them.
Estimates = Callable[[Fit, Any], Sequence[Estimate]]


def offered(part: Part) -> tuple[tuple[Any, Switch], ...]:
    """Terms with their switches: the final model, rivals of each added effect, and what was refused."""
    outcome = part.outcome
    declared = len(outcome.before.terms)
    rows: list[tuple[Any, Switch]] = [
        (term, Switch(term.effect.key, "declared" if k < declared else "added"))
        for k, term in enumerate(outcome.after.terms)
    ]
    others = [Switch(rival, "rival", key) for key, rivals in outcome.rivals.items() for rival in rivals]
    others += [Switch(r.effect, "refused") for r in sorted(outcome.rejected, key=lambda r: r.p_value)]
    units = int((part.problem.fitted | part.problem.held_out).sum())
    for switch in others:
        # Of a curve that was refused nobody kept its shape.
        full = len(rows) >= MOST or units * 2 ** (len(rows) + 1) > MOST_VALUES or by_key(switch.effect).shapes
        if not full and switch.effect not in {one.effect for _, one in rows}:
            rows.append((_term(part, switch.effect), switch))
    return tuple(rows)


def fits(part: Part) -> tuple[Fitted, ...]:
    """Of every set of switches; of those that leave no freedom, or that cannot be solved, none."""
    terms = [term for term, _ in offered(part)]
    return tuple(_each(part, terms)) if 0 < len(terms) <= MOST else ()


def _each(part: Part, terms: Sequence[Any]) -> Iterator[Fitted]:
    known = {_keys(fit.terms): fit for fit in (part.outcome.before, part.outcome.after)}
    for on in product((True, False), repeat=len(terms)):
        model = tuple(term for term, one in zip(terms, on, strict=True) if one)
        try:
            fit = known.get(_keys(model)) or solve(part.problem, model)
        except np.linalg.LinAlgError:
            continue
        if fit.freedom >= 1:
            yield on, fit


def _keys(terms: Sequence[Any]) -> tuple[str, ...]:
    return tuple(term.effect.key for term in terms)


def offered_models(
    part: Part, fitted: Sequence[Fitted], column: int, rows: NDArray[np.int64], estimates: Estimates
) -> OfferedModels | None:
    """What the page of a target shows of the fits, component ``column``; None where there is nothing to switch."""
    used, terms = part.problem.fitted | part.problem.held_out, [term for term, _ in offered(part)]
    models = tuple(
        OfferedModel(
            on=on,
            left=part.problem.plain(fit.residual)[used, column],
            rms=held_out_error(part.problem, fit),
            noise_floor=noise_floor(part.problem, fit),
            log_likelihood=-0.5 * part.problem.rank * int(part.problem.fitted.sum()) * float(np.log(fit.rss)),
            estimates=tuple((k, one) for k, term in enumerate(terms) if on[k] for one in estimates(fit, term)),
        )
        for on, fit in fitted
        if np.isfinite(fit.residual).all() and fit.rss > 0
    )
    if not models:
        return None
    return OfferedModels(tuple(switch for _, switch in offered(part)), models, rows[used])


def _term(part: Part, key: str) -> Any:
    effect = by_key(key)
    return RestTerm(effect) if isinstance(part.problem, RestMeans) else triad_term(effect)  # type: ignore[arg-type]


def rows_of(recordings: Sequence[Recording], found: Positions, part: Part) -> NDArray[np.int64]:
    """First row and end of each rest, of a turn those of the rest before it; counted through all runs."""
    offset = np.cumsum([0, *(len(recording) for recording in recordings)])

    def rows(rest: Rest) -> tuple[int, int]:
        return int(offset[rest.run]) + rest.start, int(offset[rest.run]) + rest.stop

    if isinstance(part.problem, Rotations):
        of = {rest.number: rest for rest in found.calm}
        return np.array([rows(of[turn.before]) for turn in part.problem.turns])
    return np.array([rows(rest) for rest in (found.calm if isinstance(part.problem, RestMeans) else found.rests)])
