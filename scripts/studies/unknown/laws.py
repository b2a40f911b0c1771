"""Twenty laws that no catalogue has, and what a formula makes on a run: NumPy alone, nothing of insenv.

A law is the mean over each row of a product that is formed at `FINE` parts of a row. Tables, climates, noise and
strengths are those of the study of unknown causes beside this one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from causes import Cause, lagged
from procedures import Test, rest, table
from world import FINE, Floats, Ruler, Run

#: Of the manifests, where nothing is said [degC].
REFERENCE = 25.0
#: Strength left beside a formula below which it is the law, or nobody could tell it from it.
ALIKE = 3.0


def drivers(run: Run) -> dict[str, Floats]:
    """Rate, its derivative, temperature over the reference, its derivative, time and angle at the fine edges."""
    step = run.dt / FINE
    t = np.arange(len(run.fine)) * step
    warm = np.interp(t, run.t, run.temperature) - REFERENCE
    return {
        "u": run.fine,
        "du": np.gradient(run.fine, step),
        "T": warm,
        "dT": np.gradient(warm, step),
        "t": t,
        "a": run.fine_angle,
    }


def chamber(n: int, dt: float, rng: np.random.Generator) -> Floats:
    """Temperature at the rows [degC] of a chamber that goes from level to level: a sine would make lines of powers."""
    levels = REFERENCE + rng.permutation([-14.0, -8.0, -3.0, 4.0, 9.0, 15.0])
    told = np.repeat(levels, -(-n // len(levels)))[:n]
    return lagged(lagged(told, dt, 0.03 * n * dt), dt, 0.015 * n * dt)


@dataclass(frozen=True)
class Law:
    """One law: its formula as the program writes it, programme, grade, and the product of the drivers."""

    formula: str
    kind: str
    grade: str
    of: Callable[[Mapping[str, Floats]], Floats]
    climate: str = "chamber"
    tau: float = 0.0

    def test(self, rng: np.random.Generator) -> Test:
        """What is measured; where the law has the angle in it, the angle is."""
        if self.kind == "rest":
            made = rest(self.grade, rng, climate=self.climate, hours=1.5)
        else:
            made = table(self.kind, self.grade, rng, climate=self.climate)
            made = replace(made, angle=True) if "cos(" in self.formula else made
        if self.climate != "chamber":
            return made
        return replace(made, runs=tuple(replace(run, temperature=chamber(run.n, run.dt, rng)) for run in made.runs))

    def cause(self, phase: float) -> Cause:
        """The law at a phase of the angle, as an addition to the rows of a run."""

        def curve(run: Run, size: float) -> tuple[Floats, Floats]:
            at = dict(drivers(run))
            at["a"] = at["a"] + phase
            fine = self.of(at)
            if self.tau:
                fine = lagged(fine, run.dt / FINE, self.tau * run.n * run.dt)
            return size * run.rows(fine), np.zeros(run.n)

        return Cause(self.formula, (self.formula,), curve)


LAWS = (
    Law("u^2 * (T - T_ref)", "ladder", "fibre", lambda x: x["u"] ** 2 * x["T"]),
    Law("u * (T - T_ref)^2", "ladder", "fibre", lambda x: x["u"] * x["T"] ** 2),
    Law("|u| * (T - T_ref)", "loop", "mems", lambda x: np.abs(x["u"]) * x["T"]),
    Law("u * dT/dt", "loop", "fibre", lambda x: x["u"] * x["dT"]),
    Law("u^2 * dT/dt", "ladder", "laser", lambda x: x["u"] ** 2 * x["dT"]),
    Law("u|u|", "loop", "mems", lambda x: x["u"] * np.abs(x["u"]), "room"),
    Law("|u| * t", "ladder", "fibre", lambda x: np.abs(x["u"]) * x["t"], "room"),
    Law("u^2 * t", "loop", "laser", lambda x: x["u"] ** 2 * x["t"], "room"),
    Law("u^3 * (T - T_ref)", "ladder", "mems", lambda x: x["u"] ** 3 * x["T"]),
    Law("(T - T_ref) * cos(a + p)", "stops", "fibre", lambda x: x["T"] * np.cos(x["a"])),
    Law("t * cos(a + p)", "stops", "laser", lambda x: x["t"] * np.cos(x["a"]), "room"),
    Law("u^2 * cos(2 a + p)", "swing", "fibre", lambda x: x["u"] ** 2 * np.cos(2 * x["a"]), "room"),
    Law("|u| * cos(a + p)", "loop", "mems", lambda x: np.abs(x["u"]) * np.cos(x["a"]), "room"),
    Law("(du/dt)^2", "swing", "mems", lambda x: x["du"] ** 2, "room"),
    Law("|du/dt|", "swing", "fibre", lambda x: np.abs(x["du"]), "room"),
    Law("dT/dt * cos(a + p)", "ladder", "laser", lambda x: x["dT"] * np.cos(x["a"])),
    Law("(T - T_ref) * dT/dt", "rest", "fibre", lambda x: x["T"] * x["dT"]),
    Law("lag(|dT/dt|)", "rest", "mems", lambda x: np.abs(x["dT"]), tau=0.05),
    Law("|T - T_ref|", "rest", "laser", lambda x: np.abs(x["T"])),
    Law("(T - T_ref) * t", "rest", "fibre", lambda x: x["T"] * x["t"]),
)


def on_rows(t: Floats, u: Floats, angle: Floats, celsius: Floats) -> dict[str, Floats]:
    """The drivers at even rows, for a rest of a measured instrument and a table that was never there."""
    dt = float(t[1] - t[0])
    warm = celsius - REFERENCE
    return {"u": u, "du": np.gradient(u, dt), "T": warm, "dT": np.gradient(warm, dt), "t": t, "a": angle}


def addition(law: Law, at: Mapping[str, Floats]) -> Floats:
    """A law at rows, of unit size."""
    made = law.of(at)
    span = float(at["t"][-1] - at["t"][0])
    return lagged(made, float(at["t"][1] - at["t"][0]), law.tau * span) if law.tau else made


def columns_at(formula: str, at: Mapping[str, Floats], tau: float) -> Floats:
    """What a formula of the report makes at rows, shape (n, k)."""
    if formula.startswith("lag("):
        return lagged(evaluated(formula[4:-1], at)[:, 0], float(at["t"][1] - at["t"][0]), tau)[:, None]
    return evaluated(formula, at)


def column(formula: str, run: Run, tau: float) -> Floats:
    """What a formula of the report makes on a run, shape (n, k): evaluated anew from its text."""
    if formula.startswith("lag("):
        fine = evaluated(formula[4:-1], drivers(run))[:, 0]
        return run.rows(lagged(fine, run.dt / FINE, tau))[:, None]
    fine = evaluated(formula, drivers(run))
    return np.column_stack([run.rows(c) for c in fine.T])


def evaluated(text: str, at: Mapping[str, Floats]) -> Floats:
    """A product of factors, shape (n, k)."""
    out = np.ones((len(at["u"]), 1))
    for factor in text.split(" * "):
        columns = _factor(factor, at)
        out = np.column_stack([a * b for a in out.T for b in columns.T])
    return out


def _factor(text: str, at: Mapping[str, Any]) -> Floats:
    if text.startswith("cos("):
        order = int(text[4:].split(" ")[0]) if text[4].isdigit() else 1
        return np.column_stack([np.cos(order * at["a"]), np.sin(order * at["a"])])
    if text == "u|u|":
        return (at["u"] * np.abs(at["u"]))[:, None]
    if text == "1/u":
        moves = np.abs(at["u"]) > 1e-3
        return np.where(moves, 1 / np.where(moves, at["u"], 1.0), 0.0)[:, None]
    names = {"u": "u", "du/dt": "du", "T - T_ref": "T", "dT/dt": "dT", "t": "t"}
    bare, _, power = text.partition("^")
    if bare in ("(T - T_0)", "(t - t_0)"):
        return np.vander(at[bare[1]], int(power or 1) + 1)
    value = at[names[bare.strip("()|")]]
    value = np.abs(value) if bare.startswith("|") else value
    return (value ** int(power or 1))[:, None]


def left(test: Test, cause: Cause, size: float, formula: str, tau: float) -> float:
    """Strength of a law that is left beside the declared model and a formula."""
    ruler = Ruler(test.grade, test.runs[0].dt, test.grade.encoder if test.angle else 0.0)
    beside = [np.column_stack([test.columns(run), column(formula, run, tau)]) for run in test.runs]
    return ruler.strength(test.shown(cause, size), beside)
