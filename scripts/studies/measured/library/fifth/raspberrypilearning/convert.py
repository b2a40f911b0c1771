"""The second part of the log out of its archive, 58 hours after a gap of 12 in which the unit was turned."""

import csv
import io
import zipfile

NAME = "astro_pi_data_20150824_085954"
FIRST = 3902

with zipfile.ZipFile(f"raw/data/{NAME}.zip") as archive:
    lines = archive.read(f"{NAME}.csv").decode()
head, *rows = csv.reader(io.StringIO(lines))
with open("astro_pi.csv", "w", newline="") as file:
    csv.writer(file).writerows([head, *rows[FIRST:]])
