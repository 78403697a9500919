"""Loops drawn at random, simulated and recorded in many ways, by code that shares nothing with the packages."""
