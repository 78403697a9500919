"""Every number that decides something in the analysis, with unit, range and source; `triage config` prints them."""
