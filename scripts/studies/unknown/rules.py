"""Right, alike, honest, wrong or missed, by stated rules.

On each target of a case, of what the report says is added (curves without a cause, `generic`, aside):

* *false* is a name that is no cause's of this target, however faint, where no rival of it is one either;
* *missing* is a cause of this target that is neither among the names nor among their rivals.

The case is *wrong, stated* where something false stands under a verdict without a doubt (`effects-found`); *wrong,
flagged* where it stands under another (`effects-found-incomplete`, `confounded`); *missed* where nothing is false but a
cause is missing under a verdict without a doubt; *honest* where it is missing under one with a doubt, or where the
report says of a false name that a cause is the same curve on such a recording (`same_curve`); *alike* where all causes
are named, one of them by a curve that leaves less than 3 of its strength (nobody could tell); else *right*. Of a null
everything but `nothing-significant` is wrong.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

SURE = ("effects-found", "nothing-significant")
WORDS = ("right", "alike", "honest", "missed", "wrong, flagged", "wrong, stated")


def judge(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> tuple[str, str]:
    """The word for a case, and why."""
    if "error" in answer:
        return "refused", str(answer["error"])
    words = [_target(truth, target, said) for target, said in answer["targets"].items()]
    return max(words, key=lambda pair: WORDS.index(pair[0]))


def _target(truth: Mapping[str, Any], target: str, said: Mapping[str, Any]) -> tuple[str, str]:
    here = truth["targets"].get(target, [])
    causes = [tuple(truth["causes"][k]) for k in here]
    verdict, alike, beside = said["verdict"], set(truth["alike"]), set(truth["beside"])
    faint = [truth["causes"][k] for k in truth.get("faint", {}).get(target, [])]
    allowed = {name for cause in (*causes, *faint) for name in cause} | ((alike | beside) if here or faint else set())
    named = [(name.partition(":")[0], _ids(rest[0])) for name, *rest in said["added"]]
    same = {name.partition(":")[0]: _ids(rest[1]) for name, *rest in said["added"] if rest[1:]}
    false = {name for name, rivals in named if name not in allowed and not rivals & allowed}
    doubted = {name for name in false if same.get(name, set()) & allowed}
    false -= doubted
    every = {name for name, rivals in named for name in (name, *rivals)}
    missing = [cause[0] for cause in causes if not every & set(cause)]
    why = f"{target}: {said['text']} ({verdict})"
    if false:
        return ("wrong, stated" if verdict in SURE else "wrong, flagged"), why
    if doubted:
        return "honest", why
    if missing and every & alike:
        return "alike", why
    if missing:
        return ("missed" if verdict in SURE else "honest"), why
    if not causes and not faint and verdict != "nothing-significant":
        return "wrong, flagged" if truth["family"] == "null" else "honest", why
    return "right", why


def _ids(keys: list[str]) -> set[str]:
    return {key.partition(":")[0] for key in keys}
