"""Close the loop on every published recording: what each declared model lacks, and the error before and after.

Writes a page of Markdown and its pictures. The recordings are those of `insenv datasets`; `INSENV_DATA` may name a
folder that has them.
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

import argparse
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from matplotlib.figure import Figure
from studies.result_page import Section, table, write

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.quantities import percent, span
from insenv.datasets import load
from insenv.effects.tone import Tone
from insenv.identify.findings import Findings, TargetFindings
from insenv.report import estimates, evidence, figures, sentences
from insenv.report.found import kinds, title
from insenv.report.words import key_of, listing

#: Error beside that of the noise alone from which what is left is worth a word though no test finds it.
SLOW = 1.5
#: Recordings of this page; the others of the registry are on that of `studies/measured`.
RECORDINGS = (
    "psins_lasergyro",
    "tofupilot_thermal",
    "ln100_updown",
    "imu_tk",
    "mikoff_imu0",
    "mikoff_imu1",
    "imucal",
)
FOLDER = Path(__file__).resolve().parents[1] / "docs" / "results"
HEAD = """\
# Closing the loop on measured data

Recordings that other people measured and published, each with the model that its manifest declares. Every error is that
of data that no fit has seen, as the root mean square of what the text says; before is the declared model, after is the
model with what was found. `insenv datasets --fetch` brings the recordings, or `INSENV_DATA` names a folder that has
them; then this page and its pictures are written by

```sh
python scripts/close_loop_on_measured_data.py
```

All rows are of one state of the engine; `make pages` says whether it has changed since.
None of these is a gyro on a rate table: no such recording is public that we know of. Those cases rest on simulation.
"""


#: What a reader sees and no test calls significant, by recording.
NOTES = {
    "psins_lasergyro": (
        "* accel_x rises by 0.6 mm/s² through the held-out time, as the picture shows: of the five slow waves that it "
        "has room for the slowest is 2.9 standard deviations, those of the fitted drift and of the noise together, "
        "p = 0.02 for the five.",
    )
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder of the page")
    parser.add_argument("recordings", nargs="*", default=list(RECORDINGS), help="names; see RECORDINGS")
    given = parser.parse_args()
    try:
        for name in given.recordings:
            load(name)
    except InputError as error:
        print(error, file=sys.stderr)
        raise SystemExit(2) from None
    write(given.out / "measured.md", HEAD, map(section, given.recordings), len(given.recordings))
    print(given.out / "measured.md")


def section(name: str) -> Section:
    """One recording."""
    found, source = close(name), load(name).source
    assert source is not None
    where = f"[{source.repository}](https://github.com/{source.repository}/tree/{source.commit})"
    of = {sentences.scored(t.held_out) for t in found.targets}
    head = f"Recording `{name}`: {found.rows} rows, {span(found.duration)}. Source: {where}, {source.licence}."
    said = f"Declared: {_declared(found)}. Errors are of {listing(sorted(of))}."
    return Section(
        found.title,
        (
            head,
            "",
            said,
            "",
            *_table(found.targets),
            "",
            *_parameters(found.targets),
            *_remains(found),
            *NOTES.get(name, ()),
        ),
        f"{sentences.overall(found)} {_best_said(found)}".strip(),
        _pictures(name, found),
    )


def _note(name: str) -> tuple[str, ...]:
    return NOTES.get(name, ())


def _declared(found: Findings) -> str:
    each = {t.declared for t in found.targets}
    return "; ".join(listing([f"`{key}`" for key in keys]) if keys else "nothing" for keys in sorted(each))


def _table(targets: Sequence[TargetFindings]) -> tuple[str, ...]:
    """One row for targets that share an error: an axis of a triad that was judged as a whole has none of its own."""
    rows: dict[tuple[str, ...], list[str]] = {}
    for target in targets:
        h, unit = target.held_out, sentences.held_out_unit(target)
        what = ", ".join(f"`{key_of(k[0])}`" + (f" x {len(k)}" if len(k) > 1 else "") for k in kinds(target.added))
        change = sentences.change(h) if target.added else ""
        row = (what or "nothing", unit.show(h.before), unit.show(h.after), change, unit.show(h.noise_floor))
        rows.setdefault((*row, target.verdict), []).append(target.target)
    header = ("target", "found", "before", "after", "change", "noise alone", "verdict")
    return table(header, [(", ".join(alike), *row) for row, alike in rows.items()])


def _parameters(targets: Sequence[TargetFindings]) -> Iterator[str]:
    """What was found, effect by effect, with its parameters and rivals."""
    for target in targets:
        for added in target.added:
            rivals = f"; cannot be told from {listing(added.confounded_with, 'or')}" if added.confounded_with else ""
            yield f"* {target.target}, {title((added,))}: {estimates.parameters(added)}{rivals}"


def _remains(found: Findings) -> Iterator[str]:
    """What is still unexplained, what was left out, and what could not be tested."""
    yield from ("", "**What remains.**", "")
    left: dict[str, list[str]] = {}
    for target in found.targets:
        h = target.held_out
        ratio = h.after / h.noise_floor if h.noise_floor > 0 else float("inf")
        slow = "what is left is so slow that no test tells it from noise that wanders"
        reasons = "; ".join(target.reasons) or (slow if ratio > SLOW else "nothing but noise is left, by every test")
        left.setdefault(f"{ratio:.2g} times what its noise alone would leave; {reasons}", []).append(target.target)
    yield from (f"* {', '.join(alike)}: {text}" for text, alike in left.items())
    yield from (f"* {remark}" for remark in found.remarks)


def _best(targets: Iterable[TargetFindings]) -> TargetFindings:
    """The target whose error falls most."""
    return min(targets, key=lambda t: t.held_out.after / t.held_out.before)


def _best_said(found: Findings) -> str:
    best = _best(found.targets)
    share = best.held_out.after / best.held_out.before
    if not best.added:
        return ""
    return f"Held-out error of {best.target} with it: {percent(share)} of that before."


def _pictures(name: str, found: Findings) -> dict[str, Figure]:
    """Residual before and after of the accelerometer, and of the gyro, whose error falls most; the samples' lines."""
    made = {}
    for kind in dict.fromkeys(t.target.split("_")[0] for t in found.targets):
        best = _best(t for t in found.targets if t.target.startswith(kind))
        made[f"measured_{name}_{kind}"] = figures.overview(best) if len(best.spectra.f) else figures.against_time(best)
        if any(key_of(one).startswith(Tone.id) for one in best.added) and (samples := best.samples()) is not None:
            made[f"measured_{name}_{kind}_samples"] = evidence.samples(best, samples)
    return made


if __name__ == "__main__":
    main()
