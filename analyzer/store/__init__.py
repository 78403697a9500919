"""Results stored as Parquet, and maintenance of the store."""
