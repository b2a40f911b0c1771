"""The gyros of the board without the last rows, which have a time alone."""

import csv

with open("raw/s_Arduino.csv", newline="") as file:
    rows = list(csv.reader(file))
with open("board_gyros.csv", "w", newline="") as file:
    write = csv.writer(file, lineterminator="\n")
    write.writerow(["time_s", "gyro_x", "gyro_y", "gyro_z"])
    write.writerows(row[:4] for row in rows[1:] if "" not in row[:4])
