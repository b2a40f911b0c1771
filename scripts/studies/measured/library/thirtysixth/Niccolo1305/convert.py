"""Two chips on the faces of a cube: the owner's means of each test at rest, one row a test, with its temperature.

The logs themselves are not public. Of tests with several reports the plain one is taken.
"""

import csv
import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

RAW = Path("raw/reports")
HEAD = ["test", *(f"acc_{c}_g" for c in "xyz"), *(f"gyro_{c}_dps" for c in "xyz"), "temp_c"]
BMI270 = (83, 89, 94, 95, 96, 105, 106, 111, 115, 116, 117, 118, 123, 148)
MPU6886 = ("012", "013", "014_dlpf20", "015_dlpf20", "016_dlpf20", "017_dlpf20")
#: Names of a mean temperature [degC], by the evaluation's age.
WARMTH = ("temp_mean_c", "mean_c", "temp_plateau_mean_c")


def told(path: str) -> Any:
    return json.loads((RAW / path).read_text(encoding="utf-8"))


def warmth(report: Any) -> float | None:
    """The first mean temperature that stands in a report, however deep [degC]."""
    if not isinstance(report, dict):
        return None
    own = next((report[name] for name in WARMTH if isinstance(report.get(name), float)), None)
    within = (warmth(part) for part in report.values())
    return own if own is not None else next((found for found in within if found is not None), None)


def means(axes: Mapping[str, Any]) -> list[float]:
    return [axes[c]["mean"] for c in "xyz"]


def bmi270() -> Iterator[list[float]]:
    for test in BMI270:
        report = told(f"bmi270/tel_{test}_bosch_static_report.json")
        axes = report["axis_metrics"]
        temperature = report["thermal_plateau"].get("temp_mean_c", math.nan)
        yield [test, *means(axes["accel"]), *means(axes["gyro"]), temperature]


def mpu6886() -> Iterator[list[float]]:
    with (RAW / "mpu6886/MPU6886_static_long_summary.csv").open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            names = (*(f"acc_{c}_mean_g" for c in "xyz"), *(f"gyr_{c}_mean_dps" for c in "xyz"), "temp_mean_c")
            yield [int(row["test"][-3:]), *(float(row[name]) for name in names)]
    for test in MPU6886:
        report = told(f"mpu6886/MPU6886_{test}_analysis.json")
        accel, gyro = report.get("acc") or report["accel_g"], report.get("gyro") or report["gyro_dps"]
        yield [int(test[:3]), *means(accel), *means(gyro), warmth(report)]


for table, rows in (("bmi270", bmi270()), ("mpu6886", mpu6886())):
    with Path(f"{table}.csv").open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(HEAD)
        out.writerows([f"{value:.9g}" for value in row] for row in rows)
