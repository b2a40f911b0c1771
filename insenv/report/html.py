"""The HTML report: one file with its pictures inside; nothing in it runs or is fetched.

matplotlib and jinja2 are imported when a report is made, not before.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from insenv.core.files import write_whole
from insenv.core.quantities import number, p_value, percent, span
from insenv.identify.findings import (
    Added,
    Estimate,
    Findings,
    NextExperiment,
    Rejected,
    TargetFindings,
)
from insenv.report import estimates, explore, found, sentences, words
from insenv.report.page import rendered

Row = dict[str, Any]

#: Title of each picture, and what a good one looks like.
_SEEN = {
    "time": (
        "Residual against time",
        "Good: after, a level band about zero that is no wider in the shaded part, which no fit saw.",
    ),
    "angle": ("Residual against table angle", "Good: after, a level line; waves over a turn are of the table."),
    "rate": (
        "Residual against rate",
        "Good: after, a level line; slope, bow and steps are errors of the scale factor.",
    ),
    "temperature": (
        "Residual against temperature",
        "Joined in time. Good: after, a level line; a loop that is open between warming and cooling is a delay.",
    ),
    "force": ("Residual against specific force", "Good: after, a level line."),
    "turned": ("Residual against the turn about the axis", "Good: after, a level line."),
    "samples": (
        "Spectrum of the samples",
        "Good: no peak stands out but those marked. Lines beyond the dotted line reach the means as aliases alone.",
    ),
    "effect": (
        "The effect on what is left without it",
        "Good: the line runs through the dots, and through the held-out ones too.",
    ),
    "psd": (
        "Spectrum of the residual",
        "Good: after, the thick line follows the fitted noise and no peak stands out of it.",
    ),
    "adev": (
        "Allan deviation of the residual",
        "Good: after, the fitted noise runs within the band at every averaging time; lower is better.",
    ),
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
    from markupsafe import Markup

    data, switched = explore.data(findings)
    return rendered(
        "report.html.j2",
        findings.filing,
        explore.scripts() if data else (),
        explore.style() if data else "",
        data=Markup(data),
        switched=switched,
        title=findings.title or findings.manifest,
        findings=findings,
        overall=sentences.overall(findings),
        cautions=sentences.cautions(findings),
        label=_label_of_all(findings.targets),
        duration=span(findings.duration) if findings.timed else "",
        alpha=percent(findings.alpha),
        targets=[
            {**_target(t, f"t{i}", findings.alpha), "once": found.as_before(t, findings.targets)}
            for i, t in enumerate(findings.targets, 1)
        ],
        method=words.METHOD_OF_POSITIONS if findings.procedure == "multi-position" else words.METHOD,
    )


def _label(verdict: str) -> tuple[str, str]:
    return words.LABELS.get(verdict, (verdict, "plain"))


def _label_of_all(targets: Sequence[TargetFindings]) -> tuple[str, str]:
    """The label that all targets share; where they differ, each label with its targets, in a neutral tone."""
    names: dict[tuple[str, str], list[str]] = {}
    for target in targets:
        names.setdefault(_label(target.verdict), []).append(target.target)
    if len(names) == 1:
        return next(iter(names))
    return " · ".join(f"{label}: {', '.join(who)}" for (label, _), who in names.items()), "plain"


def _target(target: TargetFindings, ident: str, alpha: float) -> Row:
    """Everything that the template shows of one target, as ready text."""
    pairs = estimates.pairs(target.estimates_before, target.estimates_after)
    return {
        "id": ident,
        "name": target.target,
        "label": _label(target.verdict),
        "headline": sentences.headline(target),
        "sureness": sentences.sureness(target, alpha),
        "declared": ", ".join(target.declared) or "nothing",
        "held_out": _held_out(target),
        "added": [_kind(alike, target) for alike in found.kinds(target.added)],
        "listed": found.listed(target.added),
        "estimates": [_estimate(p) for p in pairs],
        "derived": estimates.derived(target),
        "none_means": estimates.NONE_MEANS if any(estimates.NONE in (p.before, p.after) for p in pairs) else "",
        "noise": [_noise(n, target.unit) for n in target.noise],
        "candidates": _candidates(target),
        "rivals": [words.listing(sentences.rivals(target, keys), "or") for keys in sentences.rival_sets(target)],
        "not_testable": sentences.by_need(target),
        "next": [_next(n) for n in target.next_experiment],
        "pictures": _pictures(target, ident),
    }


def _held_out(target: TargetFindings) -> Row:
    held_out, unit = target.held_out, sentences.held_out_unit(target)
    return {
        "unit": unit.label,
        "of": sentences.scored(held_out),
        "before": number(unit.of(held_out.before)),
        "after": number(unit.of(held_out.after)),
        "floor": number(unit.of(held_out.noise_floor)),
        "change": sentences.change(held_out),
        "bars": _bars(held_out.before, held_out.after, held_out.noise_floor),
    }


def _bars(*values: float) -> list[str]:
    """Lengths of bars in percent of the longest that is finite; none for what is no number."""
    longest = max((v for v in values if math.isfinite(v)), default=0.0) or 1.0
    return [f"{min(100 * v / longest, 100.0):.1f}" if v == v else "0" for v in values]


def _kind(alike: Sequence[Added], target: TargetFindings) -> Row:
    """Found effects that share a key: what they are is said once."""
    key = words.key_of(alike[0])
    return {
        "key": key,
        "title": found.title(alike),
        "meaning": words.meaning(key),
        "generic": alike[0].generic,
        "each": [_added(one, target) for one in alike],
    }


def _added(added: Added, target: TargetFindings) -> Row:
    show = sentences.held_out_unit(target, added)
    return {
        "remark": added.remark,
        "parameters": estimates.parameters(added),
        "p": found.evidence(added),
        "before": show.number(added.held_out_before),
        "after": show.show(added.held_out_after) + found.together(added, target.added),
        "confounded": words.listing(sentences.rivals(target, added.confounded_with)),
    }


def _noise(noise: Estimate, unit: str) -> Row:
    return {
        "name": words.noise_name(noise.effect, unit),
        "symbol": noise.parameter,
        "value": estimates.value(noise),
    }


def _next(experiment: NextExperiment) -> Row:
    sigma = experiment.expected_separation_sigma
    return {
        "procedure": experiment.procedure,
        "separates": words.listing(map(words.name, experiment.separates)),
        "sigma": "" if sigma is None else number(sigma, 2),
    }


def _estimate(pair: estimates.EstimatePair) -> Row:
    return {**asdict(pair), "stated": pair.stated, "name": words.name(pair.effect)}


def _candidates(target: TargetFindings) -> list[Row]:
    """Added effects in the order of their addition, then the refused ones by p-value."""
    added = [_candidate(words.key_of(a), a, "added") for a in target.added]
    refused = sorted(target.rejected, key=lambda r: (r.p_value, -r.likelihood_ratio))
    return added + [
        {**_candidate(r.effect, r, r.reason, sentences.again(r.effect, target)), "outcome": sentences.outcome(r)}
        for r in refused
    ]


def _candidate(key: str, tried: Added | Rejected, outcome: str, note: str = "") -> Row:
    return {
        "key": key,
        "name": words.name(key) + note,
        "likelihood_ratio": number(tried.likelihood_ratio),
        "p": p_value(tried.p_value).removeprefix("= "),
        "outcome": outcome,
        "added": isinstance(tried, Added),
        "telling": outcome not in ("added", "not significant"),
    }


def _pictures(target: TargetFindings, ident: str) -> Row:
    """The pictures of a target as ``<svg>`` elements with their captions."""
    from markupsafe import Markup

    from insenv.report import evidence, figures
    from insenv.report.svg import inline

    shown, model, sampled = figures.covariates(target), target.switchable(), target.samples()

    def picture(figure: Any, key: str, form: str = "") -> Row:
        title, good = _SEEN[key]
        svg = Markup(inline(figure, f"{ident}-{key}{form}", f"{title}, {target.target}"))
        return {"key": key, "title": title, "good": good, "svg": svg}

    def panels() -> Iterable[Row]:
        for key in shown:
            yield picture(figures.against(target, key), key)
        if not len(target.spectra.f):
            return
        yield picture(figures.spectrum(target), "psd")
        yield picture(figures.allan(target), "adev")

    return {
        "time": picture(figures.against_time(target), "time"),
        "phone": picture(figures.against_time(target, narrow=True), "time", "-phone"),
        "panels": list(panels()),
        "samples": None if sampled is None else picture(evidence.samples(target, sampled), "samples"),
        "effects": {}
        if model is None
        else {
            key: picture(figure, "effect", f"-{k}") for k, (key, figure) in enumerate(evidence.effects(target, model))
        },
        "constant": words.listing(k for k in target.traces.covariates if k not in shown),
    }
