"""What a procedure can tell, before it is run: information, bounds, and what no data of it can separate."""
