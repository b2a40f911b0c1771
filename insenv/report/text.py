"""The summary that the command prints: the verdict in plain words, then the figures behind it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from textwrap import wrap

from insenv.core.quantities import number, p_value, span
from insenv.identify.findings import Added, Findings, NextExperiment, NotTestable, TargetFindings
from insenv.report import estimates, found, sentences, words

#: Candidates of no further interest that are named before the rest is only counted.
_REFUSED_SHOWN = 4
#: Least width of a text in the last column of a table, however narrow the terminal.
_TEXT_COLUMN = 30


def summary(findings: Findings, width: int = 100) -> str:
    """``findings`` as text of at most ``width`` columns where no table needs more; no final line break."""
    lines = list(_paragraph(sentences.overall(findings), width))
    for caution in sentences.cautions(findings):
        lines += ["", *_hang(f"Caution: {caution}", width, "")]
    if findings.title:
        about = f"{findings.title}: {findings.rows} rows{f', {span(findings.duration)}' if findings.timed else ''}"
        lines += ["", *_paragraph(about, width)]
    if len(findings.targets) > 1:
        lines += ["", *_all_targets(findings.targets)]
    for target in findings.targets:
        lines += ["", *_target(target, findings.alpha, width)]
    lines += _not_testable(findings.targets, width)
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
        unit = sentences.held_out_unit(target)
        figures = (number(unit.of(x)) for x in (h.before, h.after, h.noise_floor))
        rows.append((f"{target.target} [{unit.label}]", *figures, target.verdict))  # type: ignore[arg-type]
    return _table(rows, "lrrrl")


def _target(target: TargetFindings, alpha: float, width: int) -> Iterator[str]:
    """All about one target."""
    title = f"{target.target}: {target.verdict}"
    yield title
    yield "-" * len(title)
    for sentence in sentences.sureness(target, alpha):
        yield from _paragraph(sentence, width)
    yield ""
    yield from _held_out(target)
    if target.added:
        yield from ("", "Added to the model")
    for alike in found.kinds(target.added):
        yield from _added(alike, target, width)
    yield from _estimates(target, width)
    yield from _noise(target)
    yield from _refused(target, width)
    yield from _confounded_sets(target, width)
    yield from _next(target, width)


def _held_out(target: TargetFindings) -> Iterator[str]:
    h = target.held_out
    unit = sentences.held_out_unit(target)
    rows = [
        ("declared model", unit.show(h.before), ""),
        ("with what was added", unit.show(h.after), sentences.change(h)),
        ("noise alone", unit.show(h.noise_floor), ""),
    ]
    yield f"Held-out error, rms of {sentences.scored(h)}"
    yield from _table(rows if target.added else [rows[0], rows[2]], "lrr")


def _added(alike: Sequence[Added], target: TargetFindings, width: int) -> Iterator[str]:
    """Found effects that share a key: what they are is said once."""
    key = words.key_of(alike[0])
    for added in alike:
        yield from _hang(f"{key}: {estimates.parameters(added)}", width)
        show = sentences.held_out_unit(target, added)
        before, after = show.number(added.held_out_before), show.show(added.held_out_after)
        shared = found.together(added, target.added)
        evidence = f"p {found.evidence(added)}, held-out error {before} → {after}{shared}"
        yield from _hang(evidence, width, "    ")
        meaning = words.meaning(key) if added is alike[0] else ""
        for line in filter(None, (meaning, added.remark)):
            yield from _hang(line, width, "    ")


def _estimates(target: TargetFindings, width: int) -> Iterator[str]:
    pairs = estimates.pairs(target.estimates_before, target.estimates_after)
    if not pairs:
        return
    changed = bool(target.added)
    rows = [("declared parameter", "before", "after", "shift") if changed else ("declared parameter", "estimate")]
    for pair in pairs:
        name = f"{pair.effect} {pair.parameter}" + (f" [{pair.unit}]" if pair.unit else "")
        shift = pair.shift if pair.shift == estimates.NONE else f"{pair.shift} sd"
        rows.append((name, pair.before, pair.after, shift) if changed else (name, pair.stated))
    yield ""
    yield from _table(rows, "lrrr"[: len(rows[0])])
    if changed and any(estimates.NONE in (pair.before, pair.after) for pair in pairs):
        yield from _hang(estimates.NONE_MEANS, width)
    for line in estimates.derived(target):
        yield from _hang(line, width)


def _noise(target: TargetFindings) -> Iterator[str]:
    if target.noise:
        rows = [(f"{words.noise_name(n.effect, target.unit)} {n.parameter}", estimates.value(n)) for n in target.noise]
        yield from ("", "Noise of the residual")
        yield from _table(rows, "lr")


def _refused(target: TargetFindings, width: int) -> Iterator[str]:
    """The refusals worth a line each: those that were not for want of significance, and the next best."""
    if not target.rejected:
        return
    ranked = sorted(target.rejected, key=lambda r: (r.reason == "not significant", r.p_value))
    telling = sum(r.reason != "not significant" for r in ranked)
    shown = ranked[: max(telling, _REFUSED_SHOWN)]
    yield from ("", "Tried and refused")
    yield from _table(
        [
            (r.effect + sentences.again(r.effect, target), f"p {p_value(r.p_value)}", sentences.outcome(r))
            for r in shown
        ],
        "lll",
        width,
    )
    if len(ranked) > len(shown):
        others = [r.p_value for r in ranked[len(shown) :]]
        yield f"  and {len(others)} more, {sentences.rest(others)}"


def _confounded_sets(target: TargetFindings, width: int) -> Iterator[str]:
    sets = sentences.rival_sets(target)
    if sets:
        yield from ("", "Cannot be told apart with this recording")
        yield from _items((words.listing(rivals, "or") for rivals in sets), width)


def _not_testable(targets: Sequence[TargetFindings], width: int) -> Iterator[str]:
    """What no target could be tested for, once for all of which it is the same."""
    alike: dict[tuple[NotTestable, ...], list[TargetFindings]] = {}
    for target in targets:
        alike.setdefault(target.not_testable, []).append(target)
    for untested, those in alike.items():
        if untested:
            of = f" ({', '.join(t.target for t in those)})" if len(alike) > 1 else ""
            yield from ("", f"Not testable with this recording{of}")
            needs = sentences.by_need(those[0])
            yield from _items((f"{need}: {', '.join(effects)}" for need, effects in needs), width)


def _next(target: TargetFindings, width: int) -> Iterator[str]:
    """Each procedure once, with all that it separates."""
    if not target.next_experiment:
        return
    alike: dict[str, list[NextExperiment]] = {}
    for one in target.next_experiment:
        alike.setdefault(one.procedure, []).append(one)
    yield from ("", "Next experiment")
    for procedure, those in alike.items():
        yield from _items([f"{procedure}; separates {'; '.join(map(_separated, those))}"], width)


def _separated(one: NextExperiment) -> str:
    sigma = one.expected_separation_sigma
    sure = "" if sigma is None else f" (expected separation {number(sigma, 2)} sd)"
    return words.listing(one.separates) + sure


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


def _table(rows: Sequence[Sequence[str]], align: str, width: int | None = None) -> list[str]:
    """Rows of cells in columns, two spaces apart; ``align`` has "l" or "r" for each column.

    With a ``width`` the last column is a text, which goes on in lines below each other.
    """
    widths = [max(len(row[i]) for row in rows) for i in range(len(align))]
    if width is not None:
        left = sum(widths[:-1]) + 2 * len(widths)
        widths[-1] = min(widths[-1], max(width - left, _TEXT_COLUMN))
        rows = [line for row in rows for line in _wrapped_row(row, widths[-1])]
    return [
        "  " + "  ".join(c.ljust(w) if a == "l" else c.rjust(w) for c, w, a in zip(row, widths, align, strict=True))
        for row in rows
    ]


def _wrapped_row(row: Sequence[str], width: int) -> list[list[str]]:
    """The row with its last cell in lines, below which the other cells are empty."""
    first, *rest = _paragraph(row[-1], width) or [""]
    return [[*row[:-1], first], *([*[""] * (len(row) - 1), line] for line in rest)]
