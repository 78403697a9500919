"""Plant-wide oscillations: the loops that share one, its source, and the consequences for each."""
