"""Left wheel of a robot that a slowly rising voltage drives backwards.

Distance and speed of a wheel in m and m/s, in angle and rate by the length of a turn that the file gives.
"""

from frc_characterization import write_wheel

write_wheel("raw/characterization-data20210503-1848.json", "slow-backward", "left", "back.csv")
