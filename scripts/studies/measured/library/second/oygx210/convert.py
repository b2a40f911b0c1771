"""The bag's two units as a table: the MEMS unit's rate, and that of the fibre-optic unit read off at its times.

Times are those at which the messages were recorded, for the units' own clocks are years apart.
"""

import struct
from pathlib import Path

import numpy as np

from insenv.data.readers.bags import messages_of_bag

#: Topic and first byte of three doubles of rate, counted from the end of the message.
UNITS = {"sbg": ("/sbg/imu_data", 76), "ixblue": ("/ixblue_ins_driver/standard/imu", 192)}


rows: dict[str, list[tuple[float, ...]]] = {name: [] for name in UNITS}
for message in messages_of_bag(Path("raw/Experiences/Rotations.bag")):
    for name, (topic, place) in UNITS.items():
        if message.topic == topic:
            rows[name].append((message.recorded, *struct.unpack_from("<3d", message.body, len(message.body) - place)))
own, reference = np.array(rows["sbg"]), np.array(rows["ixblue"])
there = (own[:, 0] > reference[0, 0]) & (own[:, 0] < reference[-1, 0])
own = own[there]
beside = [np.interp(own[:, 0], reference[:, 0], reference[:, k]) for k in (1, 2, 3)]
table = np.column_stack([own[:, 0] - own[0, 0], own[:, 1:], *beside])
head = "time,sbg_x,sbg_y,sbg_z,ixblue_x,ixblue_y,ixblue_z"
np.savetxt("rotations.csv", table, delimiter=",", header=head, comments="", fmt="%.12g")
