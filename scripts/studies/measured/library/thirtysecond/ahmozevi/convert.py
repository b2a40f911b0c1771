"""The last ten minutes on the desk, from 12:30:30 on, after the board was turned in the hand."""

import csv

with open("raw/Week-5/gyroscope_data.csv", newline="") as file:
    rows = list(csv.reader(file))
with open("desk.csv", "w", newline="") as file:
    write = csv.writer(file, lineterminator="\n")
    write.writerow(["gyro_x", "gyro_y", "gyro_z"])
    write.writerows(row[1:4] for row in rows[1:] if row[0] >= "2024-08-13T12:30:30")
