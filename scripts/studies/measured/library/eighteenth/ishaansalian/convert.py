"""The rows of the accelerometers alone, of the time in which the board lay still."""

with open("raw/Data/imu.csv", encoding="utf-8", errors="replace") as lines:
    rows = [line.strip().split(",") for line in list(lines)[1:] if "IMU" in line]
rows = [row for row in rows if len(row) >= 7][1150:3650]
with open("board.csv", "w", encoding="utf-8") as out:
    out.write("t,x,y,z\n")
    for row in rows:
        out.write(f"{float(row[0]) / 1000:.3f},{row[3]},{row[4]},{row[5]}\n")
