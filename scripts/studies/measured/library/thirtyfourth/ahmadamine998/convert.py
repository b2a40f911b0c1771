"""A model car on a track: its gyro beside the yaw that its lidar finds on the map, and beside the yaw of its own unit.

Stamps are of ROS (seconds and nanoseconds). The poses are read at the gyro's stamps. The unit's yaw counts clockwise:
it is turned round here.
"""

from pathlib import Path

import numpy as np

RAW = Path("raw/DataSets")


def table(path: Path) -> dict[str, np.ndarray]:
    """Columns of a file by their names."""
    names = path.read_text(encoding="utf-8").split("\n", 1)[0].split(",")
    return dict(zip(names, np.genfromtxt(path, delimiter=",", skip_header=1).T, strict=True))


for name in ("DS1", "DS3", "DS4"):
    unit, pose = table(RAW / name / "imuData.csv"), table(RAW / name / "pfPoseData.csv")
    start = unit["s"][0]
    at, stamps = ((each["s"] - start) + each["ns"] * 1e-9 for each in (unit, pose))
    x, y, z, w = (pose[f"q.{axis}"] for axis in "xyzw")
    yaw = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    later = np.r_[True, np.diff(stamps) > 0]
    kept = np.r_[True, np.diff(at) > 0] & (at >= stamps[0]) & (at <= stamps[-1])
    own = -np.unwrap(unit["phi_y"], period=360.0)
    rows = np.column_stack([at, unit["wz"], np.interp(at, stamps[later], yaw[later]), own])[kept]
    head = "time_s,gyro_z_dps,lidar_yaw_rad,own_yaw_deg"
    np.savetxt(f"{name.lower()}.csv", rows, delimiter=",", header=head, comments="", fmt="%.9g")
