"""What common methods make of the cases of the challenge, in the form that `score.py` reads. NumPy and SciPy alone.

    python losers.py FOLDER --like insenv.jsonl --out OUT_FOLDER

All are given means over a second, bias and scale factor, and one library of curves: every effect of the challenge on a
grid of its shapes. Each has its usual rule:

* ``ols``: forward selection by the F test of ordinary least squares, 1 % over all curves (Bonferroni);
* ``newey-west``: the same by the Wald test with the covariance of Newey and West (1987), lags 4 (n / 100)^(2/9);
* ``lasso``: weight by the Bayesian information criterion along the path;
* ``stlsq``: sequentially thresholded least squares of SINDy (Brunton et al. 2016), threshold by the same criterion;
* ``knockoffs``: fixed-X, equicorrelated (Barber and Candes 2015), of curves that correlate by less than 0.7, those
  left out being their rivals; differences of lasso coefficients, false discovery rate 10 %.
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.special import chdtrc, fdtrc

Floats = NDArray[np.float64]
#: Rows of a mean, level of the tests, effects at most, and curves that are put to the test of Newey and West.
BLOCK, LEVEL, MOST, TESTED = 5, 0.01, 6, 25
#: Correlation from which two curves are one to the knockoffs, and their false discovery rate.
ALIKE, DISCOVERIES = 0.7, 0.1
NAMES = ("ols", "newey-west", "lasso", "stlsq", "knockoffs")


@dataclass(frozen=True)
class Library:
    """Curves beside bias and scale factor, of unit length, and the data: ``name`` and group of each column."""

    y: Floats
    columns: Floats
    names: tuple[str, ...]
    group: NDArray[np.int64]


def _lagged(x: Floats, step: float, tau: float) -> Floats:
    keep = np.exp(-step / tau)
    return np.asarray(lfilter([1 - keep], [1, -keep], x, zi=[keep * x[0]])[0])


def _curves(t: Floats, u: Floats, angle: Floats, kelvin: Floats) -> list[tuple[str, list[Floats]]]:
    """Name and columns of every effect at every shape."""
    end, top = t[-1], np.abs(u).max()
    taus = end * np.array([0.05, 0.1, 0.15, 0.2, 0.3])
    found: list[tuple[str, list[Floats]]] = [("bias_drift", [t]), ("scale_factor_drift", [u * t])]
    found += [("bias_warm_up", [np.exp(-t / tau)]) for tau in taus]
    found += [("scale_factor_warm_up", [u * np.exp(-t / tau)]) for tau in taus]
    found += [("bias_step", [(t > end * share) * 1.0]) for share in np.arange(0.1, 0.95, 0.05)]
    found += [("bias_temperature", [kelvin]), ("scale_factor_temperature", [u * kelvin])]
    found += [("bias_temperature_rate", [np.gradient(kelvin, t)])]
    found += [("bias_thermal_lag", [kelvin - _lagged(kelvin, t[1] - t[0], tau)]) for tau in taus]
    found += [("scale_factor_asymmetry", [np.abs(u)]), ("scale_factor_cubic", [u**3])]
    found += [
        ("scale_factor_anomaly", [np.sign(u) * np.exp(-((np.abs(u) - share * top) ** 2) / (2 * (0.12 * top) ** 2))])
        for share in np.arange(0.25, 0.8, 0.1)
    ]
    found += [("timing_skew", [-np.gradient(u, t)])]
    for order in (1, 2, 3, 4):
        waves = [np.cos(order * angle), np.sin(order * angle)]
        found += [(f"angle_locked_rate:{order}", waves), (f"encoder_harmonic:{order}", [u * wave for wave in waves])]
    for f in np.arange(0.02, 0.3, 2 / end):
        found.append(("tone", [np.cos(2 * np.pi * f * t), np.sin(2 * np.pi * f * t)]))
    return found


def library(case: Path) -> Library:
    """Of a case."""
    t, gyro, angle, kelvin = np.loadtxt(case / "run.csv", delimiter=",", skiprows=1, unpack=True)
    rate = np.diff(np.deg2rad(angle), prepend=0.0) / (t[1] - t[0])

    def means(x: Floats) -> Floats:
        return np.asarray(x[: len(x) // BLOCK * BLOCK].reshape(-1, BLOCK).mean(axis=1))

    t, y, u, angle, kelvin = map(means, (t, np.deg2rad(gyro) - rate, rate, np.deg2rad(angle), kelvin - 25))
    names, groups, columns = [], [], []
    for group, (name, own) in enumerate(_curves(t, u, angle, kelvin)):
        for column in own:
            names.append(name)
            groups.append(group)
            columns.append(column)
    q = np.linalg.qr(np.column_stack([np.ones(len(t)), u]))[0]
    x, y = np.column_stack(columns), y - q @ (q.T @ y)
    x = x - q @ (q.T @ x)
    size = np.linalg.norm(x, axis=0)
    kept = size > 1e-9 * np.linalg.norm(np.column_stack(columns), axis=0)
    x = x[:, kept] / size[kept]
    return Library(y / np.std(y), x, tuple(np.array(names)[kept]), np.array(groups)[kept])


Said = list[tuple[str, tuple[str, ...]]]


def _forward(given: Library, p_value: Callable[[Floats, Floats, NDArray[np.int64]], Floats]) -> Said:
    """Curves added one by one while the best is significant."""
    basis = np.zeros((len(given.y), 0))
    said: Said = []
    groups = np.unique(given.group)
    for _ in range(MOST):
        left = given.y - basis @ (basis.T @ given.y)
        x = given.columns - basis @ (basis.T @ given.columns)
        p = p_value(left, x, groups) if len(groups) else np.ones(1)
        best = int(np.argmin(p))
        if p[best] * len(groups) >= LEVEL:
            break
        own = np.flatnonzero(given.group == groups[best])
        said.append((str(given.names[own[0]]), ()))
        basis = np.linalg.qr(np.column_stack([basis, x[:, own]]))[0]
        groups = groups[[not _spanned(given, g, basis) for g in groups]]
    return said


def _spanned(given: Library, group: int, basis: Floats) -> bool:
    x = given.columns[:, given.group == group]
    return bool(np.linalg.norm(x - basis @ (basis.T @ x), axis=0).min() < 0.05)


def ols(given: Library) -> Said:
    """Forward selection by the F test."""

    def p_value(left: Floats, x: Floats, groups: NDArray[np.int64]) -> Floats:
        found = []
        for group in groups:
            own = np.linalg.qr(x[:, given.group == group])[0]
            gained, n, k = float(np.sum((own.T @ left) ** 2)), len(left), own.shape[1]
            found.append(fdtrc(k, n - 2 - k, gained / k / ((left @ left - gained) / (n - 2 - k))))
        return np.array(found)

    return _forward(given, p_value)


def newey_west(given: Library) -> Said:
    """Forward selection by the Wald test that knows of correlated noise."""

    def p_value(left: Floats, x: Floats, groups: NDArray[np.int64]) -> Floats:
        n = len(left)
        lags = int(4 * (n / 100) ** (2 / 9))
        bases = [np.linalg.qr(x[:, given.group == group])[0] for group in groups]
        order = np.argsort([-float(np.sum((own.T @ left) ** 2)) for own in bases])[:TESTED]
        found = np.ones(len(groups))
        for index in order:
            own = bases[index]
            theta = own.T @ left
            scores = own * (left - own @ theta)[:, None]
            cov = scores.T @ scores
            for lag in range(1, lags + 1):
                cross = scores[lag:].T @ scores[:-lag]
                cov += (1 - lag / (lags + 1)) * (cross + cross.T)
            found[index] = chdtrc(own.shape[1], max(float(theta @ np.linalg.solve(cov, theta)), 0.0))
        return found

    return _forward(given, p_value)


def _lasso(gram: Floats, product: Floats, weight: float, start: Floats, step: float) -> Floats:
    """Coefficients of least squares with ``weight`` times their absolute sum (FISTA)."""
    beta, ahead, momentum = start, start, 1.0
    for _ in range(200):
        moved = ahead - step * (gram @ ahead - product)
        new = np.sign(moved) * np.maximum(np.abs(moved) - step * weight, 0)
        following = 0.5 * (1 + np.sqrt(1 + 4 * momentum**2))
        ahead = new + (momentum - 1) / following * (new - beta)
        change = float(np.abs(new - beta).max())
        beta, momentum = new, following
        if change < 1e-6:
            break
    return beta


def _criterion(given: Library, kept: NDArray[np.bool_]) -> float:
    """Bayesian information criterion of least squares on some columns."""
    n, x = len(given.y), given.columns[:, kept]
    left = given.y - x @ np.linalg.lstsq(x, given.y, rcond=1e-8)[0] if kept.any() else given.y
    return float(n * np.log(left @ left / n) + kept.sum() * np.log(n))


def _of(given: Library, kept: NDArray[np.bool_]) -> Said:
    return [(name, ()) for name in dict.fromkeys(np.array(given.names)[kept].tolist())]


def lasso(given: Library) -> Said:
    """The lasso."""
    gram, product = given.columns.T @ given.columns, given.columns.T @ given.y
    step = 1 / float(np.linalg.eigvalsh(gram)[-1])
    beta, best = np.zeros(len(product)), (np.inf, np.zeros(len(product), bool))
    for weight in np.abs(product).max() * np.geomspace(1, 0.05, 16):
        beta = _lasso(gram, product, weight, beta, step)
        best = min(best, (_criterion(given, beta != 0), beta != 0), key=lambda pair: pair[0])
    return _of(given, best[1])


def stlsq(given: Library) -> Said:
    """Sequentially thresholded least squares."""
    gram, product = given.columns.T @ given.columns, given.columns.T @ given.y
    best = (_criterion(given, np.zeros(len(product), bool)), np.zeros(len(product), bool))
    for threshold in np.abs(product).max() * np.geomspace(1.0, 0.05, 12):
        kept = np.ones(len(product), bool)
        for _ in range(20):
            own = np.flatnonzero(kept)
            beta = np.zeros(len(product))
            beta[own] = np.linalg.solve(gram[np.ix_(own, own)] + 0.05 * np.eye(len(own)), product[own])
            larger = np.abs(beta) >= threshold
            if not larger.any() or np.array_equal(larger, kept):
                kept = larger
                break
            kept = larger
        best = min(best, (_criterion(given, kept), kept), key=lambda pair: pair[0])
    return _of(given, best[1])


def knockoffs(given: Library) -> Said:
    """Fixed-X knockoffs."""
    gram = given.columns.T @ given.columns
    kept: list[int] = []
    for j in range(len(gram)):
        if not kept or np.abs(gram[j, kept]).max() < ALIKE:
            kept.append(j)
    x, sigma = given.columns[:, kept], gram[np.ix_(kept, kept)]
    p = len(kept)
    s = min(1.0, 2 * float(np.linalg.eigvalsh(sigma)[0])) * 0.999
    inverse = np.linalg.inv(sigma)
    root = np.linalg.cholesky(2 * s * np.eye(p) - s * s * inverse + 1e-12 * np.eye(p)).T
    rng = np.random.default_rng(0)
    other = rng.standard_normal((len(x), p))
    other -= x @ np.linalg.lstsq(x, other, rcond=None)[0]
    false = x @ (np.eye(p) - s * inverse) + np.linalg.qr(other)[0] @ root
    both = np.column_stack([x, false])
    square, product = both.T @ both, both.T @ given.y
    weight = float(np.std(given.y)) * np.sqrt(2 * np.log(2 * p))
    beta = np.abs(_lasso(square, product, weight, np.zeros(2 * p), 1 / float(np.linalg.eigvalsh(square)[-1])))
    w = beta[:p] - beta[p:]
    for least in np.sort(np.abs(w[w != 0])):
        if np.sum(w <= -least) <= DISCOVERIES * max(np.sum(w >= least), 1):
            break
    else:
        return []
    said: dict[str, set[str]] = {}
    for column in np.array(kept)[w >= least].tolist():
        alike = np.array(given.names)[np.abs(gram[column]) >= ALIKE].tolist()
        said.setdefault(str(given.names[column]), set()).update(alike)
    return [(name, tuple(sorted(rivals - {name}))) for name, rivals in said.items()]


METHODS: dict[str, Callable[[Library], Said]] = dict(
    zip(NAMES, (ols, newey_west, lasso, stlsq, knockoffs), strict=True)
)


def answered(folder: Path, cases: list[str], out: Path) -> None:
    """Answers of every method to some cases, a file each; what is there already is left out."""
    out.mkdir(parents=True, exist_ok=True)
    paths = {name: out / f"{name}.jsonl" for name in METHODS}
    done = {
        name: {json.loads(line)["case"] for line in path.read_text().splitlines()} if path.exists() else set()
        for name, path in paths.items()
    }
    for case in cases:
        given = None
        for name, method in METHODS.items():
            if case in done[name]:
                continue
            given = library(folder / "cases" / case) if given is None else given
            said = [{"name": one, "rivals": list(rivals)} for one, rivals in method(given)]
            verdict = "effects-found" if said else "nothing-significant"
            with paths[name].open("a") as file:
                file.write(json.dumps({"case": case, "verdict": verdict, "effects": said}) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--like", type=Path, help="answers whose cases are taken; all cases otherwise")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    cases = sorted(path.name for path in (given.folder / "cases").iterdir())
    if given.like is not None:
        wanted = {json.loads(line)["case"] for line in given.like.read_text().splitlines()}
        cases = [case for case in cases if case in wanted]
    answered(given.folder, cases, given.out)


if __name__ == "__main__":
    main()
