"""Identification of the control law that gives OP from SP and PV."""
