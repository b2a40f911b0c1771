"""Rows of six files without the blocks of zero bytes and the second headers that stand in them."""

from pathlib import Path

for path in Path("raw").glob("imu_data_*.csv"):
    lines = path.read_bytes().replace(b"\0", b"").decode().splitlines()
    rows = [line for line in lines if line[:1].isdigit()]
    Path(path.name).write_text("\n".join([lines[0], *rows]) + "\n")
