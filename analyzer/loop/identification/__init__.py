"""Process and valve of one loop, fitted to its record."""
