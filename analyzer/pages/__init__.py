"""Conversion of results to pages: read from the store, put into words, passed to the renderers as data."""
