"""New settings of one loop, and `triage tune`."""
