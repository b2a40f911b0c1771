"""What changes within the rows, faster than their means: disturbances, lines that move, noise louder at some times."""
