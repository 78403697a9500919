"""Information on loops: loops.csv, changes.csv, tags and their endings."""
