"""A spinning rocket: the part in which it slows and speeds up again, and all of its spin beside what its gyro says.

tacho has the spin that the radial accelerometer (z, 38.0 mm off the axis) tells.
"""

import numpy as np

SLOW, SPIN, ARM = (31.0, 73.0), 24.7, 0.0380

t, _, ay, az, wx, *_ = np.loadtxt("raw/data/imu.csv", delimiter=",", skiprows=1).T
slow, spin = (t >= SLOW[0]) & (t < SLOW[1]), t >= SPIN
np.savez("slow.npz", t=t[slow], ay=ay[slow], az=az[slow], wx=wx[slow])
np.savez("tacho.npz", t=t[spin], wx=wx[spin], spin=np.sqrt(np.maximum(-az[spin], 0.0) / ARM))
