"""Results kept as Parquet, and what looks after them."""
