"""One record: its usable samples on one clock, and the stretch that is assessed."""
