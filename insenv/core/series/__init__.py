"""What is computed of a series of samples: deviations, spectra, tails of tests, stretches, the motion behind it."""
