"""Gyros of a board on a desk: the rows before it is turned in the hand for the first time."""

from pathlib import Path

lines = Path("raw/SIT225-week5/gyro_data.csv").read_text().splitlines()
Path("desk.csv").write_text("\n".join(lines[:3251]) + "\n")
