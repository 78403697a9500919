"""One loop over one span: usable samples, oscillations, their cause, and the action."""
