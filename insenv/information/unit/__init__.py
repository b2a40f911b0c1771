"""What positions and turns of a whole unit tell of its errors: linear model, sequences, weak directions."""
