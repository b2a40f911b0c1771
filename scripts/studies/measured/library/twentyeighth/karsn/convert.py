"""Sheets of two workbooks without headings as tables with names."""

from pathlib import Path

import openpyxl

RAW = Path("raw")

for book, sheet, columns, names, out in (
    ("imu_sample.xlsx", "static", (0, 1, 2, 4, 5, 6), "accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z", "static.csv"),
    ("imu_tst.xlsx", "Sheet1", (0, 1, 2), "gyro_x,gyro_y,gyro_z", "gyros.csv"),
):
    rows = openpyxl.load_workbook(RAW / book, read_only=True)[sheet].iter_rows(values_only=True)
    kept = [[row[k] for k in columns] for row in rows]
    lines = [",".join(str(value) for value in row) for row in kept if all(isinstance(v, int | float) for v in row)]
    Path(out).write_text("\n".join([names, *lines]) + "\n", encoding="utf-8")
