"""The page of effects of known size in measured recordings, from the stores of `inject.py`.

python injected_page.py --set "developed, at first sight" STORE LABEL --set "closed, once" STORE LABEL --commit HASH
"""

from __future__ import annotations

import argparse
import json
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
#: Deviations by either size from which on an effect counts as visible.
VISIBLE = 5.0
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
  owners who were kept closed until the end and run once; then the owners of two later parts of the library, and of
  three more (fresh owners), none of whom was there before (`--sides sides_later.toml`, `sides_fresh.toml`), run once as
  well. Of those, the first in the drawn order that hold at most 30 000 rows, follow their reference (correlation above
  0.9, gain between 0.5 and 2) where they have one, can show an effect, and are answered untouched.
* **Size**: {low:g} to {high:g} standard deviations, of an own generalised least-squares fit of the effect beside the
  declared terms, against what the recording's own residual means show (`injected_sizes.py`; of units in attitudes
  against the scatter of rests or of turns). What would have to be larger than is credible for that is not put in. The
  size counts all rows, of which a search fits 60 % and pays for all that it tries: 5 of it is little.
* **Judged** beside what the same engine says of the untouched recording, the control of each case: what is named
  or called for there is not false. **right** names what was put in, nothing else that is new, and its coefficient
  within three standard deviations or a quarter; another name is as right where it leaves less than 3 of the effect's
  size. **honest** has it among the rivals, speaks of it where nothing did before, or says now that something is left;
  **silent** says what it said before, under a verdict that held a doubt already; **missed** sees nothing, under one
  that holds none; **wrong value** and **wrong name** are stated, or flagged by a verdict that holds a doubt;
  **refused** gives no answer.
* **By likelihood**: a second size, by the engine's own likelihood of all rows with the noise fitted anew
  (`likelihood_sizes.py`): where it is below {seen:g} too little is there for any search that takes noise as the engine
  does. Visible by both are cases at {seen:g} and more by either size, a coefficient that is declared among them.
* Intervals: exact, 95 %. Right and honest count as good; silent does not.

What the developed sets taught, and what was mended: a bend of an accelerometer was never seen where nobody stated
gravity, nor beside axes that are not square; an axis at rest that drifts for certain had another one named with it in
23 % of boxes of six of which no other drifts. What the first closed set taught: a reversed axis of the gyros about
which few turns are; drifts and steps of a bias beside a reference that all rows tell and a search that fits 60 % of a
minute does not; and, with the recordings of all opened sets drawn anew:

* Any effect beside a reference, not of the bias alone, that all rows tell: an asymmetry of 17 deviations stands at nine
  of all rows and three of the fitted ones. It is a doubt now, and what all rows follow is said beside other doubts.
* Waves of the table's angle of which it turns by less than two beside a late reference were never tried: one of 7
  deviations gains a likelihood ratio of 74, and is said, not named.
* Bins as long as a gain needs to settle hid an encoder's harmonic of 23 deviations: that the gain is not the same by
  short means and by long ones is said.
* Gyros of half the rate with an axis reversed missed the turns by 1.4 rad under "nothing significant".
* Bursts of noise of a twentieth of a rest were too long for a knock, and no mean left its level: 0 of 4 told, 4 of 4.

After the later parts were opened, so that no figure of the first time has it: rests that miss gravity by a hundredth of
it under "nothing significant"; a bound on the power of a random walk that hid nearly all of it where regressors take
the slowest modes (a step was said to follow all rows of an untouched recording with 2e-84). The wider walk hid what
tells parts of a recording apart, until parts are judged beside the noise that they leave.
{later}

Two effects of the later parts, a step of 11 deviations and a burst, had been put behind the rows that the manifest
uses: nobody could see them, and they are not counted (as first counted: 22 of 40). Copies hold those rows alone now.

What is left, asked of all rows by the engine's own likelihood with the noise fitted anew (21 cases beside a reference
that are not good): 18 are no more than 4.3 deviations, 11 of them less than 2 or not testable, though they were put in
at 5 to 21. The size here is by a power that is smooth in frequency; the engine's noise is white, flicker and walk,
alike all the time. Where a table is louder while it turns, or what is left is a hump at the motion's frequencies, a
walk stands for it, and is far larger at slow modes than what is there: the means of two rests of a record player differ
by more than 60 times what the scatter of their rows allows, and all rows together tell no drift. Three stand out by 5
to 8: a drift of the gain beyond what is credible (0.2), a cubic and a hysteresis that errors of the reference follow as
well. A cubic on a table that is told one rate and rest is the scale factor, says the engine; it was put in by the rates
that the readings show.

Two better forms of noise were tried on all 54 cases beside a reference, and neither is in the engine. A Gauss-Markov
term of the likeliest of eight times gains more than 8 in the logarithm of the likelihood in 12, and of the silent ones
two drifts of the record player stand out more (4.2 and 3.7 deviations; 0 and 0.1 without); no other moves by more
than 2. Motion has 1.4 to 47 times the noise of rest in 10 of 13 recordings that tell both. Weighted by the likeliest
ratio, errors of the reference count as noise: the later parts are 22/38, a hysteresis of an untouched recording is
stated, and what was a doubt is none. What is asked instead is the rests by themselves, for the bias alone: three of
twelve cases with a change of the bias that were looked at speak of it, and none of 37 untouched recordings.

Of 12 cases of the sets before that were still not good with `cae9e63`, one more is right, a drift of 15 deviations;
what was good there was not closed again.

Fresh owners, closed and run once: 19 recordings of three later parts qualify, 13 of them beside a reference (an own
attitude, wheels, a table, a heated gyro), none in attitudes; each answer within three minutes. No effect had been put
into them before; untouched they had been answered when their parts were opened, and a cause or two that they showed
was mended since (wheels, a heated axis), so that the engine knew them better than it knew the later parts.
Silent there are a lock-in and a hysteresis of 8 and 11 deviations on one hand-turned gyro, below {seen:g} by
likelihood. A rail of 17 rows among 766 was missed, for only four times as many were at it as at the next values. A
centripetal term of 26 deviations is nearly all in the first 1.5 s of a recording, whose rows were left out as off the
motion. A delay of 5 ms beside wheels, seen by means over 4 s, is told as 10. A wave of the angle is named rightly, and
a backlash beside it with a p-value of 0.009 at a level of 0.01.

Mended since, of that set: a rail where the table asks for far more needs twice the rows of the next values, not five
times. A second draw on the same recordings, made then, had a dead band of 18 mrad/s in a robot's gyro: two rows in
three read one number, a robust fit left nothing there with a gain of nothing, and the gyro was said not to follow; it
is told by the rows that change, and a lock-in is named, which is a threshold too. A drift of the gain is said now,
since errors of an encoder cancel from mean to mean (`5e3dc61`). By `4125be0` the centripetal term is right, for what an
instrument makes of the fastest swing of a run is no event any more; the delay beside wheels has a deviation of 9 ms,
for shorter means say otherwise; and of the second draw a hysteresis is right of which a skew was stated, its radius
below ten deviations of a reading.

Silent of both draws, 102 cases, are eleven; by likelihood two of them are at more than 6 deviations: a thermal lag
where one was named before, and a dead band of a recording nine rows in ten of which are one number. What the likelihood
does not see may be plain to others: a drift of 10 deg/s in 160 s beside an attitude, 15 deviations by means over 10 s,
is 3.7 by it, for motion leaves errors as fast as itself, a hump for which a walk stands. Where there is a doubt anyway,
slow laws of the bias are asked of long means as well, and said where they are likelier than the walk: no word on 30
simulated nulls with such a hump.

All opened sets drawn anew once more, with seed 9: 67 cases on 66 of 86 recordings, none stated wrongly. Of the twelve
that are silent or missed ten are less than {seen:g} deviations by likelihood, a burst was not asked, and a dead band of
6.7 stands beside wheels whose held-out rows are seven times as loud as the fitted ones. Among the ten is a step of 8.5
at rest: noise of real instruments changes as suddenly by itself, and odds of a thousand are set against it.

Drawn once more with seed 10 on the closed side of the parts from the ninth to the nineteenth, at first sight by
f4cbf2a: 56 cases on 24 recordings, 40 right or honest, none stated wrongly (beside a reference 21 of 34). Of the 19
that are {seen:g} deviations and more by both sizes 17 are; the eleven beside a reference that are silent or
missed are all less than that by likelihood.

Nine later parts of the library (`sides_last.toml`, seed 11), into which nothing had been put before, were closed and
run once by `db9aa70`: 80 cases on 42 recordings, 57 right or honest, nothing wrong, stated or flagged. Seven are
missed: a line of 20 deviations at rest in a log with a gap after each hundred rows (no stretch without a gap was long,
and means without their gaps had the line elsewhere; it is right since, and one of 29 that had no name), a burst and a
line of five, a drift of the gain and a local fault of less than three by likelihood, a drift of one rest in eleven, and
axes out of square that six faces do not tell from scale factors. Of the 16 that are silent nine were asked by
likelihood beside a reference, and four stand there at five deviations and more: two hystereses, a wave and a
centripetal term beside references whose own errors are said. Since then noise that wanders further than a gyro's bias
does is a doubt of untouched recordings as well, under which two cases are silent that were honest and missed.

The later parts hold few recordings that qualify: 12, of which one is in attitudes (18 rests of a row each), and two of
the five references are commands. Of the untouched recordings beside a reference 0 of 33 have a new doubt by
all rows. Before 277cfa8 a doubt that was there before counted as honest where its p-value alone was another: by that
rule the first closed set had 32 of 50.

Five newer parts (`sides_newest.toml`, seed 12), into which nothing had been put before, were closed and run once by
`9788fa6`: 98 cases on 31 recordings, 75 right or honest, nothing stated wrongly. Of the 14 that are silent and the six
that are missed 17 were asked by likelihood: twelve are below 5 deviations, a step and a centripetal term at 5.5 to 5.9,
a dead band, a lock-in and another step at 11 to 15, all under a doubt that was there before and that speaks of the
lock-in and of both steps. Two are refused: a step of a gyro that was moved by hand, and a line on a boat, tip what is
declared at rest over what counts as motion.

Five latest parts (`sides_latest.toml`, seed 13), into which nothing had been put before, were closed and run once by
`514aa02`: 87 cases on 38 recordings, 64 right or honest. Stated wrongly are three: two of one accelerometer that was
moved about in one attitude, whose scale factors ran away to ten million untouched as well (such rests are refused
since), and a play as small as a lag, named as one beside a recording whose lag is named otherwise. A rail of 49 rows
was missed, for single rows of a heading tell nothing of what was asked for: all of them do, since then.

The sets do not compare in sizes: those of the first draw were made with noise autoregressive of first order, which
makes slow effects larger than they are, and of gyros in attitudes with fixed shares; the others as described. Two
cases of the closed set are an accelerometer's beside a reference.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--set", nargs=3, action="append", metavar=("NAME", "STORE", "LABEL"), required=True)
    parser.add_argument("--commit", required=True, help="of the engine, in words for each set")
    parser.add_argument("--later", default="", help="a sentence on what later mends changed")
    parser.add_argument("--out", type=Path, default=FOLDER)
    given = parser.parse_args()
    sets = [(name, list(judged(Path(store), label))) for name, store, label in given.set]
    sizes = {name: _sizes(Path(store) / label) for name, store, label in given.set}
    lines = [
        HEAD.format(low=STRENGTH[0], high=STRENGTH[1], later=given.later, seen=VISIBLE),
        f"Commits of the engine: {given.commit}.",
        "",
    ]
    lines += [*_words(sets), "", *_kinds(sets), "", *_visible(sets, sizes), "", *_laws(*sets[-1]), ""]
    lines += _cases(*sets[-1], sizes[sets[-1][0]])
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


def _sizes(answers: Path) -> Mapping[str, float]:
    """Deviations by the engine's likelihood, by number of case; those that were not asked are left out."""
    path = answers / "sizes.json"
    told = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    return {number: one["deviations"] for number, one in told.items() if one}


def _visible(sets: Sequence[tuple[str, Rows]], sizes: Mapping[str, Mapping[str, float]]) -> Iterator[str]:
    yield "Right or honest, where the second size was asked, by what it is:"
    yield ""
    yield f"| set | visible by both | of it beside a reference | less than {VISIBLE:g} by likelihood |"
    yield "| --- | --- | --- | --- |"
    for name, rows in sets:
        if own := sizes[name]:
            seen = [r for r in rows if own.get(r[0], VISIBLE) >= VISIBLE]
            beside = [r for r in seen if r[1]["kind"] == "reference"]
            yield f"| {name} | {_share(seen)} | {_share(beside)} | {_share([r for r in rows if r not in seen])} |"


def _laws(name: str, rows: Rows) -> Iterator[str]:
    yield f"## By effect: {name}"
    yield ""
    yield "| effect | kind | right or honest, and words |"
    yield "| --- | --- | --- |"
    for kind, title in KINDS.items():
        for law in sorted({t["law"] for _, t, _ in rows if t["kind"] == kind}):
            mine = [w for _, t, w in rows if t["kind"] == kind and t["law"] == law]
            yield f"| `{law}` | {title} | {counted(mine)} |"


def _cases(name: str, rows: Rows, sizes: Mapping[str, float]) -> Iterator[str]:
    yield f"## What was not right: {name}"
    yield ""
    yield "| recording | put in | size | by likelihood | said | judgement |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for number, truth, word in rows:
        if word.word == "right":
            continue
        said, why = (text.replace("|", "/")[:160] for text in (word.said, word.why))
        put = f"`{truth['law']}` on {truth['target']}"
        where = truth["recording"].removesuffix(".toml")
        size = f"{truth['strength']:.0f} | {sizes[number]:.1f}" if number in sizes else f"{truth['strength']:.0f} | "
        yield f"| `{where}` | {put} | {size} | {said} | **{word.word}**{': ' + why if why else ''} |"


if __name__ == "__main__":
    main()
