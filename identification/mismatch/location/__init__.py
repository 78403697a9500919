"""Where simulation and recording differ."""
