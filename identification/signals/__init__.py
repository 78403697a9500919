"""Model-free signal analysis: spectra, responses to set point moves, and variance relative to its minimum."""
