"""What everything else stands on: units, the Earth, motion, recordings, manifests and their readers."""
