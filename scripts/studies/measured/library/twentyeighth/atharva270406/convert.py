"""The last rest before the board was put away: rows from 2735 s to 2987 s after the first one."""

from datetime import datetime
from pathlib import Path

lines = Path("raw/5.2D/gyro_history.csv").read_text(encoding="utf-8").splitlines()
start = datetime.fromisoformat(lines[1].split(",")[0])
rest = [
    line
    for line in lines[1:]
    if 2735.0 <= (datetime.fromisoformat(line.split(",")[0]) - start).total_seconds() <= 2987.0
]
Path("rest.csv").write_text("\n".join([lines[0], *(line.replace("Z", "") for line in rest)]) + "\n", encoding="utf-8")
