"""A gyro at rest: the log's one column under a name."""

from pathlib import Path

values = Path("raw/gyro2_x.txt").read_text(encoding="utf-8").split()
Path("gyro2_x.csv").write_text("\n".join(["gyro", *values]) + "\n", encoding="utf-8")
