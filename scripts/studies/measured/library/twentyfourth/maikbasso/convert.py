"""Two units of an autopilot in three flights, each flight's longest stretch without a gap."""

from pathlib import Path

from dataflash import two_units

for number in ("15", "17", "18"):
    two_units(Path(f"raw/logs/000000{number}.BIN"), Path(f"{number}.csv"), 1e-6)
