"""Rows of the records $VNYMR (yaw, pitch, roll, field, acceleration, rates) with the stamps beside them."""

from pathlib import Path

from vectornav import NAMES, of_a_table, save

(log,) = Path("raw/lab5/src/data").glob("*imu.csv")
save("car.csv", NAMES, of_a_table(log), digits=9)
