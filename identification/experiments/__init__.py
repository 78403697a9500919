"""Experiments in a record: steps, pulses, ramps and set point steps are found, and each is fitted over its answer."""
