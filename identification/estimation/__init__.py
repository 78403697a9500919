"""How process, valve and noise are estimated from OP and PV."""
