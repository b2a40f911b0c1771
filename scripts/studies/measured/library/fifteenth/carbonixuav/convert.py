"""Three IMUs on one autopilot, from a file of each quantity; stamps are whole milliseconds; without the first 20 s."""

from pathlib import Path

import numpy as np
import pandas as pd

log = next(Path("raw/tests/test_data/expected_output").glob("LogUID=*"))


def column(message, instance, name):
    table = pd.read_parquet(log / f"MessageType={message}/Instance={instance}/KeyName={name}/file.parquet")
    return table.Timestamp.to_numpy() * 1e-3, table.Value.to_numpy(float)


start = column("IMU", 0, "GyrX")[0]
names = [(k, i) for i in range(3) for k in ("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ", "T")]
values = [column("IMU", i, k)[1][-start.size :] for k, i in names]
time = start - start[0]
rows = np.column_stack([time, *values])[time > 20.0]
head = ",".join(["t", *(f"{k}{i}" for k, i in names)])
np.savetxt("turned.csv", rows, fmt="%.9g", delimiter=",", header=head, comments="")
still = rows[rows[:, 0] > 168.0]
np.savetxt("still.csv", still, fmt="%.9g", delimiter=",", header=head, comments="")
