"""Where the search for an effect's parameters begins."""
