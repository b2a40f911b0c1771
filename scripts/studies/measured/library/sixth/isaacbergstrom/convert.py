"""Rows of a buoy's log without the comments and the summaries that stand among them."""

from pathlib import Path

for name in ("accel8_real", "accel42_real"):
    lines = Path(f"raw/{name}.csv").read_text().splitlines()
    head = next(line for line in lines if line.startswith("timestamp_s"))
    rows = [line for line in lines if line[:1].isdigit()]
    Path(f"{name}.csv").write_text("\n".join([head, *rows]) + "\n")
