"""Two units of an autopilot in two flights: gyros and accelerometers, each flight's longest stretch without a gap."""

from pathlib import Path

from dataflash import two_units

for number, name in {"1": "first", "3": "third"}.items():
    two_units(Path(f"raw/{number}.BIN"), Path(f"{name}.csv"), 1e-3)
