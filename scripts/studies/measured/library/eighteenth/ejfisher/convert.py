"""Accelerometers and gyros, kept in two files, of the rows in which the board is left alone."""


def rows(name):
    out = []
    with open(f"raw/{name}.csv", encoding="utf-8", errors="replace") as lines:
        for line in lines:
            try:
                values = [float(x) for x in line.strip().strip(",").split(",")]
            except ValueError:
                continue
            if len(values) == 3:
                out.append(values)
    return out[500:840]


with open("bench.csv", "w", encoding="utf-8") as out:
    out.write("ax,ay,az,gx,gy,gz\n")
    for a, g in zip(rows("acc"), rows("gyro"), strict=True):
        out.write(",".join(f"{x:g}" for x in (*a, *g)) + "\n")
