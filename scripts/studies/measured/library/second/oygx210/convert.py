"""The bag's two units as a table: the MEMS unit's rate, and that of the fibre-optic unit read off at its times.

Times are those at which the messages were recorded, for the units' own clocks are years apart.
"""

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

#: Topic and first byte of three doubles of rate, counted from the end of the message.
UNITS = {"sbg": ("/sbg/imu_data", 76), "ixblue": ("/ixblue_ins_driver/standard/imu", 192)}


def records(data: bytes, at: int = 0) -> Iterator[tuple[dict[str, bytes], bytes]]:
    while at < len(data):
        header = data[at + 4 : at + 4 + struct.unpack_from("<I", data, at)[0]]
        at += 4 + len(header)
        body = data[at + 4 : at + 4 + struct.unpack_from("<I", data, at)[0]]
        at += 4 + len(body)
        yield fields(header), body


def fields(header: bytes) -> dict[str, bytes]:
    found, at = {}, 0
    while at < len(header):
        (size,) = struct.unpack_from("<I", header, at)
        name, _, value = header[at + 4 : at + 4 + size].partition(b"=")
        found[name.decode()] = value
        at += 4 + size
    return found


rows: dict[str, list[tuple[float, ...]]] = {name: [] for name in UNITS}
topics: dict[bytes, str] = {}
bag = Path("raw/Experiences/Rotations.bag").read_bytes()
for chunk, content in records(bag, bag.index(b"\n") + 1):
    if chunk["op"] != b"\x05":  # a chunk, not compressed in this bag
        continue
    for header, body in records(content):
        if header["op"] == b"\x07":
            topics[header["conn"]] = header["topic"].decode()
            continue
        for name, (topic, place) in UNITS.items():
            if header["op"] == b"\x02" and topics[header["conn"]] == topic:
                seconds, nanoseconds = struct.unpack("<II", header["time"])
                rate = struct.unpack_from("<3d", body, len(body) - place)
                rows[name].append((seconds + 1e-9 * nanoseconds, *rate))
own, reference = np.array(rows["sbg"]), np.array(rows["ixblue"])
there = (own[:, 0] > reference[0, 0]) & (own[:, 0] < reference[-1, 0])
own = own[there]
beside = [np.interp(own[:, 0], reference[:, 0], reference[:, k]) for k in (1, 2, 3)]
table = np.column_stack([own[:, 0] - own[0, 0], own[:, 1:], *beside])
head = "time,sbg_x,sbg_y,sbg_z,ixblue_x,ixblue_y,ixblue_z"
np.savetxt("rotations.csv", table, delimiter=",", header=head, comments="", fmt="%.12g")
