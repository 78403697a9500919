"""The cause of an oscillation and the fault of the valve."""
