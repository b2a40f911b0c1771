"""What carries the instruments: commands in, exposure (`Motion`) out. Pure and batched."""
