"""A unit at rest, with NumPy alone: nothing of insenv is used.

Of each channel: quantum, Allan deviation with its floor and where that lies, lines (averaged periodogram of Hann
windows, peaks against the median about them), a straight drift with a standard deviation from the scatter of the
eighths, bursts (seconds that are far louder than the median, on one channel or on several), and the regression on
temperature.

    python rest_fit.py FILE(.csv|.npz) --columns 0 1 2 --rate 100 [--delimiter ,] [--skip 1]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A line stands so many times above the median of its surroundings in the averaged periodogram.
LINE = 12.0
#: A second is a burst where its standard deviation is so many times the median of all.
BURST = 4.0


def quantum(x: Array) -> float:
    """Smallest step between values that occur."""
    return float(np.diff(np.unique(np.round(x, 9))).min()) if np.unique(x).size > 1 else 0.0


def allan(x: Array, rate: float) -> tuple[Array, Array]:
    """Cluster times and overlapping Allan deviation."""
    angle = np.concatenate([[0.0], np.cumsum(x - x.mean())]) / rate
    sizes = np.unique(np.logspace(0, np.log2(x.size / 4), int(2 * np.log2(x.size / 4)) + 1, base=2).astype(int))
    out = []
    for m in sizes:
        second = angle[2 * m :] - 2 * angle[m:-m] + angle[: -2 * m]
        out.append(np.sqrt(np.mean(second**2) / 2) * rate / m)
    return sizes / rate, np.array(out)


def lines(x: Array, rate: float) -> list[tuple[float, float]]:
    """Frequencies and amplitudes of lines, the strongest first."""
    n = int(2 ** np.floor(np.log2(max(x.size // 8, 64))))
    window = np.hanning(n)
    starts = range(0, x.size - n + 1, n // 2)
    blocks = np.array([(x[s : s + n] - x[s : s + n].mean()) * window for s in starts])
    power = np.mean(np.abs(np.fft.rfft(blocks, axis=1)) ** 2, axis=0)
    wide = max(n // 64, 8)
    around = np.array([np.median(power[max(k - wide, 1) : k + wide]) for k in range(power.size)])
    need = 1.0 + (LINE - 1.0) / np.sqrt(len(blocks) / 8.0 + 1.0) * 2.0
    peaks = [
        k
        for k in range(4, power.size - 2)
        if power[k] > need * around[k] and power[k] == power[max(k - 4, 0) : k + 5].max()
    ]
    found = [(k * rate / n, 2.0 * np.sqrt(power[k]) / window.sum()) for k in peaks]
    return sorted(found, key=lambda item: -item[1])[:4]


def drift(x: Array, rate: float) -> tuple[float, float]:
    """Slope in units an hour and a standard deviation from the scatter of its eighths."""
    t = np.arange(x.size) / rate / 3600.0
    means = np.array([p.mean() for p in np.array_split(x, 8)])
    times = np.array([p.mean() for p in np.array_split(t, 8)])
    slope, level = np.polyfit(times, means, 1)
    left = means - slope * times - level
    sd = np.sqrt(left @ left / 6 / np.sum((times - times.mean()) ** 2))
    return float(slope), float(sd)


def bursts(x: Array, rate: float) -> NDArray[np.int64]:
    """Seconds whose standard deviation stands out."""
    n = max(int(rate), 8)
    blocks = x[: x.size // n * n].reshape(-1, n)
    spread = blocks.std(axis=1)
    found: NDArray[np.int64] = np.flatnonzero(spread > BURST * np.median(spread))
    return found


def read(path: Path, columns: list[int], delimiter: str | None, skip: int) -> Array:
    """Rows of the columns that are asked for; rows with gaps are left out."""
    if path.suffix == ".npz":
        held = np.load(path)
        rows = np.column_stack([held[k] for k in held.files])[:, columns]
    else:
        rows = np.genfromtxt(path, delimiter=delimiter, skip_header=skip, usecols=columns)
        rows = rows.reshape(-1, len(columns))
    return rows[np.isfinite(rows).all(axis=1)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--columns", type=int, nargs="+", default=[0])
    parser.add_argument("--rate", type=float, default=100.0)
    parser.add_argument("--delimiter", default=None)
    parser.add_argument("--skip", type=int, default=0)
    parser.add_argument("--temperature", type=int, help="its place in --columns")
    given = parser.parse_args()
    rows = read(given.file, given.columns, given.delimiter, given.skip)
    print(f"{given.file.name}: {rows.shape[0]} rows, {rows.shape[0] / given.rate:.0f} s")
    loud: dict[int, int] = {}
    for k in range(rows.shape[1]):
        x = rows[:, k]
        tau, deviation = allan(x, given.rate)
        low = int(deviation.argmin())
        one = float(np.interp(1.0, tau, deviation))
        slope, sd = drift(x, given.rate)
        floor = f"{deviation[low]:.3g} at {tau[low]:.0f} s (B {deviation[low] / 0.664:.3g})"
        for second in bursts(x, given.rate):
            loud[int(second)] = loud.get(int(second), 0) + 1
        spread = f"mean {x.mean():.6g} sd {x.std():.3g} quantum {quantum(x):.3g}; Allan at 1 s {one:.3g}, floor {floor}"
        about = "  ".join(f"{f:.3f} Hz {a:.3g}" for f, a in lines(x, given.rate))
        loudest = bursts(x, given.rate).size
        print(f"  {given.columns[k]}: {spread}")
        print(f"     drift {slope:.3g} +- {sd:.2g} an hour; lines {about or 'none'}; bursts {loudest} s")
        if given.temperature is not None and k != given.temperature:
            warm = np.array([p.mean() for p in np.array_split(rows[:, given.temperature], 60)])
            means = np.array([p.mean() for p in np.array_split(x, 60)])
            fit = np.polyfit(warm, means, 1)
            left = means - np.polyval(fit, warm)
            err = np.sqrt(left @ left / 58 / np.sum((warm - warm.mean()) ** 2))
            shares = f"of the means' scatter {means.std():.3g} is left {left.std():.3g}"
            print(f"     {fit[0]:.3g} +- {err:.2g} a degree; {shares}")
    common = sorted(second for second, count in loud.items() if count > rows.shape[1] // 2)
    print(f"  seconds loud on more than half of the channels: {len(common)} {common[:12]}")


if __name__ == "__main__":
    main()
