"""The HTML report: one file with its pictures inside; nothing in it runs or is fetched.

matplotlib and jinja2 are imported when a report is made, not before.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import insenv
from insenv.core.files import write_whole
from insenv.identify.findings import (
    Added,
    Estimate,
    Findings,
    HeldOut,
    NextExperiment,
    Rejected,
    TargetFindings,
)
from insenv.report import words
from insenv.report.quantities import number, p_value, percent, span, unit_for, with_sd

Row = dict[str, Any]

#: What to see in a picture against each covariate.
_AGAINST = {
    "angle": "Residual against table angle",
    "rate": "Residual against rate",
    "temperature": "Residual against temperature",
}


def write_html(findings: Findings, path: str | os.PathLike[str]) -> Path:
    """Write `to_html` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    return write_whole(path, to_html(findings))


def to_html(findings: Findings) -> str:
    """``findings`` as one self-contained HTML page; every text from a file is escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("insenv.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html.j2").render(
        findings=findings,
        overall=words.overall(findings),
        label=words.LABELS.get(findings.verdict, (findings.verdict, "plain")),
        duration=span(findings.duration),
        alpha=percent(findings.alpha),
        targets=[_target(t, f"t{i}", findings.alpha) for i, t in enumerate(findings.targets, 1)],
        method=words.METHOD,
        version=insenv.__version__,
    )


def _target(target: TargetFindings, ident: str, alpha: float) -> Row:
    """Everything that the template shows of one target, as ready text."""
    return {
        "id": ident,
        "name": target.target,
        "label": words.LABELS.get(target.verdict, (target.verdict, "plain")),
        "headline": words.headline(target),
        "sureness": words.sureness(target, alpha),
        "declared": ", ".join(target.declared) or "nothing",
        "held_out": _held_out(target.held_out),
        "added": [_added(a, target.unit) for a in target.added],
        "estimates": [
            _estimate(*pair) for pair in words.paired(target.estimates_before, target.estimates_after)
        ],
        "noise": [_noise(n, target.unit) for n in target.noise],
        "candidates": _candidates(target),
        "rivals": [" or ".join(words.name(key) for key in rivals) for rivals in words.rival_sets(target)],
        "not_testable": words.by_need(target),
        "next": [_next(n) for n in target.next_experiment],
        "pictures": _pictures(target, ident),
    }


def _held_out(held_out: HeldOut) -> Row:
    unit = unit_for(held_out.unit, held_out.before, held_out.after)
    return {
        "unit": unit.label,
        "averaging": span(held_out.averaging),
        "before": number(unit.of(held_out.before)),
        "after": number(unit.of(held_out.after)),
        "floor": number(unit.of(held_out.noise_floor)),
        "change": words.change(held_out),
        "bars": _bars(held_out.before, held_out.after, held_out.noise_floor),
    }


def _bars(*values: float) -> list[str]:
    """Lengths of bars in percent of the longest."""
    longest = max((v for v in values if v == v), default=0.0) or 1.0
    return [f"{100 * v / longest:.1f}" if v == v else "0" for v in values]


def _added(added: Added, unit: str) -> Row:
    show = unit_for(unit, added.held_out_before, added.held_out_after)
    key = words.key_of(added)
    return {
        "key": key,
        "name": words.name(key),
        "meaning": words.meaning(key),
        "remark": added.remark,
        "generic": added.generic,
        "parameters": [{"name": p.parameter, "value": _value(p)} for p in added.parameters],
        "p": p_value(added.p_value),
        "before": number(show.of(added.held_out_before)),
        "after": show.show(added.held_out_after),
        "confounded": words.listing(map(words.name, added.confounded_with)),
    }


def _noise(noise: Estimate, unit: str) -> Row:
    return {"name": words.noise_name(noise.effect, unit), "symbol": noise.parameter, "value": _value(noise)}


def _next(experiment: NextExperiment) -> Row:
    sigma = experiment.expected_separation_sigma
    return {
        "procedure": experiment.procedure,
        "separates": words.listing(map(words.name, experiment.separates)),
        "sigma": "" if sigma is None else number(sigma, 2),
    }


def _value(estimate: Estimate) -> str:
    unit = unit_for(estimate.unit, estimate.value, estimate.sd)
    return unit.show_with_sd(estimate.value, estimate.sd)


def _estimate(before: Estimate, after: Estimate | None) -> Row:
    unit = unit_for(before.unit, before.value, before.sd, *(() if after is None else (after.value, after.sd)))
    moved = words.shift(before, after)
    return {
        "name": words.name(before.effect),
        "parameter": before.parameter,
        "unit": unit.label,
        "before": with_sd(unit.of(before.value), unit.of(before.sd)),
        "after": "—" if after is None else with_sd(unit.of(after.value), unit.of(after.sd)),
        "shift": f"{moved:+.1f}" if abs(moved) < 1e6 else "—",
        "large": abs(moved) > 3,
    }


def _candidates(target: TargetFindings) -> list[Row]:
    """Added effects in the order of their addition, then the refused ones by p-value."""
    added = [_candidate(words.key_of(a), a, "added") for a in target.added]
    refused = sorted(target.rejected, key=lambda r: (r.p_value, -r.likelihood_ratio))
    return added + [_candidate(r.effect, r, r.reason) for r in refused]


def _candidate(key: str, tried: Added | Rejected, outcome: str) -> Row:
    return {
        "key": key,
        "name": words.name(key),
        "likelihood_ratio": number(tried.likelihood_ratio),
        "p": p_value(tried.p_value).removeprefix("= "),
        "outcome": outcome,
        "added": isinstance(tried, Added),
        "telling": outcome not in ("added", "not significant"),
    }


def _pictures(target: TargetFindings, ident: str) -> Row:
    """The pictures of a target as ``<svg>`` elements with their captions."""
    from markupsafe import Markup

    from insenv.report import figures
    from insenv.report.svg import inline

    shown = figures.covariates(target)

    def picture(figure: Any, key: str, title: str) -> Row:
        return {"title": title, "svg": Markup(inline(figure, f"{ident}-{key}", f"{title}, {target.target}"))}

    def panels() -> Iterable[Row]:
        for key in shown:
            yield picture(figures.against(target, key), key, _AGAINST[key])
        yield picture(figures.spectrum(target), "psd", "Spectrum of the residual")
        yield picture(figures.allan(target), "adev", "Allan deviation of the residual")

    return {
        "time": picture(figures.against_time(target), "time", "Residual against time"),
        "panels": list(panels()),
        "constant": words.listing(k for k in _AGAINST if k in target.traces.covariates and k not in shown),
    }
