"""The page of effects of known size in measured recordings, from the stores of `inject.py`.

python injected_page.py --set "developed, at first sight" STORE LABEL --set "closed, once" STORE LABEL --commit HASH
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from inject import counted, judged
from injected_cases import STRENGTH
from injected_words import Word
from pages import written
from scipy.stats import beta

FOLDER = Path(__file__).resolve().parents[3] / "docs" / "results"
WORDS = (
    "right",
    "honest",
    "silent",
    "missed",
    "wrong value, flagged",
    "wrong value, stated",
    "wrong name, flagged",
    "wrong name, stated",
    "refused",
    "crashed",
)
KINDS = {"reference": "beside a reference", "attitudes": "in attitudes", "rest": "at rest"}
HEAD = """\
# Effects of known size in measured recordings

Real recordings of other people ([the measured library](reality.md)), with their encoders, clocks and noise, into
which one effect of known size was put with NumPy alone: files and manifest are written anew with nothing else
altered, in the file's own units and rounding, and the loop is closed on them. Made with
`scripts/studies/injections`, FOLDER being where `measured/library.py` lays the library out:

    python inject.py take closed FOLDER STORE LABEL && python inject.py draw FOLDER STORE --cases 50
    python inject.py close STORE LABEL && python inject.py judge STORE LABEL

* **Recordings**: drawn by owner with a seed, before any was looked at (`sides.toml`): owners to develop on, and
  owners who were kept closed until the end and run once. Of those, the first in the drawn order that hold at most
  30 000 rows, follow their reference (correlation above 0.9, gain between 0.5 and 2) where they have one, can show
  an effect, and are answered untouched.
* **Size**: {low:g} to {high:g} standard deviations, of an own generalised least-squares fit of the effect beside the
  declared terms, against what the recording's own residual means show (`injected_sizes.py`; of units in attitudes
  against the scatter of rests or of turns). What would have to be larger than is credible for that is not put in. The
  size counts all rows, of which a search fits 60 % and pays for all that it tries: 5 of it is little.
* **Judged** beside what the same engine says of the untouched recording, the control of each case: what is named
  or called for there is not false. **right** names what was put in, nothing else that is new, and its coefficient
  within three standard deviations or a quarter; another name is as right where it leaves less than 3 of the effect's
  size. **honest** has it among the rivals, speaks of it, or says now that something is left; **silent** says what it
  said before, under a verdict that held a doubt already; **missed** sees nothing, under one that holds none; **wrong
  value** and **wrong name** are stated, or flagged by a verdict that holds a doubt; **refused** gives no answer.
* Intervals: exact, 95 %. Right and honest count as good; silent does not.

What the developed sets taught, and what was mended: a bend of an accelerometer was never seen where nobody stated
gravity, nor beside axes that are not square; an axis at rest that drifts for certain had another one named with it in
23 % of boxes of six of which no other drifts. What the closed set taught and was mended after it, so that no figure
here has it: a reversed axis of the gyros about which few turns are; drifts and steps of a bias beside a reference that
all rows tell and a search that fits 60 % of a minute does not (three of the four that were missed hold a doubt now).
What is left: such as are told from a walk of the noise by no rows; a cubic beside a late, short reference is called a
compensation ripple, a centripetal term on a steady circle a hysteresis; dead bands, lock-in and backlash about
standstill are not seen beside a reference that comes late; bursts of some seconds that are as loud as the noise.

The sets do not compare in sizes: those of the first draw were made with noise autoregressive of first order, which
makes slow effects larger than they are, and of gyros in attitudes with fixed shares; the others as described. Two
cases of the closed set are an accelerometer's beside a reference.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--set", nargs=3, action="append", metavar=("NAME", "STORE", "LABEL"), required=True)
    parser.add_argument("--commit", required=True, help="of the engine, in words for each set")
    parser.add_argument("--out", type=Path, default=FOLDER)
    given = parser.parse_args()
    sets = [(name, list(judged(Path(store), label))) for name, store, label in given.set]
    lines = [HEAD.format(low=STRENGTH[0], high=STRENGTH[1]), f"Commits of the engine: {given.commit}.", ""]
    lines += [*_words(sets), "", *_kinds(sets), "", *_laws(*sets[-1]), "", *_cases(*sets[-1])]
    written(given.out / "injected.md", "\n".join(lines).rstrip() + "\n")


Rows = Sequence[tuple[str, Mapping[str, Any], Word]]


def _words(sets: Sequence[tuple[str, Rows]]) -> Iterator[str]:
    yield "## Figures"
    yield ""
    yield "| set | cases | recordings | " + " | ".join(WORDS) + " | right or honest |"
    yield "|" + " --- |" * (len(WORDS) + 4)
    for name, rows in sets:
        count = Counter(w.word for *_, w in rows)
        recordings = len({t["recording"] for _, t, _ in rows})
        cells = [str(count[w] or "") for w in WORDS]
        yield f"| {name} | {len(rows)} | {recordings} | " + " | ".join(cells) + f" | {_share(rows)} |"


def _share(rows: Rows) -> str:
    n, good = len(rows), sum(w.good for *_, w in rows)
    if not n:
        return ""
    low = beta.ppf(0.025, good, n - good + 1) if good else 0.0
    high = beta.ppf(0.975, good + 1, n - good) if good < n else 1.0
    return f"{good}/{n} = {100 * good / n:.0f} % ({100 * low:.0f} to {100 * high:.0f} %)"


def _kinds(sets: Sequence[tuple[str, Rows]]) -> Iterator[str]:
    yield "Right or honest, by what the recording has:"
    yield ""
    yield "| set | " + " | ".join(KINDS.values()) + " |"
    yield "|" + " --- |" * (len(KINDS) + 1)
    for name, rows in sets:
        yield f"| {name} | " + " | ".join(_share([r for r in rows if r[1]["kind"] == k]) for k in KINDS) + " |"


def _laws(name: str, rows: Rows) -> Iterator[str]:
    yield f"## By effect: {name}"
    yield ""
    yield "| effect | kind | right or honest, and words |"
    yield "| --- | --- | --- |"
    for kind, title in KINDS.items():
        for law in sorted({t["law"] for _, t, _ in rows if t["kind"] == kind}):
            mine = [w for _, t, w in rows if t["kind"] == kind and t["law"] == law]
            yield f"| `{law}` | {title} | {counted(mine)} |"


def _cases(name: str, rows: Rows) -> Iterator[str]:
    yield f"## What was not right: {name}"
    yield ""
    yield "| recording | put in | size | said | judgement |"
    yield "| --- | --- | --- | --- | --- |"
    for _, truth, word in rows:
        if word.word == "right":
            continue
        said, why = (text.replace("|", "/")[:160] for text in (word.said, word.why))
        put = f"`{truth['law']}` on {truth['target']}"
        where = truth["recording"].removesuffix(".toml")
        yield f"| `{where}` | {put} | {truth['strength']:.0f} | {said} | **{word.word}**{': ' + why if why else ''} |"


if __name__ == "__main__":
    main()
