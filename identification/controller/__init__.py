"""Which law gives OP from SP and PV."""
