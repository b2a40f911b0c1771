"""Gyros of a board on a desk: the rows before it is turned in the hand for the first time, and those after the last."""

from pathlib import Path

lines = Path("raw/week6/gyro_samples_clean.csv").read_text().splitlines()
Path("desk.csv").write_text("\n".join(lines[:7251]) + "\n")
Path("later.csv").write_text("\n".join(lines[:1] + lines[12701:]) + "\n")
