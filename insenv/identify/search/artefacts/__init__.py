"""What reading, reference and recording make that an effect would follow: told from a law of the instrument."""
