"""A bench of one axle for a rotor, its arm at rest: decimal commas and accented headings made a plain table."""

from pathlib import Path

(source,) = Path("raw").rglob("Bras au repos pendant 30s.csv")
rows = [line.replace(",", ".").split(";") for line in source.read_text(encoding="latin-1").splitlines()[1:]]
with Path("still.csv").open("w", encoding="utf-8") as out:
    out.write("time,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z\n")
    out.writelines(f"{int(row[1]) / 1000:.2f},{','.join(row[4:10])}\n" for row in rows if len(row) == 10)
