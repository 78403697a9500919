"""Spectra, responses to set point moves, and variance against its minimum: what trends say without a model."""
