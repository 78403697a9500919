"""Moves of OP in manual, steps of the set point and warm-ups: experiments in a record."""
