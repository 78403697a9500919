"""Which tags of a bag make which loops: by names, then by what the data show."""
