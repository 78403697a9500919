"""One loop over one span: what is fit for use, what oscillates, why, and what to do."""
