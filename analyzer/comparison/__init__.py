"""Spans of hours before and after a change, compared."""
