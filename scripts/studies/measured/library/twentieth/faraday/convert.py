"""Two units of a robot that speak in turn, each for itself, where both stand."""

from pathlib import Path

lines = [line.split(",") for line in Path("raw/imu_data.txt").read_text().splitlines()]
for address, name in (("0x68", "first"), ("0x69", "second")):
    rows = [",".join(line[2:]) for line in lines if line[1] == address][2250:]
    Path(f"{name}.csv").write_text("\n".join(["ax,ay,az,gx,gy,gz", *rows]) + "\n")
