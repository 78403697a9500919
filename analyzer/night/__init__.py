"""Batch run over many loops and a night: in chunks, on workers, combined and resumed."""
