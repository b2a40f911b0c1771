"""The owner's logs without their last lines, which were cut off as they were written."""

from pathlib import Path

for test in (1, 4):
    lines = Path(f"raw/SensorLogs/stationarytest{test}.txt").read_text().splitlines(keepends=True)
    Path(f"still{test}.txt").write_text("".join(lines[:-1]))
