"""Finder of loops in an unordered list of tags: by names, then by the data."""
