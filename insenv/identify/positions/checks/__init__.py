"""What rests of several positions leave that no effect explains."""
