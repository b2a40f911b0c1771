"""The owner's table without its line 103, whose time lacks its fraction."""

from pathlib import Path

lines = Path("raw/Loose-GNSS-IMU/Loose-GNSS-IMU/Input/IMU.txt").read_text().splitlines(keepends=True)
Path("rest.txt").write_text("".join(lines[:102] + lines[103:]))
