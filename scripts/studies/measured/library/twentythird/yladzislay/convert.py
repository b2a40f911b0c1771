"""Two units of an autopilot in flight, the first one's temperature beside them; longest stretches without a gap."""

from pathlib import Path

from dataflash import two_units

for file in sorted(Path("raw").rglob("*.bin")):
    two_units(file, Path(f"{file.stem}.csv"), 1e-6, {"T": 9})
