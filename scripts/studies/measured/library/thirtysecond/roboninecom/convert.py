"""Servos of a test stand: positions and speeds of 4096 steps to a turn, in deg; bit 15 of a speed is its sign."""

import csv
from datetime import datetime
from pathlib import Path

import numpy as np

for log, servo in (("motor_telemetry_comp2", 3), ("motor_telemetry_single_3250", 1)):
    with Path(f"raw/logs/{log}.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row[f"pos ({servo})"]]
    stamps = [datetime.fromisoformat(row["timestamp"].replace("Z", "+00:00")).timestamp() for row in rows]
    speed = np.array([int(row[f"speed ({servo})"]) for row in rows])
    speed = np.where(speed >= 32768, 32768 - speed, speed)
    position = np.array([int(row[f"pos ({servo})"]) for row in rows])
    table = np.column_stack([np.array(stamps) - stamps[0], position * 360 / 4096, speed * 360 / 4096])
    name = log.removeprefix("motor_telemetry_")
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,angle_deg,speed", comments="", fmt="%.9g")
