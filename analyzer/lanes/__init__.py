"""Reasons why a loop needs a look: one object per lane."""
