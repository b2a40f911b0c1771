"""Closes the loop on what `generate.py` wrote, and judges what was named.

python scripts/studies/system_calibration/judge.py FOLDER [--count 1000]
appends a line to FOLDER/judged.jsonl for every case that is not in it yet, and prints the table of all.

Right: an effect that names the cause was added, or stands in the set of one that was. False: of a recording without any
cause, an effect was added.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from insenv.close import close


def main() -> None:
    """Judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=10**6)
    asked = parser.parse_args()
    truths: dict[str, Any] = {}
    for path in sorted(asked.folder.glob("truth_*.json")):
        truths |= json.loads(path.read_text())
    done = {row["case"] for row in rows(asked.folder)}
    with (asked.folder / "judged.jsonl").open("a") as file:
        for name in [name for name in truths if name not in done][: asked.count]:
            file.write(json.dumps(judged(asked.folder / name, truths[name])) + "\n")
            file.flush()
    for line in table(rows(asked.folder)):
        print(line)


def rows(folder: Path) -> list[dict[str, Any]]:
    """What was judged so far."""
    path = folder / "judged.jsonl"
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def judged(folder: Path, truth: dict[str, Any]) -> dict[str, Any]:
    """One case: what was added, its rivals, and the error on held-out rests."""
    begun = time.process_time()
    found = close(folder / "manifest.toml")
    added = {a.effect: list(a.confounded_with) for t in found.targets for a in t.added}
    ratio = min((t.held_out.after / t.held_out.before for t in found.targets), default=1.0)
    named = {*added, *(rival for rivals in added.values() for rival in rivals)}
    return {
        "case": folder.name,
        "cause": truth["cause"],
        "verdict": found.verdict,
        "added": added,
        "alone": bool(set(truth["names"]) & set(added)) and len(added) == 1,
        "right": bool(set(truth["names"]) & named),
        "more": len(added) > 1,
        "ratio": ratio,
        "seconds": time.process_time() - begun,
    }


def table(judgements: Sequence[dict[str, Any]]) -> list[str]:
    """Rows of a Markdown table: cause, cases, named first, named or in the set, more than one added, held-out error."""
    lines = [
        "| cause | cases | named | named or in the set | more added | held-out error |",
        "|---|---|---|---|---|---|",
    ]
    of_cause = [row for row in judgements if row["cause"]]
    for cause in [*dict.fromkeys(row["cause"] for row in of_cause), None]:
        own = [row for row in of_cause if cause in (row["cause"], None)]
        if not own:
            continue
        ratios = sorted(row["ratio"] for row in own)
        counts = [sum(row[key] for row in own) for key in ("alone", "right", "more")]
        cells = [(cause or "all").replace("_", " "), len(own), *counts, f"x {ratios[len(ratios) // 2]:.2f}"]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    nulls = [row for row in judgements if not row["cause"]]
    if nulls:
        lines.append(f"| none | {len(nulls)} | {sum(bool(row['added']) for row in nulls)} false | | | |")
    return lines


if __name__ == "__main__":
    main()
