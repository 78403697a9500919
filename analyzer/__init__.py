"""Which loops, in what order, kept where; the command line. Imports all other packages."""
