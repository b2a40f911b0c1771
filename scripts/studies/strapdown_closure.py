"""Error-free motion -> increments -> mechanisation: what is left, per sampling rate, as a page of Markdown.

python scripts/studies/strapdown_closure.py > docs/strapdown.md
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from insenv.core.attitude import dcm_from_angles, misalignment
from insenv.core.recording import Floats
from insenv.navigation import strapdown
from insenv.navigation import truth as strapdown_truth

RATES = (10, 50, 100, 200, 400)
POSITION = (np.radians(38.0), np.radians(114.0), 380.0)
ATTITUDE = dcm_from_angles(np.radians(30.0), np.radians(2.0), np.radians(-3.0))


@dataclass(frozen=True)
class Case:
    """Increments, and the attitude before and after them."""

    gyro: Floats
    accelerometer: Floats
    first: Floats
    last: Floats


PAGE = """\
# Strapdown mechanisation

`insenv.navigation.strapdown` turns the increments of six axes into attitude and velocity, in east-north-up with the
body axes right, forward, up. There are two mechanisations with one step of attitude and velocity:

* `static_mechanisation`: velocity zero in the Coriolis acceleration and in the transport rate, position fixed. The
  velocity is a plain integral of what the attitude's error and the sensors' errors leave of gravity, as alignment and
  calibration at rest want it.
* `full_mechanisation`: velocity fed back, transport rate and position on the WGS 84 ellipsoid. The vertical channel is
  free.

```python
import numpy as np

from insenv.navigation import strapdown, truth as strapdown_truth
from insenv.core.attitude import dcm_from_angles, misaligned, misalignment

position = (np.radians(38.0), 0.0, 380.0)  # latitude, longitude, height
attitude = dcm_from_angles(np.radians(30.0), 0.0, 0.0)  # heading, pitch, roll
gyro, accelerometer = strapdown_truth.increments_at_rest(attitude, position, 0.01, 6000)

start = strapdown.initial(misaligned(attitude, (0.0, 1e-4, 0.0)), position)  # level error about north
trajectory, end = strapdown.static_mechanisation(gyro, accelerometer, 0.01, start, every=100)
assert trajectory.velocity.shape == (60, 3)
assert abs(trajectory.velocity[-1, 0] + 9.8 * 1e-4 * 60.0) < 1e-4  # -g phi_N t
assert abs(misalignment(end.dcm, attitude)[1] - 1e-4) < 1e-7
```

Leading axes are a batch. A run may be cut into chunks, with `end` of one as the start of the next; chunks and batches
give the same bits as the whole and as the run alone. Coning and sculling are compensated with the previous increment,
one sample per update (Savage 1998); the equations are in `insenv.navigation.kernel`.

## Closure

Error-free motion, integrated to increments (`insenv.navigation.truth`), goes through the mechanisation. What is
left is the error of the algorithm and of rounding. This page is written by

```sh
python scripts/studies/strapdown_closure.py > docs/strapdown.md
```

Latitude 38 deg, height 380 m; heading 30 deg, pitch 2 deg, roll -3 deg at the start, known exactly. Speed: the largest.
Heading and level: errors at the end, level the larger of two.

"""
REMARK = r"""

At 10 Hz the coning motion has two samples a period, and nothing can be made of them. Otherwise its heading drifts by
$A^2\omega\,(\omega\Delta t)^4/60$, with the half angle $A$: sixteen times less at twice the rate.
"""


def main() -> None:
    parts = (f"### {title}\n\n{table(make)}" for title, make in CASES.items())
    print(PAGE + "\n\n".join(parts) + REMARK, end="")


def table(make: Callable[[int], Case]) -> str:
    columns = ("speed [m/s]", "heading [deg]", "level [deg]")
    heads = [f"{name}, {column}" for name in ("static", "full") for column in columns]
    rows = ["| rate | " + " | ".join(heads) + " |", "|---" * 7 + "|"]
    return "\n".join(rows + [f"| {rate} Hz | " + " | ".join(cells(rate, make(rate))) + " |" for rate in RATES])


def cells(rate: int, case: Case) -> Iterator[str]:
    """What each mechanisation leaves."""
    for mechanise in (strapdown.static_mechanisation, strapdown.full_mechanisation):
        start = strapdown.initial(case.first, POSITION)
        trajectory, end = mechanise(case.gyro, case.accelerometer, 1.0 / rate, start)
        phi = np.degrees(np.abs(misalignment(end.dcm, case.last)))
        for left in (np.linalg.norm(trajectory.velocity, axis=-1).max(), phi[2], phi[:2].max()):
            yield f"{left:.0e}"


def at_rest(rate: int) -> Case:
    return Case(*strapdown_truth.increments_at_rest(ATTITUDE, POSITION, 1.0 / rate, 3600 * rate), ATTITUDE, ATTITUDE)


def on_path(path: strapdown_truth.Path, t: Floats) -> Case:
    first, last = path(t[[0, -1]]).dcm
    return Case(*strapdown_truth.increments(path, t), first, last)


def turning(axis: Sequence[float], rate: int) -> Case:
    """170 deg in 20 s: 5 s faster, 10 s steady, 5 s slower."""
    t = np.arange(20 * rate + 1) / rate
    top = np.radians(170.0) / 15.0
    speed = top * np.clip(np.minimum(t, 20.0 - t) / 5.0, 0.0, 1.0)
    early, late = np.minimum(t, 5.0), np.maximum(t - 15.0, 0.0)
    angle = top * (early**2 / 10.0 + np.clip(t - 5.0, 0.0, 10.0) + late - late**2 / 10.0)
    path = strapdown_truth.turn(t, angle, speed, ATTITUDE, POSITION, axis)
    return on_path(path, t)


def coning(rate: int) -> Case:
    t = np.arange(60 * rate + 1) / rate
    path = strapdown_truth.coning(np.radians(1.0), 5.0, ATTITUDE, POSITION)
    return on_path(path, t)


SLOPE = np.radians(3.0)
CASES: dict[str, Callable[[int], Case]] = {
    "At rest, 1 h": at_rest,
    "Turn by 170 deg in 20 s about up": lambda rate: turning((0.0, 0.0, 1.0), rate),
    "The same on a slope of 3 deg": lambda rate: turning((np.sin(SLOPE), 0.0, np.cos(SLOPE)), rate),
    "Coning of 1 deg at 5 Hz, 60 s": coning,
}


if __name__ == "__main__":
    main()
