"""Stamps and accelerations of the first 330 rows, before the phone is touched."""

with open("raw/accel_6.csv", encoding="utf-8") as lines:
    rows = [line.strip().split(";") for line in lines]
rows = [row for row in rows if row[0][:2] == "20" and len(row) >= 7][:330]
with open("desk.csv", "w", encoding="utf-8") as out:
    out.write("t,x,y,z\n")
    for row in rows:
        out.write(f"{float(row[1]) - float(rows[0][1]):.6f},{row[3]},{row[4]},{row[5]}\n")
