"""The simulator: valve, valve chain, process, and the open or closed loop."""
