"""Comparison of spans of hours before and after a change."""
