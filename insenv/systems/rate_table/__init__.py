"""Scale factor and bias on a rate table: its environment and how it is drawn."""
