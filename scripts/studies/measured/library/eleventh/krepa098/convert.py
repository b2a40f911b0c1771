"""Lists in JSON as tables: a gyro's rest, and an accelerometer on five faces with a number for each."""

import json
from pathlib import Path

import numpy as np

gyro = np.array(json.loads(Path("raw/test_files/gyro_test_data_1.json").read_text(encoding="utf-8"))["gyro"])
np.savetxt("gyro_rest.csv", gyro, fmt="%.9g", delimiter=",", header="gx,gy,gz", comments="")
accel = np.array(json.loads(Path("raw/test_files/accel_test_data_1.json").read_text(encoding="utf-8"))["acc"])
faces = [(4, 90), (98, 198), (206, 333), (341, 559), (567, 632)]
rows = np.concatenate([np.column_stack((accel[a:b], np.full(b - a, k))) for k, (a, b) in enumerate(faces)])
np.savetxt("faces.csv", rows, fmt="%.9g", delimiter=",", header="ax,ay,az,face", comments="")
