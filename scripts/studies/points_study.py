"""Lists of points: what the loop names of a law in a short list, the commonest test of an instrument.

A row is a mean at one rate, temperature, angle or attitude. Lists are made with NumPy, no effect of insenv: the laws
and the noise stand here. A law has `STRENGTH` deviations of the noise beside what is declared, by least squares over
all rows. `right`: its name, or a set that has it, and nothing else; `false`: a name that is none of the truth's;
`doubt`: no name, and not called complete.

    python scripts/studies/points_study.py --out docs/results/points.md
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).parents[1]))
from pages import written

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.version import VERSION
from insenv.identify.findings import TargetFindings

Floats = NDArray[np.float64]
Laws = Mapping[str, Callable[[Floats, Floats], Floats]]

STRENGTH, GRAVITY = 20.0, 9.80665
ORDERS = ("once up", "there and back", "twice up", "drawn")
FACES = np.array([sign * axis for axis in np.eye(3) for sign in (1, -1)])
EDGES = np.array([[a, b, 0] for a in (1, -1) for b in (1, -1)]) / np.sqrt(2)
HALF_WAYS = np.concatenate([np.roll(EDGES, k, axis=1) for k in range(3)])
_HEAD = 'data = "list.csv"\n[channels]\ntime = { column = "row" }\n'


@dataclass(frozen=True)
class Kind:
    """A kind of list.

    ``settings`` are levels from a count, ``plain`` the columns of the declared model, ``laws`` what else a reading may
    follow, of the setting and of the time from 0 to 1; ``names`` are those that are right for each law; ``level`` is
    what is read without noise, ``shown`` what a file has of a setting.
    """

    title: str
    counts: tuple[int, ...]
    settings: Callable[[int], Floats]
    plain: Callable[[Floats], list[Floats]]
    laws: Laws
    names: Mapping[str, str]
    noise: float
    level: Callable[[Floats], Floats]
    manifest: str
    shown: Callable[[Floats], Floats] = lambda x: x


def _turn(count: int) -> Floats:
    return 2 * np.pi * np.arange(count) / count


_SLOW: Laws = {"drift": lambda x, t: t, "step": lambda x, t: (t > 0.55).astype(float)}
_SLOW_NAMES = {"drift": "bias_drift", "step": "bias_step"}
KINDS: Mapping[str, Kind] = {
    "rates": Kind(
        "Rates of a table (gyro; bias and scale factor are declared)",
        (11, 21, 41),
        lambda n: np.linspace(-1, 1, n),
        lambda x: [x],
        {
            "cubic": lambda x, t: x**3,
            "square": lambda x, t: x**2,
            "asymmetry": lambda x, t: np.abs(x),
            "knee": lambda x, t: np.sign(x) * np.maximum(np.abs(x) - 0.6, 0),
        },
        {
            "cubic": "scale_factor_cubic",
            "square": "centripetal_acceleration",
            "asymmetry": "scale_factor_asymmetry",
            "knee": "scale_factor_knee",
        },
        0.05,
        lambda x: 0.3 + 200.8 * x,
        _HEAD + 'table_rate = { column = "x", unit = "200 deg/s" }\ngyro = { column = "y", unit = "deg/s" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n',
    ),
    "temperatures": Kind(
        "Temperatures that were waited for (gyro at rest; bias and its slope are declared)",
        (12, 21, 41),
        lambda n: np.linspace(-1, 1, n),
        lambda x: [x],
        {"square": lambda x, t: x**2, "cubic": lambda x, t: x**3, **_SLOW},
        {"square": "bias_temperature", "cubic": "bias_temperature", **_SLOW_NAMES},
        1e-3,
        lambda x: 0.05 + 0.02 * x,
        _HEAD + 'temperature = { column = "x", unit = "degC" }\ngyro = { column = "y", unit = "deg/s" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias", "bias_temperature"]\n',
        lambda x: 10 + 50 * x,
    ),
    "angles": Kind(
        "Angles of a north finder (level gyro; bias and Earth's rate are declared)",
        (12, 24, 36),
        _turn,
        lambda a: [np.cos(a), np.sin(a)],
        {
            "twice a turn": lambda a, t: np.cos(2 * a + 1),
            "three times a turn": lambda a, t: np.cos(3 * a + 1),
            **_SLOW,
        },
        {"twice a turn": "angle_locked_rate", "three times a turn": "angle_locked_rate", **_SLOW_NAMES},
        0.05,
        lambda a: 3 + 11 * np.cos(a + 0.5),
        _HEAD + 'table_angle = { column = "x", unit = "rad" }\ngyro = { column = "y", unit = "deg/h" }\n'
        '[site]\nlatitude = "40 deg"\n[mounting]\ntilt = "0 deg"\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias", "earth_rate"]\n',
    ),
    "dividing head": Kind(
        "Angles of a dividing head (one accelerometer; bias and scale factor are declared)",
        (12, 24, 36),
        _turn,
        lambda a: [np.sin(a - 0.04), np.cos(a - 0.04)],
        {
            "second order": lambda a, t: np.sin(a - 0.04) ** 2,
            "third order": lambda a, t: np.sin(a - 0.04) ** 3,
            "asymmetry": lambda a, t: np.abs(np.sin(a - 0.04)),
            "cross-coupling": lambda a, t: np.sin(a - 0.04) * np.cos(a - 0.04),
            **_SLOW,
        },
        {
            "second order": "accel_second_order",
            "third order": "accel_third_order",
            "asymmetry": "accel_asymmetry",
            "cross-coupling": "accel_cross_coupling",
            **_SLOW_NAMES,
        },
        1e-4,
        lambda a: 0.01 + 1.002 * np.sin(a - 0.04),
        _HEAD + 'table_angle = { column = "x", unit = "rad" }\naccel = { column = "y", unit = "standard_gravity" }\n'
        '[site]\ngravity = "9.80665 m/s^2"\n'
        '[model]\ntarget = "accel"\ndeclared = ["accel_bias", "accel_scale_factor"]\n',
    ),
}


def ordered(order: str, levels: Floats, rng: np.random.Generator) -> Floats:
    """Levels in an order in which people set them."""
    both = np.concatenate([levels, levels[::-1]])
    return {"once up": levels, "there and back": both, "twice up": np.tile(levels, 2), "drawn": rng.permutation(both)}[
        order
    ]


def read(kind: Kind, order: str, count: int, law: str, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Settings and readings of a list; ``law`` is empty for a null."""
    x = ordered(order, kind.settings(count), rng)
    noise = rng.standard_normal(len(x))
    if law:
        curve = kind.laws[law](x, np.linspace(0, 1, len(x)))
        plain = np.column_stack([np.ones(len(x)), *kind.plain(x)])
        alone = float(np.linalg.norm(curve - plain @ np.linalg.lstsq(plain, curve, rcond=None)[0]))
        noise += STRENGTH / alone * curve if alone > 1e-9 else 0.0
    return x, kind.level(x) + kind.noise * noise


def judged(target: TargetFindings, name: str) -> str:
    """What an answer is worth; ``name`` is empty for a null."""
    sets = [{key.split(":")[0] for key in (a.effect, *a.confounded_with)} for a in target.added if not a.generic]
    false = any(name not in one for one in sets)
    if false:
        return "false"
    sure = target.verdict in ("effects-found", "nothing-significant")
    if name and sets:
        return "right"
    return "missed" if name and sure else "doubt" if not sure else "right"


def case(name: str, order: str, count: int, law: str, seed: int) -> tuple[str, str, str]:
    """One list and its judgement."""
    kind = KINDS[name]
    rng = np.random.default_rng([list(KINDS).index(name), ORDERS.index(order), count, len(law), seed])
    x, y = read(kind, order, count, law, rng)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        np.savetxt(place / "list.csv", np.column_stack([kind.shown(x), y]), "%.9g", ",", header="x,y", comments="")
        (place / "list.toml").write_text(kind.manifest, encoding="utf-8")
        try:
            (target,) = close(place / "list.toml").targets
        except InputError:
            return name, law, "refused"
    return name, law, judged(target, kind.names.get(law, ""))


def told_apart(name: str, order: str, law: str) -> bool:
    """Whether the rows can tell a law: what went up once has the law of the time in that of the setting."""
    return not (order == "once up" and law in _SLOW and name == "temperatures")


def cases(seeds: int) -> Iterator[tuple[str, str, int, str, int]]:
    """All lists; as many without a law as with one."""
    for name, kind in KINDS.items():
        for order in ORDERS:
            for count in kind.counts:
                for seed in range(seeds):
                    yield from ((name, order, count, law, seed) for law in kind.laws if told_apart(name, order, law))
                    yield from ((name, order, count, "", seed * len(kind.laws) + k) for k in range(len(kind.laws)))


def page(counts: Mapping[tuple[str, str], Counter[str]], seeds: int) -> str:
    """The page: a table for each kind."""
    lines = [
        "# Lists of points",
        "",
        "The commonest tests of a laboratory are short lists: a row is a mean at one rate, temperature or angle.",
        f"Lists of 11 to 82 rows in four orders, with a law of {STRENGTH:g} deviations of the noise beside what is",
        "declared, and as many without; laws and noise are NumPy's, and no row has a time. Where temperatures went up",
        "once no law of the time is asked, for it is that of the temperature. `right`: the name, or a set that has it,",
        "and nothing else; `doubt`: no name, and not called complete.",
        "",
        "```bash",
        f"python scripts/studies/points_study.py --seeds {seeds} --out docs/results/points.md   # insenv {VERSION}",
        "```",
    ]
    words = ("right", "doubt", "missed", "false", "refused")
    for name, kind in KINDS.items():
        lines += ["", f"## {kind.title}", "", f"| law | {' | '.join(words)} |", "| --- |" + " --- |" * len(words)]
        for law in (*kind.laws, ""):
            count = counts[name, law]
            label = f"{law} (`{kind.names[law]}`)" if law else "none"
            lines.append(f"| {label} | " + " | ".join(str(count[word]) for word in words) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=5, help="lists of each kind, order, length and law")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, help="page to write")
    given = parser.parse_args()
    every = list(cases(given.seeds))
    run = Parallel(n_jobs=given.jobs, return_as="generator_unordered")(delayed(case)(*one) for one in every)
    counts: dict[tuple[str, str], Counter[str]] = {
        (n, law): Counter() for n, k in KINDS.items() for law in (*k.laws, "")
    }
    for name, law, word in tqdm(run, total=len(every), unit="list"):
        counts[name, law][word] += 1
    text = page(counts, given.seeds)
    print(text)
    if given.out is not None:
        written(given.out, text)


if __name__ == "__main__":
    main()
