"""An independent fit of a triad held still in many attitudes: numpy alone, nothing of insenv.

    accelerometers   | K_a (m_k - o) | = g             K_a upper triangular, 9 parameters, rest by rest
    gyros            C(K_g (w - b))' u_k = u_k+1       K_g any 3 x 3 matrix, 9 parameters, from rest to rest

u_k is the direction of K_a (m_k - o), b goes straight from its mean in one rest to that in the next. Rests are the
stretches whose scatter over half a second, as root mean square over the channels, stays below 1.7 times that of the
calmest stretches; of several in one attitude the longest; a quarter of a second is cut off at either end. Levenberg and
Marquardt with derivatives by differences.

    python scripts/studies/measured/many_attitudes.py RECORDING FOLDER

prints the root mean square error of the rotations: of all turns without the matrix and with it, and of each turn by the
matrix of all others.

Source: Tedaldi, Pretto and Menegatti, ICRA (2014).
"""

# mypy: disable-error-code="no-untyped-def,call-overload"

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np

G = 9.80665


def read(name: str, folder: Path) -> tuple[np.ndarray, np.ndarray, float]:
    """Accelerations, rates (nominal SI), shapes (n, 3), and the sampling period [s]."""
    if name == "imu_tk":
        a = np.loadtxt(folder / "imu_tk/xsens_acc.mat")
        w = np.loadtxt(folder / "imu_tk/xsens_gyro.mat")
        return (a[:, 1:] - 32768) * 0.00241, (w[:, 1:] - 32768) * 2.086e-4, float(np.median(np.diff(a[:, 0])))
    if name in ("mikoff_imu0", "mikoff_imu1"):
        x = np.loadtxt(folder / f"mikoff_imu_calib/imu{name[-1]}.log")
        return x[:, :3], x[:, 3:6], 0.01
    if name == "imucal":
        x = np.genfromtxt(folder / "imucal/example_ferraris_session.csv", delimiter=",", names=True)
        a = np.column_stack([x[f"acc_{c}"] for c in "xyz"])
        return a, np.deg2rad(np.column_stack([x[f"gyr_{c}"] for c in "xyz"])), 1 / 102.4
    raise SystemExit(f"{name}: wanted imu_tk, mikoff_imu0, mikoff_imu1 or imucal")


def rests(a: np.ndarray, w: np.ndarray, dt: float) -> list[tuple[int, int]]:
    """Half-open rows of the rests."""
    half = round(0.25 / dt)
    width = 2 * half + 1
    x = np.column_stack([a, w])
    view = np.lib.stride_tricks.sliding_window_view(x, width, axis=0)
    scatter = view.std(axis=-1)
    still = np.sqrt(np.mean((scatter / np.quantile(scatter, 0.1, axis=0)) ** 2, axis=1)) < 1.7
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    found = [(i + half, j + half) for i, j in zip(edges[::2], edges[1::2], strict=True)]
    joined: list[tuple[int, int]] = []
    for i, j in (x for x in found if x[1] - x[0] > 4 * half):  # a knock parts no rest
        if joined:
            p, q = joined[-1]
            u, v = a[p:q].mean(axis=0), a[i:j].mean(axis=0)
            angle = np.linalg.norm(np.cross(u, v)) / np.linalg.norm(u) / np.linalg.norm(v)
            if angle < 0.05 and (i - q) * dt < 0.6:
                joined[-1] = (p, q) if q - p > j - i else (i, j)
                continue
        joined.append((i, j))
    return [(i + half, j - half) for i, j in joined]


def least_squares(function, start: np.ndarray) -> np.ndarray:
    """Levenberg and Marquardt."""
    theta, damping = start.astype(float), 1e-3
    r = function(theta)
    for _ in range(100):
        steps = np.maximum(1e-6, 1e-6 * np.abs(theta))
        j = np.column_stack([(function(theta + s * e) - r) / s for s, e in zip(steps, np.eye(len(theta)), strict=True)])
        normal, right = j.T @ j, j.T @ r
        while damping < 1e9:
            tried = theta - np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-300), right)
            new = function(tried)
            if new @ new <= r @ r:
                break
            damping *= 4
        else:
            return theta
        done = r @ r - new @ new < 1e-10 * (r @ r)
        theta, r, damping = tried, new, damping / 4
        if done:
            return theta
    return theta


def accelerometers(m: np.ndarray, faces: bool) -> np.ndarray:
    """K_a and o from the means at rest, shape (n, 3), as 9 numbers; ``faces`` alone tell nothing off the diagonal."""
    start = np.array([1.0, 0, 0, 1, 0, 1, 0, 0, 0])
    free = np.array([0, 3, 5, 6, 7, 8]) if faces else np.arange(9)

    def whole(x: np.ndarray) -> np.ndarray:
        t = start.copy()
        t[free] = x
        return t

    error = lambda x: np.linalg.norm(calibrated(m, whole(x)), axis=1) - G  # noqa: E731
    return whole(least_squares(error, start[free]))


def calibrated(m: np.ndarray, t: np.ndarray) -> np.ndarray:
    k = np.array([[t[0], t[1], t[2]], [0, t[3], t[4]], [0, 0, t[5]]])
    return (m - t[6:]) @ k.T


def rotated(rates: np.ndarray, dt: float) -> np.ndarray:
    """Attitude at the end of (n, 3) rates, in the axes at the start."""
    q = np.array([1.0, 0, 0, 0])
    for x, y, z in 0.5 * (rates[1:] + rates[:-1]) * dt / 2:
        n = np.sqrt(x * x + y * y + z * z)
        c, s = np.cos(n), (np.sin(n) / n if n > 1e-12 else 1.0)
        x, y, z = s * x, s * y, s * z
        a, b, e, d = q
        q = np.array(
            [
                a * c - b * x - e * y - d * z,
                a * x + b * c + e * z - d * y,
                a * y - b * z + e * c + d * x,
                a * z + b * y - e * x + d * c,
            ]
        )
    a, b, c, d = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (c * c + d * d), 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), 1 - 2 * (b * b + d * d), 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), 1 - 2 * (b * b + c * c)],
        ]
    )


def rotation_errors(turns, u: np.ndarray, dt: float, matrix: np.ndarray) -> np.ndarray:
    """Sine vectors from where the gyros carry the vertical to where it is, shape (turns, 3)."""
    return np.array([np.cross(rotated(x @ matrix.T, dt).T @ u[i], u[i + 1]) for i, x in turns])


def main(name: str, folder: Path) -> dict[str, float]:
    """Figures of one recording, printed."""
    a, w, dt = read(name, folder)
    found = rests(a, w, dt)
    m = np.array([a[i:j].mean(axis=0) for i, j in found])
    b = np.array([w[i:j].mean(axis=0) for i, j in found])
    t = accelerometers(m, name == "imucal")
    f = calibrated(m, t)
    left = np.linalg.norm(f, axis=1) - G
    u = f / np.linalg.norm(f, axis=1)[:, None]
    turns = []
    for k, ((_, j), (i, _)) in enumerate(pairwise(found)):
        share = np.linspace(0, 1, i - j + 2)[:, None]
        turns.append((k, w[j - 1 : i + 1] - (b[k] + share * (b[k + 1] - b[k]))))

    def rms(e: np.ndarray) -> float:
        return float(np.degrees(np.sqrt(np.mean(np.sum(e**2, axis=1)))))

    def matrix(part) -> np.ndarray:
        error = lambda x: rotation_errors(part, u, dt, np.eye(3) + x.reshape(3, 3)).ravel()  # noqa: E731
        return np.eye(3) + least_squares(error, np.zeros(9)).reshape(3, 3)

    whole = matrix(turns)
    # Each by the others, from the derivatives of all: the residual of a turn over what it does not explain itself.
    error = lambda x: rotation_errors(turns, u, dt, whole + x.reshape(3, 3)).ravel()  # noqa: E731
    r, step = error(np.zeros(9)), 1e-6
    slopes = np.column_stack([(error(step * e) - r) / step for e in np.eye(9)])
    hat = slopes @ np.linalg.solve(slopes.T @ slopes, slopes.T)
    blocks = [slice(3 * k, 3 * k + 3) for k in range(len(turns))]
    each = np.array([np.linalg.solve(np.eye(3) - hat[b, b], r[b]) for b in blocks])
    out = {
        "rests": len(found),
        "accel_rms": float(np.sqrt(left @ left / max(len(left) - (6 if name == "imucal" else 9), 1))),
        "before": rms(rotation_errors(turns, u, dt, np.eye(3))),
        "all": rms(rotation_errors(turns, u, dt, whole)),
        "each by the others": rms(each),
    }
    parameters = 6 if name == "imucal" else 9
    left_mm = 1e3 * out["accel_rms"]
    print(f"{name}: {out['rests']} rests; accelerometers leave {left_mm:.3g} mm/s^2 ({parameters} parameters)")
    print(f"  rotations: {out['before']:.3g} deg without a matrix, {out['all']:.3g} deg with it,")
    print(f"  {out['each by the others']:.3g} deg each by the others")
    print(np.array2string(1e2 * (whole - np.eye(3)), precision=3, suppress_small=True), "% beside the identity")
    return out


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
