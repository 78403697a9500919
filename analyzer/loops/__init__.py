"""What is known of the loops: loops.csv, changes.csv, tags and their endings."""
