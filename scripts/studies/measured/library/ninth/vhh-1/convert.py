"""The longest stretch of the log in which the rocket's computer lies on the table, in the columns of the log."""

from pathlib import Path

FIRST, LAST = 9300, 16400

lines = Path("raw/rocket_sensor_log2.csv").read_text().splitlines(keepends=True)
Path("rest.csv").write_text("".join([lines[0], *lines[1 + FIRST : 1 + LAST]]))
