"""Many loops over a night: in chunks, on workers, put together and resumed."""
