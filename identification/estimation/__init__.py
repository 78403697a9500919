"""Estimation of process, valve and noise from OP and PV."""
