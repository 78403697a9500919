"""Oscillations of one plant that are one oscillation: who shares it, where it starts, what it means for each."""
