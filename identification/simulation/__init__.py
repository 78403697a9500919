"""The simulator: valve, valve chain, process, and the loop open or closed."""
