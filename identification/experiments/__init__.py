"""Detection of experiments in a record (steps, pulses, ramps, set point steps) and a fit of each response."""
