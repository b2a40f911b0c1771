"""What a claim of the loop is worth on one recording: the loop, closed on copies of it that were altered."""
