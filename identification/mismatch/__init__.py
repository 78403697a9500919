"""Where a plain loop and its recording differ: the catalogue of left-out physics, fitted, compared, named."""
