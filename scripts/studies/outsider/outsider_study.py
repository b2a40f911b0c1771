"""An outsider's rate tables: how often insenv names what is not there, and misses what is.

    python scripts/studies/outsider/outsider_study.py STORE --family null --first 0 --count 100 [--minutes 9]
    python scripts/studies/outsider/outsider_study.py STORE --table --first 10000 --count 100 [--before STORE]
        [--engine COMMIT] [--out docs/results/outsider.md]

The generator beside this file imports nothing of insenv: physics on a fine grid, a chip, a data logger, a manifest as a
user would write it. What the store holds is not run again. Judged as `scripts/studies/measured/judge.py` does: *right*
where what is named is there and nothing is missing; *honest* where it falls short and says so; *missed*; *wrong,
flagged*; *wrong, stated* where a false name stands under a verdict without doubt; *crashed*.
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

import argparse
import json
import sys
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from case import FAMILIES, drawn
from faults import UNKNOWN
from record import may, sized, skew, write
from scipy.stats import beta

from insenv.close import close
from insenv.core.errors import InputError

SURE = ("effects-found", "nothing-significant")
WORDS = ("right", "honest", "missed", "wrong, flagged", "wrong, stated", "refused", "crashed")
#: Curves without a cause, and what is no effect of the model, are no names.
GENERIC = {"spline_time", "spline_rate", "spline_angle", "spline_temperature", "burst"}
#: A fault weaker than this need not be named.
LEAST = 6.0


def outcome(seed: int, family: str) -> dict[str, Any]:
    """What insenv says of a case."""
    case = drawn(seed, family)
    size, strength = sized(case)
    allowed = may(case) | set(case.cause.names if case.cause else ())
    kept: dict[str, Any] = {
        "seed": seed,
        "family": family,
        "case": asdict(case),
        "size": size,
        "strength": strength,
        "names": list(case.cause.names if case.cause else ()),
        "may": sorted(allowed),
        "skew": skew(case),
    }
    begun = time.process_time()
    with tempfile.TemporaryDirectory() as name:
        try:
            found = close(write(case, size, Path(name)))
        except InputError as error:
            return kept | {"refused": str(error).replace(name, ""), "cpu": time.process_time() - begun}
        except Exception:
            return kept | {"error": traceback.format_exc()[-1500:]}
    (target,) = found.targets
    scale = next((e for e in target.estimates_after if e.effect == "scale_factor"), None)
    return kept | {
        "cpu": time.process_time() - begun,
        "verdict": target.verdict,
        "added": [
            {
                "effect": a.effect,
                "order": a.order,
                "p": a.p_value,
                "rivals": list(a.confounded_with),
                "same": list(a.same_curve),
                "values": [(p.parameter, p.value, p.sd) for p in a.parameters],
                "before": a.held_out_before,
                "after": a.held_out_after,
                "remark": a.remark,
            }
            for a in target.added
        ],
        "rejected": [(r.effect, r.p_value, r.likelihood_ratio, r.reason) for r in target.rejected[:8]],
        "reasons": list(target.reasons),
        "cautions": list(target.cautions),
        "remarks": list(found.remarks),
        "held_out": [target.held_out.before, target.held_out.after, target.held_out.noise_floor],
        "scale": None
        if scale is None
        else [scale.value, scale.sd, (1 + scale.value - case.gyro.gain) / (scale.sd or 1)],
    }


def judged(kept: dict[str, Any]) -> tuple[str, str]:
    """The word for a case, and why."""
    if "error" in kept:
        return "crashed", kept["error"].strip().splitlines()[-1]
    if "refused" in kept:
        return "refused", kept["refused"]
    same = alike(kept["case"])
    allowed, wanted = set(kept["may"]) | same, set(kept["names"]) | same
    sure = kept["verdict"] in SURE
    named, here = [], set()
    for added in kept["added"]:
        rivals = {r.split(":")[0] for r in added["rivals"] + added["same"]}
        here |= {added["effect"]} | rivals
        if added["effect"] not in allowed | GENERIC and not rivals & allowed:
            named.append(added["effect"])
    if named:
        return f"wrong, {'stated' if sure else 'flagged'}", ", ".join(dict.fromkeys(named))
    if kept["family"] != "null" and kept["strength"] >= LEAST:
        if kept["family"] == "unknown" and not here & same:
            return ("missed", "nothing said") if sure else ("honest", "says something is left")
        if not here & wanted:
            return ("missed" if sure else "honest"), f"{kept['names'][0]} is there and not named"
    return "right", ""


def alike(case: dict[str, Any]) -> set[str]:
    """Names under which an unknown cause is the same law: anywhere, at one speed, or where the table turns one way."""
    programme, fault = case["table"]["programme"], UNKNOWN.get(case["fault"])
    if fault is None:
        return set()
    one_speed = fault.at_one_speed if programme in ("constant", "reversals") else ()
    return {*fault.anywhere, *one_speed, *(fault.one_way if programme in ("constant", "two_rates") else ())}


def share(good: int, total: int) -> str:
    """A share with its exact 95 % interval."""
    low = beta.ppf(0.025, good, total - good + 1) if good else 0.0
    high = beta.ppf(0.975, good + 1, total - good) if good < total else 1.0
    return f"{good}/{total} = {good / max(total, 1):.1%} [{low:.1%}, {high:.1%}]"


def listed(store: Path, family: str, first: int, count: int) -> list[dict[str, Any]]:
    """What the store has of a range of seeds."""
    paths = [store / f"{family}_{seed}.json" for seed in range(first, first + count)]
    return [json.loads(p.read_text()) for p in paths if p.exists()]


def tables(store: Path, first: int, count: int) -> list[str]:
    """The tables of results."""
    lines = ["| family | n | " + " | ".join(WORDS) + " |", "|---|---|" + "---|" * len(WORDS)]
    totals: dict[str, list[tuple[dict[str, Any], tuple[str, str]]]] = {}
    for family in FAMILIES:
        rows = [(k, judged(k)) for k in listed(store, family, first, count)]
        totals[family] = rows
        words = Counter(word for _, (word, _) in rows)
        lines.append(f"| {family} | {len(rows)} | " + " | ".join(str(words[w] or "") for w in WORDS) + " |")
    nulls = totals["null"]
    false = [k for k, (word, _) in nulls if word.startswith("wrong")]
    stated = [k for k, (word, _) in nulls if word == "wrong, stated"]
    doubt = [k for k, (word, _) in nulls if word == "right" and k["verdict"] not in SURE]
    lines += ["", "| figure | asked | reached |", "|---|---|---|"]
    lines.append(f"| nulls: something false is named | <= 1.5 % | {share(len(false), len(nulls))} |")
    lines.append(f"| nulls: stated without doubt | | {share(len(stated), len(nulls))} |")
    lines.append(f"| nulls: nothing false, but a doubt is said | | {share(len(doubt), len(nulls))} |")
    off = [
        k
        for k, (word, _) in nulls
        if word == "right" and k["verdict"] in SURE and k.get("scale") and abs(k["scale"][2]) > 4
    ]
    lines.append(f"| nulls: scale factor off by more than 4 sd without a doubt | | {share(len(off), len(nulls))} |")
    for family in FAMILIES[1:]:
        rows = totals[family]
        words = Counter(word for _, (word, _) in rows)
        lines.append(f"| {family}: right or honest | >= 90 % | {share(words['right'] + words['honest'], len(rows))} |")
        lines.append(f"| {family}: wrong and stated | <= 2 % | {share(words['wrong, stated'], len(rows))} |")
        lines.append(f"| {family}: missed | <= 5 % | {share(words['missed'], len(rows))} |")
    names = Counter(why for _, (word, why) in nulls if word.startswith("wrong"))
    lines += [
        "",
        "Of nulls, what is named falsely: "
        + (", ".join(f"{n} {k}" for n, k in names.most_common()) or "nothing")
        + ".",
    ]
    by: dict[str, Counter[str]] = {}
    for k, (word, _) in totals["effect"] + totals["unknown"]:
        by.setdefault(k["case"]["fault"], Counter())[word] += 1
    lines += ["", "| fault | n | " + " | ".join(WORDS) + " |", "|---|---|" + "---|" * len(WORDS)]
    for name in sorted(by):
        lines.append(
            f"| {name} | {sum(by[name].values())} | " + " | ".join(str(by[name][w] or "") for w in WORDS) + " |"
        )
    return lines


HEAD = """# Rate tables of an outsider

Recordings from a generator that imports nothing of insenv (`scripts/studies/outsider`, NumPy and SciPy): motion
of a table on a fine grid, a chip, a data logger, and a manifest as a user would write it. Drawn at random are

* the gyro: MEMS, fibre-optic, or ring laser with pulses; white noise, flicker, walk, rounding; a reading at
  instants, a mean or an increment; the chip's low-pass;
* the programme: staircases of both signs, sines, sweeps, constant rates, swings, ramps, reversals, turned by
  hand; a servo with lag, a limit of acceleration, and the ripple of its motor;
* the reference: an encoder of 12 to 20 bits, noisy, late, wrapped or not; its rate over some rows or through a
  drive's filter; a command that jumps or ramps; two of them;
* the clock: rows that wander, stamps that jitter or come late, rows that are lost; seconds, milliseconds,
  rounded microseconds, Unix time;
* tilt and the Earth's rate, a thermometer or none, what is declared, whether the maker's noise is stated.

**Nulls** have nothing that is not declared; what was drawn beside it (a reference that is late, a filter, the
ripple of a motor behind a command) may be named and need not. **Effects** have one cause of the catalogue,
**unknown** ones a cause that no catalogue has, of a size of 8 to 30 standard deviations beside the declared
model, by the noise of gyro and reference.

Judged as `scripts/studies/measured/judge.py` does: *right* where what is named is there and nothing is missing;
*honest* where it falls short and says so; *missed* where something is there, and nothing is said; *wrong,
flagged* where a name is false under a verdict with a doubt; *wrong, stated* under one without. Intervals are
exact, 95 %.
"""


def page(store: Path, first: int, count: int, before: Path | None, engine: str) -> str:
    """The page of results of a range of seeds."""
    lines = [HEAD, "## Figures", ""]
    lines.append(f"Seeds {first} to {first + count - 1}, which no change of the engine has looked at; engine {engine}.")
    lines += ["", *tables(store, first, count)]
    if before is not None:
        old = {k["seed"]: judged(k)[0] for k in listed(before, "null", first, count)}
        new = {k["seed"]: judged(k)[0] for k in listed(store, "null", first, count) if k["seed"] in old}
        false = [
            sum(word.startswith("wrong") for word in (old[seed] for seed in new)),
            sum(word.startswith("wrong") for word in new.values()),
        ]
        lines += ["", "The same nulls by the engine before these tables were made: something false is named in "]
        lines[-1] += f"{share(false[0], len(new))}; by this one in {share(false[1], len(new))}."
    return "\n".join(lines) + "\n"


def show(kept: dict[str, Any]) -> str:
    """One case in some lines."""
    word, why = judged(kept)
    case = kept["case"]
    gyro, clock, table, reference = (case[k] for k in ("gyro", "clock", "table", "reference"))
    head = (
        f"{kept['family']} {kept['seed']}: {word} ({why}) {gyro['grade']} {gyro['reading']} "
        f"{clock['rate']:g} Hz {case['duration']:.0f} s {table['programme']} {reference['kind']} "
        f"{reference['bits']} bit; {case['fault']} {kept['strength']:.1f}; {kept.get('verdict')}"
    )
    rows = []
    for a in kept.get("added", ()):
        values = ", ".join(f"{n} {v:.3g} +- {s or 0:.2g}" for n, v, s in a["values"])
        rows.append(f"    {a['effect']}:{a['order']} p {a['p']:.1g} rivals {a['rivals']} {values}")
    return "\n".join([head, *rows, *(f"    ! {r}" for r in kept.get("reasons", ()))])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store", type=Path)
    parser.add_argument("--family", choices=FAMILIES, action="append")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--minutes", type=float, default=9.0)
    parser.add_argument("--table", action="store_true", help="only the tables of what the store has")
    parser.add_argument("--faulty", action="store_true", help="show each case that is not right")
    parser.add_argument("--before", type=Path, help="a store of the same seeds by an older engine")
    parser.add_argument("--engine", default="of today", help="commit of the engine, for the page")
    parser.add_argument("--out", type=Path, help="page to write")
    given = parser.parse_args()
    given.store.mkdir(parents=True, exist_ok=True)
    end = time.monotonic() + 60 * given.minutes
    families = given.family or list(FAMILIES)
    for seed in () if given.table else range(given.first, given.first + given.count):
        for family in families:
            path = given.store / f"{family}_{seed}.json"
            if path.exists():
                continue
            if time.monotonic() > end:
                sys.exit("time is over; what the store has is not run again")
            path.write_text(json.dumps(outcome(seed, family), default=float))
    for family in families if given.faulty else ():
        for kept in listed(given.store, family, given.first, given.count):
            if judged(kept)[0] not in ("right", "honest") or (family == "null" and kept["verdict"] not in SURE):
                print(show(kept))
    print("\n".join(tables(given.store, given.first, given.count)))
    if given.out is not None:
        given.out.write_text(page(given.store, given.first, given.count, given.before, given.engine), encoding="utf-8")


if __name__ == "__main__":
    main()
