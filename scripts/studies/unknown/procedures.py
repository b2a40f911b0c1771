"""Tests of an instrument: what a table is told, what is logged and declared, and how strong a cause is in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from causes import Cause, common
from world import DEG, GRADES, Floats, Grade, Rng, Ruler, Run, programme, room, swing

#: Strength that is left beside a curve from which on it is another one.
ALIKE = 3.0


@dataclass(frozen=True)
class Test:
    """A rate-table test, or a gyro at rest: its runs, what is logged, what is declared."""

    grade: Grade
    runs: tuple[Run, ...]
    angle: bool
    command: bool
    thermometer: bool
    tilt: float
    declared: tuple[str, ...]

    @property
    def turning(self) -> bool:
        """Whether the table moves."""
        return any(np.ptp(run.fine) > 0 for run in self.runs)

    def columns(self, run: Run) -> Floats:
        """Regressors of what is declared, shape (n, k); a bias is in the level of each run."""
        out = [np.zeros((run.n, 0))]
        if "scale_factor" in self.declared:
            out.append(run.rate[:, None])
        if "earth_rate" in self.declared and self.turning:
            middle = 0.5 * (run.angle[1:] + run.angle[:-1])
            out.append(np.column_stack([np.cos(middle), np.sin(middle)]))
        if "bias_temperature" in self.declared:
            out.append((run.temperature - 25.0)[:, None])
        return np.concatenate(out, axis=1)

    def shown(self, cause: Cause, size: float) -> list[Floats]:
        """What a cause adds to measured minus reference, run by run."""
        out = []
        for run in self.runs:
            gyro, encoder = cause.curve(run, size)
            shift = np.diff(encoder, prepend=0.0) / run.dt if self.angle else np.zeros(run.n)
            out.append(gyro - np.sin(self.tilt) * shift)
        return out

    def sized(self, cause: Cause, wanted: float) -> float:
        """Size at which a cause has the wanted strength."""
        ruler = Ruler(self.grade, self.runs[0].dt, self.grade.encoder if self.angle else 0.0)
        declared = [self.columns(run) for run in self.runs]

        def of(size: float) -> float:
            return ruler.strength(self.shown(cause, size), declared)

        size = cause.size
        for _ in range(60):
            now = of(size)
            if abs(now / wanted - 1) < 0.02:
                break
            size *= float(np.clip((wanted / now) if now > 0 else 10.0, 0.1, 10.0))
        if abs(now / wanted - 1) < 0.3:
            return size
        # A threshold tells nothing, or much: the nearest that there is.
        sizes = [float(x) for x in size * np.geomspace(0.03, 30, 60)]
        return min(sizes, key=lambda x: abs(np.log(max(of(x), 1e-9) / wanted)))

    def strength(self, cause: Cause, size: float) -> float:
        """That a cause of this size has."""
        ruler = Ruler(self.grade, self.runs[0].dt, self.grade.encoder if self.angle else 0.0)
        return ruler.strength(self.shown(cause, size), [self.columns(run) for run in self.runs])

    def alike(self, cause: Cause, size: float) -> tuple[str, ...]:
        """Ordinary names whose curve takes the cause's place to less than `ALIKE`."""
        ruler = Ruler(self.grade, self.runs[0].dt, self.grade.encoder if self.angle else 0.0)
        declared, shown = [self.columns(run) for run in self.runs], self.shown(cause, size)
        out = []
        for name, of in common(self.runs[0]).items():
            beside = [np.column_stack([x, of(run)]) for x, run in zip(declared, self.runs, strict=True)]
            if ruler.strength(shown, beside) < ALIKE:
                out.append(name.partition("/")[0])
        return tuple(dict.fromkeys(out))


def table(kind: str, grade: str, rng: Rng, *, runs: int = 1, tilt: float = 90 * DEG, climate: str = "room") -> Test:
    """On a table: "ladder", "loop" (up and down again), "reversal", "swing", "stops", "fine" (small rates too)."""
    g = GRADES[grade]
    top, dt = g.top * float(rng.uniform(0.5, 1.0)), 0.05
    made = []
    for _ in range(runs):
        if kind == "ladder":
            rates = top * np.array([0.1, -0.1, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1.0, -1.0])
            fine, told = programme(rates, 18.0, dt, 60 * DEG, repeat=5)
        elif kind == "loop":
            steps = np.array([0.2, 0.4, 0.6, 0.8, 1.0, 0.8, 0.6, 0.4, 0.2, 0.0])
            fine, told = programme(top * np.concatenate([steps, -steps]), 12.0, dt, 60 * DEG, repeat=4)
        elif kind == "fine":
            steps = np.array([0.003, 0.006, 0.012, 0.025, 0.05, 0.1, 0.3, 1.0])
            rates = (0.2 * top * steps)[:, None] * np.array([1.0, -1.0])
            fine, told = programme(rates.ravel(), 14.0, dt, 60 * DEG, repeat=4)
        elif kind == "reversal":
            fine, told = programme([0.5 * top, -0.5 * top], 25.0, dt, 40 * DEG, repeat=18)
        elif kind == "stops":
            rates = top * np.array([1.0, 0.0, -0.6, 0.0, 0.8, 0.0, -1.0, 0.0])
            fine, told = programme(rates, 40.0, dt, 60 * DEG, repeat=3)
        elif kind == "constant":
            fine, told = programme([0.5 * top], 900.0, dt, 40 * DEG)
        else:
            fine = told = swing(0.5 * top, (20.0, 8.0, 4.0, 2.0), 900.0, dt)
        n = (len(fine) - 1) // 4
        made.append(Run(dt, fine, room(n, dt, rng, climate), told))
    declared = ("bias", "scale_factor") + (("earth_rate",) if tilt < 80 * DEG else ())
    angle, command = _logged(rng, kind)
    return Test(g, tuple(made), angle, command, climate != "room", tilt, declared)


def _logged(rng: Rng, kind: str) -> tuple[bool, bool]:
    """Angle alone, or command alone, or both; a swing is logged by its angle."""
    if kind == "swing":
        return True, False
    return ((True, False), (True, True), (False, True))[int(rng.integers(3))]


def rest(grade: str, rng: Rng, *, climate: str = "room", hours: float = 1.0) -> Test:
    """A gyro at rest, a row a second."""
    n = int(hours * 3600)
    still = np.zeros(4 * n + 1)
    run = Run(1.0, still, room(n, 1.0, rng, climate), still)
    return Test(GRADES[grade], (run,), False, False, climate != "room", 90 * DEG, ("bias",))


def positions(grade: str, rng: Rng) -> Test:
    """A north finder: the level axis at eight headings, in turn, three times."""
    dt, step = 0.1, 45 * DEG
    speed = 20 * DEG
    one = np.concatenate([np.full(int(step / speed / dt * 4), speed), np.zeros(int(60 / dt) * 4)])
    back = np.concatenate([np.full(int(7 * step / speed / dt * 4), -speed), np.zeros(int(60 / dt) * 4)])
    fine = np.concatenate([np.zeros(240 * 4), np.tile(np.concatenate([np.tile(one, 7), back]), 4)])
    fine = fine[: (len(fine) - 1) // 4 * 4 + 1]
    n = (len(fine) - 1) // 4
    run = Run(dt, fine, room(n, dt, rng, "room"), fine)
    return Test(GRADES[grade], (run,), True, False, False, 0.0, ("bias", "earth_rate"))
