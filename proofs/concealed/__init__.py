"""Sealed cases that prove `triage explain`; shares no code with the packages it judges."""
