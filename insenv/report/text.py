"""The summary that the command prints: the verdict in plain words, then the figures behind it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from textwrap import wrap

from insenv.identify.findings import Added, Estimate, Findings, Rejected, TargetFindings
from insenv.report import words
from insenv.report.quantities import number, p_value, span, unit_for, with_sd

#: Candidates of no further interest that are named before the rest is only counted.
_REFUSED_SHOWN = 4


def summary(findings: Findings, width: int = 100) -> str:
    """``findings`` as text of at most ``width`` columns where no table needs more; no final line break."""
    lines = list(_paragraph(words.overall(findings), width))
    if findings.title:
        about = f"{findings.title}: {findings.rows} rows, {span(findings.duration)}"
        lines += ["", *_paragraph(about, width)]
    if len(findings.targets) > 1:
        lines += ["", *_all_targets(findings.targets)]
    same = len({target.not_testable for target in findings.targets}) == 1
    for target in findings.targets:
        lines += ["", *_target(target, findings.alpha, width)]
        lines += [] if same else _not_testable(target, width)
    lines += list(_not_testable(findings.targets[0], width)) if same else []
    if findings.remarks:
        lines += ["", "About the data", *_items(findings.remarks, width)]
    return "\n".join(_printable(line).rstrip() for line in lines)


def _printable(line: str) -> str:
    """``line`` without control characters: a title from a file must not steer the terminal."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in line)


def _all_targets(targets: Sequence[TargetFindings]) -> list[str]:
    """One row for each target: held-out error before and after, noise floor, verdict."""
    rows = [("held-out error, rms", "before", "after", "noise alone", "verdict")]
    for target in targets:
        h = target.held_out
        unit = unit_for(h.unit, h.before, h.after)
        figures = (number(unit.of(x)) for x in (h.before, h.after, h.noise_floor))
        rows.append((f"{target.target} [{unit.label}]", *figures, target.verdict))  # type: ignore[arg-type]
    return _table(rows, "lrrrl")


def _target(target: TargetFindings, alpha: float, width: int) -> Iterator[str]:
    """All about one target."""
    title = f"{target.target}: {target.verdict}"
    yield title
    yield "-" * len(title)
    for sentence in words.sureness(target, alpha):
        yield from _paragraph(sentence, width)
    yield ""
    yield from _held_out(target)
    if target.added:
        yield from ("", "Added to the model")
    for added in target.added:
        yield from _added(added, target.unit, width)
    yield from _estimates(target)
    yield from _noise(target)
    yield from _refused(target.rejected)
    yield from _cannot_be_told(target, width)
    yield from _next(target, width)


def _held_out(target: TargetFindings) -> Iterator[str]:
    h = target.held_out
    unit = unit_for(h.unit, h.before, h.after)
    rows = [
        ("declared model", unit.show(h.before), ""),
        ("with what was added", unit.show(h.after), words.change(h)),
        ("noise alone", unit.show(h.noise_floor), ""),
    ]
    yield f"Held-out error, rms of means over {span(h.averaging)}"
    yield from _table(rows if target.added else [rows[0], rows[2]], "lrr")


def _added(added: Added, unit: str, width: int) -> Iterator[str]:
    key = words.key_of(added)
    figures = ", ".join(f"{p.parameter} = {_value(p)}" for p in added.parameters)
    yield from _hang(f"{key}: {figures}", width)
    show = unit_for(unit, added.held_out_before, added.held_out_after)
    before, after = number(show.of(added.held_out_before)), show.show(added.held_out_after)
    evidence = f"p {p_value(added.p_value)}, held-out error {before} → {after}"
    yield from _hang(evidence, width, "    ")
    for line in filter(None, (words.meaning(key), added.remark)):
        yield from _hang(line, width, "    ")


def _value(p: Estimate) -> str:
    unit = unit_for(p.unit, p.value, p.sd)
    return unit.show_with_sd(p.value, p.sd)


def _estimates(target: TargetFindings) -> Iterator[str]:
    pairs = words.paired(target.estimates_before, target.estimates_after)
    if not pairs:
        return
    rows = [
        ("declared parameter", "before", "after" if target.added else "", "shift" if target.added else "")
    ]
    for before, after in pairs:
        unit = unit_for(
            before.unit, before.value, before.sd, *(() if after is None else (after.value, after.sd))
        )
        shown = [with_sd(unit.of(e.value), unit.of(e.sd)) if e else "—" for e in (before, after)]
        name = f"{before.effect} {before.parameter}" + (f" [{unit.label}]" if unit.label else "")
        moved = words.shift(before, after)
        shift = f"{moved:+.1f} sd" if abs(moved) < 1e4 else "—"
        rows.append((name, shown[0], shown[1] if target.added else "", shift if target.added else ""))
    yield ""
    yield from _table(rows, "lrrr")


def _noise(target: TargetFindings) -> Iterator[str]:
    if target.noise:
        rows = [(f"{words.noise_name(n.effect, target.unit)} {n.parameter}", _value(n)) for n in target.noise]
        yield from ("", "Noise of the residual")
        yield from _table(rows, "lr")


def _refused(rejected: Sequence[Rejected]) -> Iterator[str]:
    """The refusals worth a line each: those that were not for want of significance, and the next best."""
    if not rejected:
        return
    ranked = sorted(rejected, key=lambda r: (r.reason == "not significant", r.p_value))
    telling = sum(r.reason != "not significant" for r in ranked)
    shown = ranked[: max(telling, _REFUSED_SHOWN)]
    yield from ("", "Tried and refused")
    yield from _table([(r.effect, f"p {p_value(r.p_value)}", r.reason) for r in shown], "lll")
    if len(ranked) > len(shown):
        rest = len(ranked) - len(shown)
        yield f"  and {rest} more, not significant (p {p_value(ranked[len(shown)].p_value)} or more)"


def _cannot_be_told(target: TargetFindings, width: int) -> Iterator[str]:
    sets = words.rival_sets(target)
    if sets:
        yield from ("", "Cannot be told apart with this recording")
        yield from _items((words.listing(rivals, "or") for rivals in sets), width)


def _not_testable(target: TargetFindings, width: int) -> Iterator[str]:
    if target.not_testable:
        yield from ("", "Not testable with this recording")
        yield from _items(
            (f"{needs}: {', '.join(effects)}" for needs, effects in words.by_need(target)), width
        )


def _next(target: TargetFindings, width: int) -> Iterator[str]:
    if not target.next_experiment:
        return
    yield from ("", "Next experiment")
    for one in target.next_experiment:
        sigma = one.expected_separation_sigma
        sure = "" if sigma is None else f" (expected separation {number(sigma, 2)} sd)"
        yield from _items([f"{one.procedure}{sure}; separates {words.listing(one.separates)}"], width)


def _paragraph(text: str, width: int) -> list[str]:
    return wrap(text, width, break_long_words=False, break_on_hyphens=False)


def _hang(text: str, width: int, indent: str = "  ") -> list[str]:
    return wrap(
        text, width, initial_indent=indent, subsequent_indent=indent + "  ", break_long_words=False,
        break_on_hyphens=False,
    )  # fmt: skip


def _items(items: Iterable[str], width: int) -> Iterator[str]:
    for item in items:
        yield from _hang(item, width)


def _table(rows: Sequence[Sequence[str]], align: str) -> list[str]:
    """Rows of cells in columns, two spaces apart; ``align`` has "l" or "r" for each column."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(align))]
    return [
        "  "
        + "  ".join(
            c.ljust(w) if a == "l" else c.rjust(w) for c, w, a in zip(row, widths, align, strict=True)
        )
        for row in rows
    ]
