"""Does the loop oscillate? Periods, amplitude and significance, and its performance figures."""
