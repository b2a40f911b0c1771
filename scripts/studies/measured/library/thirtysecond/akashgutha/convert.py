"""The rows before the unit is turned about."""

from itertools import islice

with open("raw/IMU_data.csv") as file, open("rest.csv", "w") as rest:
    rest.writelines(islice(file, 1381))
