"""A whole unit on a table of several axes: its kinematics, the turns of the table, and what the unit feels."""
