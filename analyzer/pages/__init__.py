"""Results to pages: read from the store, put into words, handed to the renderers as data."""
