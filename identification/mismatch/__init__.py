"""Differences between a baseline model and a recording: a catalogue of effects, fitted, compared and named."""
